#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Prints what images for Cortex-M3, -Os, take, all included; fails above the limits, and where the page of canopen/ says something
# else. Images without startup code but the last, which is whole.
# usage: footprint.sh BUILD_DIR
set -euo pipefail
build_dir=$1
root=$(cd "$(dirname "$0")/../.." && pwd)

failed=false
# shown NAME COLUMN REACHED: the page's figure is this one.
shown() {
  python3 -c 'import sys; sys.path.insert(0, sys.argv[1]); import figures
why = figures.stale(sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5])); sys.exit(why or 0)' \
    "$root/tests/support" "$root/firmware/canopen/README.md" "$@" || failed=true
}
# measure IMAGE TEXT_LIMIT RAM_LIMIT [NAME]: RAM includes the stack, but not the PLC's registers; NAME is its row of the page.
measure() {
  local text data bss registers
  read -r text data bss _ < <(arm-none-eabi-size "$build_dir/$1" | tail -n 1)
  registers=$(arm-none-eabi-size -A "$build_dir/$1" | awk '$1 == ".registers" {print $2}')
  bss=$((bss - ${registers:-0}))
  printf 'figure: %-48s text %6d (at most %d)   RAM %5d (at most %d)\n' "$1" $((text + data)) "$2" $((data + bss)) "$3"
  if ((text + data > $2 || data + bss > $3)); then failed=true; fi
  if ((text < 3000)); then
    echo "$1: only $text bytes of text: it is not all there" >&2
    failed=true
  fi
  if [[ ${4:-} ]]; then
    shown "$4" 1 $((text + data))
    shown "$4" 2 $((data + bss))
  fi
}

measure tests/firmware/images/sdo_client 5400 420 "an SDO client with memory for 128 bytes"
measure tests/firmware/images/master 6000 2000 "a master: the client, NMT, the heartbeats of 127 nodes"
measure tests/firmware/images/coprocessor 30000 9000
measure firmware/boards/mps2_an385/cbcan_mps2_an385.elf 36864 14336
library=$(arm-none-eabi-size -t "$build_dir/firmware/libcbcan_canopen.a" | awk 'END {print $1}')
printf 'figure: %-48s text %6d\n' libcbcan_canopen.a "$library"
shown "the whole library, each function of it" 1 "$library"
if $failed; then exit 1; fi
