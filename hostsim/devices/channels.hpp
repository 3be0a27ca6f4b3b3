// SPDX-License-Identifier: MIT
#pragma once

/// Channels of a device: one for each sub-index, from 1 on, of an object in its dictionary.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::devices {

/// Makes channels up to the highest sub-index of these objects.
template <class Channel>
std::vector<Channel> channels(ObjectDictionary& dictionary, std::initializer_list<std::uint16_t> indices) {
  unsigned highest = 0;
  for (const ObjectEntry& entry : dictionary.entries())
    if (std::ranges::count(indices, entry.index) != 0) highest = std::max<unsigned>(highest, entry.last_sub);
  std::vector<Channel> all;
  for (unsigned sub = 1; sub <= highest; ++sub)
    all.emplace_back(dictionary, static_cast<std::uint8_t>(sub));
  return all;
}

constexpr std::uint8_t sub_of(std::size_t position) {
  return static_cast<std::uint8_t>(position + 1);
}

/// Null if there is no such channel.
template <class Channel>
Channel* find(std::vector<Channel>& all, std::uint8_t sub) {
  return sub >= 1 && sub <= all.size() && all[sub - 1u].exists() ? &all[sub - 1u] : nullptr;
}

}  // namespace cbcan::devices
