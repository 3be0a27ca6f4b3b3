// SPDX-License-Identifier: MIT
#pragma once

/// Minimal, plus four PDOs in each direction.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices = [] {
  Services services = kMinimalServices;
  services.rpdos = services.tpdos = 4;
  return services;
}();

}  // namespace cbcan
