// SPDX-License-Identifier: MIT
#pragma once

/// Both ends of QEMU's CAN bus in one image: the coprocessor on the first controller, with the test as its PLC, and
/// a CANopen node on the second.

#include <array>
#include <cstdint>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "cortex_a53.hpp"
#include "support/device.hpp"
#include "two_controllers.hpp"

namespace cbcan::test {

inline constexpr std::uint8_t kOwnNode = 0x7F;
inline constexpr std::uint8_t kNode = 0x42;

struct Plant {
  /// Starts both controllers and both nodes; false: a controller did not start.
  bool start();
  /// One turn of the loop.
  void turn();

  // The registers as accessed by the PLC.
  std::uint16_t& reg(unsigned address) { return words[address - regmap::kWindowFirst]; }
  /// Writes R3701.. and CA0Eh, and runs turns until R3700 is a result, which is returned; CA0Eh = none within 5
  /// seconds.
  std::uint16_t execute(std::initializer_list<std::uint16_t> request);

  std::array<std::uint16_t, regmap::kWindowWords> words{};
  std::array<std::uint16_t, regmap::kProcessWords> process{};
  Can can0{kControllers[0]};
  Can can1{kControllers[1]};
  Coprocessor coprocessor{RegisterWindow(RegisterWindow::Words(words)),
                          process,
                          can0,
                          {.node_id = kOwnNode, .sdo_timeout_ms = 50}};
  Device device{kNode, can1};
  BusState bus_state = BusState::kActive;
  std::array<std::atomic<std::uint32_t>, 2> interrupts{};
};

extern Plant plant;

}  // namespace cbcan::test
