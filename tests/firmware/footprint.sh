#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Prints the sizes of images for Cortex-M3 and M4, -Os, all included; fails above the limits. Those of boards are complete, the
# others lack startup code.
# usage: footprint.sh BUILD_DIR_M3 BUILD_DIR_M4
set -euo pipefail

failed=false
# measure NAME IMAGE TEXT_LIMIT RAM_LIMIT: RAM includes the stack and the PLC's registers.
measure() {
  local text data bss
  read -r text data bss _ < <(arm-none-eabi-size "$2" | tail -n 1)
  echo "figure: size.$1.text $((text + data)), at most $3"
  echo "figure: size.$1.ram $((data + bss)), at most $4"
  arm-none-eabi-size -A "$2" | awk -v name="$1" '$1 == ".stack" {print "figure: size." name ".stack " $2}'
  if ((text + data > $3 || data + bss > $4)); then failed=true; fi
  if ((text < 3000)); then
    echo "$2: only $text bytes of text: it is not all there" >&2
    failed=true
  fi
}

measure sdo_client "$1/tests/firmware/images/sdo_client" 4500 420
measure master "$1/tests/firmware/images/master" 5200 2000
measure coprocessor "$1/tests/firmware/images/coprocessor" 29100 9000
measure coprocessor_with_manager "$1/tests/firmware/images/coprocessor_with_manager" 45000 19400
measure canopen_services_plain "$1/tests/firmware/images/canopen_services_plain" 24300 5752
measure canopen_services_lto "$1/tests/firmware/images/canopen_services_lto" 22600 5752
# Limits as in their linker scripts.
measure minimal "$1/firmware/boards/mps2_an385/cbcan_mps2_minimal.elf" 16384 6144
measure process_data "$1/firmware/boards/mps2_an385/cbcan_mps2_process_data.elf" 24576 9216
measure image "$1/firmware/boards/mps2_an385/cbcan_mps2_an385.elf" 32768 13312
measure stm32f4 "$2/firmware/boards/stm32f4/cbcan_stm32f4.elf" 45056 16384
# All functions of the library; an image links fewer.
echo "figure: size.canopen.text $(arm-none-eabi-size -t "$1/firmware/libcbcan_canopen.a" | awk 'END {print $1}')"
if $failed; then exit 1; fi
