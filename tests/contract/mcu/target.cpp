// SPDX-License-Identifier: MIT
// The suite's target "mcu": the image for the MPS2 board in QEMU, reset for each case, with Modbus RTU for
// the PLC and, for the bus, an SLCAN adapter played by the suite.

#include "contract/mcu/emulator.hpp"
#include "contract/remote/rtu_target.hpp"
#include "contract/remote/slcan_text.hpp"

namespace cbcan::contract {

namespace {

/// One emulator of each image for the whole program: starting it takes longer than most cases.
Emulator& reset_emulator(bool watches_plc) {
  static std::array<std::unique_ptr<Emulator>, 2> emulators;
  std::unique_ptr<Emulator>& emulator = emulators.at(watches_plc ? 1 : 0);
  if (emulator)
    emulator->reset();
  else
    emulator = std::make_unique<Emulator>(watches_plc ? CBCAN_IMAGE_WATCHES_PLC : CBCAN_IMAGE);
  return *emulator;
}

struct McuTarget final : RtuTarget {
  explicit McuTarget(const Settings& settings) : emulator_(reset_emulator(settings.plc_timeout != 0s)) {
    const std::string start = "\r\r\rC\rS6\rO\rt77F100\r";
    if (emulator_.can().receive(start.size()) != start)
      throw std::runtime_error("the image begins otherwise");
    emulator_.freeze();
  }
  ~McuTarget() override { check_stack(); }

  std::string next_frame() override {
    if (inbox_.empty()) {
      emulator_.settle();
      take_lines();
    }
    if (inbox_.empty()) return {};
    std::string frame = inbox_.front();
    inbox_.pop_front();
    return frame;
  }
  void arrive(const std::string& frame) override {
    emulator_.can().send(slcan_line(frame) + "\r");
    emulator_.settle();
  }

  void pass(Duration duration) override { emulator_.pass(static_cast<std::uint64_t>(duration.count())); }
  Duration precision() const override { return 1us; }

  void set_bus_state(BusState state) override {
    const char* const asked[] = {"F00\r", "F08\r", "F20\r", "F00\r"};
    emulator_.set_adapter_state(asked[static_cast<std::size_t>(state)]);
    emulator_.can().send(state == BusState::kBusOff ? "sb000255\r" : "sa000000\r");
    emulator_.settle();
  }

 private:
  std::string exchange(const std::string& request, std::size_t size) override {
    emulator_.can().wait_taken();
    emulator_.modbus().send(request);
    return emulator_.modbus().receive(size);
  }

  /// Frames go to the inbox; the commands that open an adapter and ask for its state need no response.
  void take_lines() {
    characters_ += emulator_.can().receive_available();
    for (std::size_t end = 0; (end = characters_.find('\r')) != std::string::npos;) {
      const std::string line = characters_.substr(0, end);
      characters_.erase(0, end + 1);
      if (is_slcan_frame(line)) inbox_.push_back(candump_text(line));
    }
  }

  Emulator& emulator_;
  std::string characters_;
  std::deque<std::string> inbox_;
};

}  // namespace

std::unique_ptr<Target> make_target(const Settings& settings) {
  return std::make_unique<McuTarget>(settings);
}

}  // namespace cbcan::contract
