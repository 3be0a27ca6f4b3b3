#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Links two images for Cortex-M3, -Os, and prints what they take, all included; fails above the limits. No startup code: each
# board has its own.
# usage: footprint.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build_dir=$2

cmake -S "$source_dir" -B "$build_dir" -G Ninja -DCMAKE_BUILD_TYPE=MinSizeRel \
  -DCMAKE_TOOLCHAIN_FILE="$source_dir/cmake/arm-none-eabi.cmake" >/dev/null
cmake --build "$build_dir" --target master coprocessor -- --quiet

failed=false
# measure NAME TEXT_LIMIT RAM_LIMIT
measure() {
  local text data bss
  read -r text data bss _ < <(arm-none-eabi-size "$build_dir/tests/firmware/images/$1" | tail -n 1)
  printf '%-12s text %6d (at most %d)   RAM %5d (at most %d)\n' "$1" $((text + data)) "$2" $((data + bss)) "$3"
  if ((text + data > $2 || data + bss > $3)); then failed=true; fi
  if ((text < 3000)); then
    echo "$1: only $text bytes of text: it is not all there" >&2
    failed=true
  fi
}

measure master 6000 2000
measure coprocessor 16000 4000
if $failed; then exit 1; fi
