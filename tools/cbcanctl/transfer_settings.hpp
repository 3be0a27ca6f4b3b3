// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's SDO timeout (3003h) and transfer mode (3004h) for one transfer.

#include <array>
#include <string_view>

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

/// Names of --mode; the place of each is its number in 3004h.
inline constexpr std::array<std::string_view, 4> kTransferModes{"auto", "expedited", "segmented", "block"};

/// Sets what --timeout and --mode ask for, while `transfer` runs, and puts back what was there, whatever
/// happens. A second Ctrl-C leaves it as it is, and says so. Other programs' transfers see it meanwhile.
tools::Bytes with_settings(tools::WindowClient& client, const Options& options,
                           const tools::Transaction& transfer);

}  // namespace cbcan::ctl
