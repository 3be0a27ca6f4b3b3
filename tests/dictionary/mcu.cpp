// SPDX-License-Identifier: MIT
// The suite's devices in QEMU: tests/firmware/mps2/dictionaries.cpp.

#include "contract/mcu/emulator.hpp"
#include "contract/remote/slcan_text.hpp"
#include "dictionary/host_buses.hpp"

namespace cbcan::test {

namespace {

class McuBus final : public Bus {
 public:
  McuBus() : emulator_(CBCAN_IMAGE) {
    const std::string opening = "\r\r\rC\rS6\rO\r";
    if (emulator_.can().receive(opening.size()) != opening)
      throw std::runtime_error("the image begins otherwise");
    emulator_.freeze();
  }

  Frames power_on(std::size_t file) override {
    file_ = file;
    return power(1);
  }
  Frames power_cycle() override { return power(0); }
  Frames exchange(const Frames& frames) override {
    std::string lines;
    for (const std::string& frame : frames)
      lines += contract::slcan_line(frame) + "\r";
    emulator_.can().send(lines);
    Frames heard;
    const std::size_t expected = counts.front();
    for (counts.pop_front(); heard.size() < expected;)
      for (std::string& frame : take(emulator_.can().receive(1)))
        heard.push_back(std::move(frame));
    return heard;
  }
  Frames pass(Time duration) override {
    emulator_.pass(duration);
    return take();
  }

 private:
  Frames power(unsigned fresh) {
    char frame[32];
    std::snprintf(frame, sizeof frame, "1F000000#%02X%02X", static_cast<unsigned>(file_), fresh);
    emulator_.can().send(contract::slcan_line(frame) + "\r");
    return pass(0);
  }
  /// Lines that are no frames ask the adapter for its state.
  Frames take(const std::string& first = "") {
    characters_ += first + emulator_.can().receive_available();
    Frames frames;
    for (std::size_t end = 0; (end = characters_.find('\r')) != std::string::npos;) {
      const std::string line = characters_.substr(0, end);
      characters_.erase(0, end + 1);
      if (contract::is_slcan_frame(line)) frames.push_back(contract::candump_text(line));
    }
    return frames;
  }

  contract::Emulator emulator_;
  std::string characters_;
  std::size_t file_ = 0;
};

}  // namespace

Bus& compared_bus() {
  static McuBus bus;
  return bus;
}

bool is_slow() {
  return true;
}

}  // namespace cbcan::test
