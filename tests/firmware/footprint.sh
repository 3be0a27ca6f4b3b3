#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Links two images for Cortex-M3, -Os, and prints what they take, all included; fails above the limits. No startup code: each
# board has its own.
# usage: footprint.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build_dir=$2
here=$source_dir/tests/firmware

cmake -S "$source_dir" -B "$build_dir" -G Ninja -DCMAKE_BUILD_TYPE=MinSizeRel \
  -DCMAKE_TOOLCHAIN_FILE="$source_dir/cmake/arm-none-eabi.cmake" >/dev/null
cmake --build "$build_dir" --target cbcan_core >/dev/null

failed=false
# measure NAME TEXT_LIMIT RAM_LIMIT
measure() {
  local image=$build_dir/$1.elf text data bss
  arm-none-eabi-g++ -mcpu=cortex-m3 -mthumb -Os -std=c++20 -ffreestanding -fno-exceptions -fno-rtti -fno-unwind-tables \
    -fno-asynchronous-unwind-tables -fno-threadsafe-statics -ffunction-sections -fdata-sections -Wall -Wextra -Wno-psabi -DNDEBUG \
    -I"$source_dir/regmap/include" -I"$source_dir/firmware/include" -I"$source_dir/firmware" \
    "$here/$1.cpp" "$build_dir/firmware/libcbcan_core.a" -nostdlib -Wl,--gc-sections,-e,run -lc_nano -lgcc -o "$image"
  read -r text data bss _ < <(arm-none-eabi-size "$image" | tail -n 1)
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
