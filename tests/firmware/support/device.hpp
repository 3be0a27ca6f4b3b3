// SPDX-License-Identifier: MIT
#pragma once

/// A CANopen node for images that test themselves.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/slave.hpp"

namespace cbcan::test {

/// 2000h:00 U32, 2001h:00 string of up to 32 bytes, 2002h:00 DOMAIN of 128 bytes, 2003h:00 U16 read-only,
/// 1017h.
struct Device final : Application {
  /// `heartbeat_ms`: 1017h at power-on; 0 = none, and node guarding is answered.
  Device(std::uint8_t node_id, CanPort& port, std::uint16_t heartbeat_ms = 0);

  Slave slave;
  unsigned resets = 0;

 private:
  void on_stored(const ObjectEntry& entry, std::uint8_t /*sub*/, Time now) override {
    if (Slave::owns(entry.index)) slave.configure(now);
  }
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;

  std::uint16_t heartbeat_ms_;
  std::array<std::uint8_t, 192> values_{};
  std::array<std::uint8_t, 128> buffer_{};
};

}  // namespace cbcan::test
