// SPDX-License-Identifier: MIT
#pragma once

/// What somebody may have meant who typed a name that does not exist.

#include <span>
#include <string>
#include <string_view>

namespace cbcan::app {

/// The known name next to `word`; empty if none is near. Names may have a table in front ("can.bit_rate"): of
/// the names in the word's own table the nearest by edit distance, or else the same name in another table.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known);

/// "; did you mean can.bit_rate?", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> known);

/// "a, b or c"
std::string listed(std::span<const std::string_view> words, std::string_view last = " or ");

/// The parts of "node.objects.sub": "node.objects" and "sub".
std::string_view table_of(std::string_view key);
std::string_view leaf_of(std::string_view key);

}  // namespace cbcan::app
