// SPDX-License-Identifier: MIT
#pragma once

namespace cbcan::boards {

/// Switches the MMU and the caches on (Arm ARM, DDI 0487, D8): the on-chip memory is Normal memory, which
/// exclusive accesses need; the peripherals that board.hpp names are Device memory; there is nothing else, so
/// a null pointer and a stack that runs over fault. Once, before main(); the caches are invalid as the boot
/// loader left them.
void enable_mmu();

}  // namespace cbcan::boards
