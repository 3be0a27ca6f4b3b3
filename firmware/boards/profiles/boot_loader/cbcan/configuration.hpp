// SPDX-License-Identifier: MIT
#pragma once

/// A boot loader: an SDO server that takes programs.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices = [] {
  Services services = kMinimalServices;
  services.sdo_server = services.streamed_downloads = true;
  services.adapter_state = false;
  return services;
}();

}  // namespace cbcan
