// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <type_traits>

#include "cbcan/configuration.hpp"

namespace cbcan {

/// Takes the place of a counter in a build without counters.
struct NoCount {
  constexpr void operator++() const {}
  constexpr operator std::uint32_t() const { return 0; }
};

/// A diagnostic counter: starts at 0 and wraps.
using Count = std::conditional_t<kServices.counters, std::uint32_t, NoCount>;

}  // namespace cbcan
