// SPDX-License-Identifier: MIT
// The suite's target "mcu": the image for the MPS2 board in QEMU, reset for each case, with Modbus RTU for
// the PLC and, for the bus, an SLCAN adapter played by the suite.

#include "contract/target.hpp"
#include "cbcan/configuration.hpp"
#include "contract/mcu/emulator.hpp"
#include "contract/remote/slcan_text.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan::contract {

namespace {

constexpr std::size_t kFixedBytes = 5;  // station, function, byte count, CRC

std::string crc(const std::string& bytes) {
  const std::uint16_t value = test::modbus_crc(bytes);
  return {static_cast<char>(value), static_cast<char>(value >> 8)};
}

std::string big_endian(std::size_t value) {
  return {static_cast<char>(value >> 8), static_cast<char>(value)};
}

/// Prints at the end of the program the greatest depth of the stack in any case.
struct DeepestStack {
  DeepestStack() = default;
  DeepestStack(const DeepestStack&) = delete;
  DeepestStack& operator=(const DeepestStack&) = delete;
  ~DeepestStack() { std::cout << "figure: stack, at most " << bytes << " bytes over the contract's suite\n"; }
  std::uint16_t bytes = 0;
} deepest_stack;

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

struct McuTarget final : Target {
  explicit McuTarget(const Settings& settings) : emulator_(reset_emulator(settings.plc_timeout != 0s)) {
    const std::string start = "\r\r\rC\rS6\rO\rt77F100\r";
    if (emulator_.can().receive(start.size()) != start)
      throw std::runtime_error("the image begins otherwise");
    emulator_.freeze();
  }
  /// Every case ends with a check of the stack (docs/reference/registers.md, STACK_SIZE and STACK_USED).
  ~McuTarget() override {
    const Words size_and_used = read(4105, 2);
    const std::uint16_t used = size_and_used.at(1);
    CHECK(used <= size_and_used.at(0) / 2);
    deepest_stack.bytes = std::max(deepest_stack.bytes, used);
  }

  std::string lacks(Ability ability) const override {
    switch (ability) {
      case Ability::kBusState: return "";
      case Ability::kRefusal: return "the image's queue to the serial adapter holds more than a case sends";
      case Ability::kSecondReader:
      case Ability::kSecondClient: return "a Modbus RTU line has one client";
      case Ability::kChannels: return "the image has one channel";
      case Ability::kSettings: return "the image's settings are built in";
      case Ability::kMorePdos: return "the image has 16 PDOs each way, or fewer";
      case Ability::kBlock: return kServices.block_transfer ? "" : "the image has no block transfer";
    }
    return "unknown";
  }

  void write(unsigned first, const Words& words) override {
    const std::string request = "\x01\x10" + big_endian(first) + values(words);
    const std::string response = ask(request, 8);
    if (response != request.substr(0, 6)) throw std::runtime_error("another response to FC 16");
  }
  Words read(unsigned first, std::size_t count) override {
    return read_by("\x01\x03" + big_endian(first) + big_endian(count), count);
  }
  Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) override {
    return read_by("\x01\x17" + big_endian(from) + big_endian(count) + big_endian(to) + values(words), count);
  }

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
  Words first_done(const std::function<void()>& /*ending*/) override { return {}; }

 private:
  /// Quantity, byte count and the words.
  static std::string values(const Words& words) {
    std::string bytes = big_endian(words.size()) + static_cast<char>(2 * words.size());
    for (const std::uint16_t word : words)
      bytes += big_endian(word);
    return bytes;
  }

  Words read_by(const std::string& request, std::size_t count) {
    const std::string response = ask(request, kFixedBytes + 2 * count);
    if (response.substr(0, 2) != request.substr(0, 2)) throw std::runtime_error("another response to a read");
    Words words;
    for (std::size_t at = 3; at < response.size(); at += 2)
      words.push_back(static_cast<std::uint16_t>(static_cast<std::uint8_t>(response[at]) << 8 |
                                                 static_cast<std::uint8_t>(response[at + 1])));
    return words;
  }

  /// The response without its CRC, of `size` bytes with it.
  std::string ask(const std::string& request, std::size_t size) {
    emulator_.can().wait_taken();
    emulator_.modbus().send(request + crc(request));
    const std::string response = emulator_.modbus().receive(size);
    const std::string bytes = response.substr(0, size - 2);
    if (crc(bytes) != response.substr(size - 2)) throw std::runtime_error("wrong CRC in a response");
    return bytes;
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
