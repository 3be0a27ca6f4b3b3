// SPDX-License-Identifier: MIT
#pragma once

/// Dictionaries of the demo plant's nodes, from their EDS files.

#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "support/catch.hpp"
#include "support/source_file.hpp"

namespace cbcan::test {

/// A value as set in a plant file.
struct InitialValue {
  std::uint16_t index;
  std::uint8_t sub;
  std::uint64_t value;
};
using InitialValues = std::vector<InitialValue>;

inline descriptions::DictionaryImage with(descriptions::DictionaryImage image, const InitialValues& values) {
  ObjectDictionary dictionary(image.entries, image.values, nullptr);
  for (const InitialValue& each : values)
    REQUIRE(dictionary.set(each.index, each.sub, each.value));
  return image;
}

inline descriptions::DictionaryImage demo_image(const std::string& file, std::uint8_t node_id = 0x42,
                                                const InitialValues& values = {}) {
  const std::string text = source_file("plants/demo/" + file);
  return with(descriptions::dictionary_image(descriptions::read(text, file, node_id).device), values);
}

}  // namespace cbcan::test
