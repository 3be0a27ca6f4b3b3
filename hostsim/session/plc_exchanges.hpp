// SPDX-License-Identifier: MIT
#pragma once

#include "config/config.hpp"
#include "plant/network.hpp"
#include "protocols/plc_polling.hpp"

namespace cbcan::session {

/// What is exchanged with the PLC that owns the registers of a network, which outlives it.
protocols::PlcPolling::Exchanges plc_exchanges(const config::NetworkConfig& config, plant::Network& network);

}  // namespace cbcan::session
