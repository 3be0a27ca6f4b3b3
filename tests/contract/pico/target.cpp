// SPDX-License-Identifier: MIT
// The suite's target "pico": the image for the Raspberry Pi Pico in rp2040js, new for each case
// (tests/firmware/pico/coprocessor.mjs), on a clock that the suite controls.

#include "contract/remote/child.hpp"
#include "contract/remote/rtu_target.hpp"
#include "support/hex.hpp"

namespace cbcan::contract {

namespace {

struct PicoTarget final : RtuTarget {
  explicit PicoTarget(const Settings& settings) { order(settings.plc_timeout == 0s ? "start 0" : "start 1"); }
  ~PicoTarget() override { check_stack(); }

  std::string next_frame() override { return order("sent"); }
  void arrive(const std::string& frame) override { order("can " + frame); }
  void pass(Duration duration) override { order("pass " + std::to_string(duration.count())); }
  Duration precision() const override { return 1us; }
  void set_bus_state(BusState state) override { order("state " + std::to_string(static_cast<int>(state))); }

 private:
  std::string exchange(const std::string& request, std::size_t size) override {
    const std::string digits =
        order("modbus " + test::hex_of(std::vector<std::uint8_t>(request.begin(), request.end())));
    if (digits.size() != 2 * size) throw std::runtime_error("a response of another size: " + digits);
    std::string response;
    for (std::size_t at = 0; at < digits.size(); at += 2)
      response += static_cast<char>(std::stoi(digits.substr(at, 2), nullptr, 16));
    return response;
  }

  /// One emulator for the whole program.
  static std::string order(const std::string& line) {
    static Child emulator({"/usr/bin/env", "node", CBCAN_PICO, CBCAN_IMAGE, CBCAN_IMAGE_WATCHES_PLC});
    emulator.say(line);
    return emulator.hear();
  }
};

}  // namespace

std::unique_ptr<Target> make_target(const Settings& settings) {
  return std::make_unique<PicoTarget>(settings);
}

}  // namespace cbcan::contract
