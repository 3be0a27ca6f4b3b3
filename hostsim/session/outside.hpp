// SPDX-License-Identifier: MIT
#pragma once

/// What the configuration says of a network's connections with the outside, whatever makes them.

#include <memory>

#include "base/address.hpp"
#include "config/config.hpp"
#include "plant/network.hpp"
#include "protocols/dialect.hpp"
#include "protocols/plc_polling.hpp"

namespace cbcan::session {

/// What is exchanged with the PLC that owns the registers of a network, which outlives it.
protocols::PlcPolling::Exchanges plc_exchanges(const config::NetworkConfig& config, plant::Network& network);
/// The place of a PLC that is not on a line. Throws base::UsageError.
base::ListenAddress plc_address(const config::PlcConfig& plc);

/// The text that an adapter speaks: SLCAN or socketcand.
std::unique_ptr<protocols::Dialect> dialect_of(const config::CanSpec& can);

}  // namespace cbcan::session
