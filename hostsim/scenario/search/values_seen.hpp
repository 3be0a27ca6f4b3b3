// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "cbcan/time.hpp"

namespace cbcan::search {

/// The last values of an object, and when it had them: a read that began then may give one of them.
class ValuesSeen {
 public:
  void add(Time at, std::span<const std::uint8_t> value) {
    values_.push_back({at, {value.begin(), value.end()}});
    if (values_.size() > kMost) values_.pop_front();
  }
  bool has_since(Time begun, std::span<const std::uint8_t> value) const {
    return std::ranges::any_of(
        values_, [&](const Seen& seen) { return seen.at >= begun && std::ranges::equal(seen.value, value); });
  }

 private:
  static constexpr std::size_t kMost = 16;
  struct Seen {
    Time at;
    std::vector<std::uint8_t> value;
  };
  std::deque<Seen> values_;
};

}  // namespace cbcan::search
