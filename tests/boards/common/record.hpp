// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "boards/common/record_log.hpp"

namespace cbcan::test {

using Bytes = std::vector<std::uint8_t>;

/// What a record log is to keep.
struct Record final : boards::RecordLog::Source {
  explicit Record(Bytes content) : bytes(std::move(content)) {}
  void write_to(boards::RecordLog::Writer& writer) const override {
    for (const std::uint8_t byte : bytes)
      writer.put(byte);
  }
  Bytes bytes;
};

}  // namespace cbcan::test
