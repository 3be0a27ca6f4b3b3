// SPDX-License-Identifier: MIT
#pragma once

/// What somebody may have meant who typed a name that does not exist.

#include <span>
#include <string>
#include <string_view>

namespace cbcan::text {

/// The known name next to `word`; empty if none is near. Names may have a table in front ("can.bit_rate"): of
/// the names in the word's own table the nearest by edit distance, or else the same name in another table.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known);

/// "; did you mean can.bit_rate?", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> known);

}  // namespace cbcan::text
