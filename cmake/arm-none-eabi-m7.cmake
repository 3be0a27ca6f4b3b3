# SPDX-License-Identifier: MIT
# arm-none-eabi.cmake for a Cortex-M7, without its floating point.
set(CBCAN_CPU cortex-m7)
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
