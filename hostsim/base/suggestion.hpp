// SPDX-License-Identifier: MIT
#pragma once

/// What the user may have meant by a name that does not exist.

#include <span>
#include <string>
#include <string_view>

namespace cbcan::base {

/// The known name nearest to `word`; empty if none is near. Names may have a table in front ("can.bit_rate"). The
/// result is the nearest name in the same table by edit distance, or else the same name in another table.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known);

/// "; did you mean can.bit_rate?", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> known);

}  // namespace cbcan::base
