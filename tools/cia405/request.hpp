// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cbcan::cia405::detail {

/// One Modbus request for holding registers: FC 16 when it only writes, FC 3 when it only reads, FC 23, which
/// writes first, when it does both.
struct Request {
  std::uint16_t write_address = 0;
  std::vector<std::uint16_t> words{};  ///< to write
  std::uint16_t read_address = 0;
  std::uint16_t count = 0;  ///< of registers to read
};

}  // namespace cbcan::cia405::detail
