# SPDX-License-Identifier: MIT
# arm-none-eabi.cmake for a Cortex-M0+, which has no compare-and-swap.
set(CBCAN_CPU cortex-m0plus)
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
