// SPDX-License-Identifier: MIT
#pragma once

/// Which objects of which nodes the process data registers are exchanged with.

#include <cstddef>
#include <map>
#include <string>

#include "journal/words.hpp"
#include "plant/network.hpp"

namespace cbcan::web {

/// Register to "node 16 6041h:00 Statusword", by the module's valid PDOs: the node is the one that has a PDO
/// with the same COB-ID, the object what that maps at the same place. "PDO 385h" where there is no such node.
std::map<std::size_t, std::string> mapped_registers(std::uint8_t number, plant::Network& network,
                                                    const journal::FindName& find);

}  // namespace cbcan::web
