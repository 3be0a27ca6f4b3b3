// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <type_traits>

#include "cbcan/configuration.hpp"

namespace cbcan {

/// Nobody looks at it.
struct NoCount {
  constexpr void operator++() const {}
  constexpr operator std::uint32_t() const { return 0; }
};

/// How often something has happened, for people; from 0, and it wraps.
using Count = std::conditional_t<kServices.counters, std::uint32_t, NoCount>;

}  // namespace cbcan
