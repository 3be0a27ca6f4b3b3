// SPDX-License-Identifier: MIT
#pragma once

/// Channels of a device: one for each sub-index, from 1 on, of an object in its dictionary.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::devices {

/// The highest sub-index of an object; 0 = no such object.
inline std::uint8_t highest_sub(const ObjectDictionary& dictionary, std::uint16_t index) {
  std::uint8_t highest = 0;
  for (const ObjectEntry& entry : dictionary.entries())
    if (entry.index == index) highest = std::max(highest, entry.last_sub);
  return highest;
}

template <class Channel>
std::vector<Channel> channels_up_to(ObjectDictionary& dictionary, std::uint8_t highest) {
  std::vector<Channel> all;
  for (unsigned sub = 1; sub <= highest; ++sub)
    all.emplace_back(dictionary, static_cast<std::uint8_t>(sub));
  return all;
}

template <class Channel>
std::vector<Channel> channels(ObjectDictionary& dictionary, std::uint16_t index) {
  return channels_up_to<Channel>(dictionary, highest_sub(dictionary, index));
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
