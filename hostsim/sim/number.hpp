// SPDX-License-Identifier: MIT
#pragma once

/// Numbers of the world, and as a dictionary stores them.

#include <cstddef>
#include <cstdint>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::sim {

/// The nearest number that the type, of so many bytes, can hold; an integer is 0 for what is
/// not a number.
std::uint64_t to_raw(double value, DataType type, std::size_t bytes);

/// What the type stores so.
double from_raw(std::uint64_t raw, DataType type, std::size_t bytes);

}  // namespace cbcan::sim
