// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

namespace cbcan::test {

/// A simple peripheral: words in memory, the writes in order, and a hook for the hardware's actions.
struct Peripheral {
  using Write = std::pair<std::uint32_t, std::uint32_t>;  // offset, value

  std::map<std::uint32_t, std::uint32_t> words;
  std::vector<Write> writes;
  std::function<void(std::uint32_t offset, std::uint32_t value)> on_write = [](std::uint32_t, std::uint32_t) {
  };

  std::uint32_t read(std::uint32_t offset) { return words[offset]; }
  void write(std::uint32_t offset, std::uint32_t value) {
    writes.emplace_back(offset, value);
    words[offset] = value;
    on_write(offset, value);
  }
};

}  // namespace cbcan::test
