# SPDX-License-Identifier: MIT
# arm-none-eabi.cmake for a Cortex-M4, without its floating point.
set(CBCAN_CPU cortex-m4)
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
