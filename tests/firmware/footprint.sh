#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Prints what images for Cortex-M3, -Os, take, all included; fails above the limits. Of the first two without startup code, the
# third is whole.
# usage: footprint.sh BUILD_DIR
set -euo pipefail
build_dir=$1

failed=false
# measure IMAGE TEXT_LIMIT RAM_LIMIT: RAM includes the stack and the PLC's registers.
measure() {
  local text data bss
  read -r text data bss _ < <(arm-none-eabi-size "$build_dir/$1" | tail -n 1)
  printf 'figure: %-48s text %6d (at most %d)   RAM %5d (at most %d)\n' "$1" $((text + data)) "$2" $((data + bss)) "$3"
  if ((text + data > $2 || data + bss > $3)); then failed=true; fi
  if ((text < 3000)); then
    echo "$1: only $text bytes of text: it is not all there" >&2
    failed=true
  fi
}

measure tests/firmware/images/master 6000 2000
measure tests/firmware/images/coprocessor 30000 9000
measure firmware/boards/mps2_an385/cbcan_mps2_an385.elf 36864 14336
if $failed; then exit 1; fi
