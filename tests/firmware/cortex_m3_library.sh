#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Checks the libraries for Cortex-M3: no static data, and only these external symbols. For processors that are not little-endian
# the compiler must report the reason.
# usage: cortex_m3_library.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
build_dir=$1

allowed='^(memcpy|memmove|memset|memcmp|__aeabi_(memcpy|memcpy4|memcpy8|memset|memclr|memclr4|memclr8|lmul|llsl|llsr|lasr))$'

# check LIBRARY LEAST_TEXT [LIBRARY that it needs]
check() {
  local library=$build_dir/firmware/lib$1.a text data bss defined undefined outside foreign
  arm-none-eabi-size -t "$library"
  read -r text data bss _ < <(arm-none-eabi-size -t "$library" | tail -n 1)
  if ((data != 0 || bss != 0)); then
    echo "static data in $1: data $data, bss $bss; state belongs into objects that the caller owns" >&2
    exit 1
  fi
  ((text > $2)) || { echo "only $text bytes of text: $1 is not all there" >&2; exit 1; }

  defined=$(arm-none-eabi-nm --defined-only "$library" ${3:+"$build_dir/firmware/lib$3.a"} | awk 'NF == 3 {print $3}' | sort -u)
  undefined=$(arm-none-eabi-nm --undefined-only "$library" | awk 'NF == 2 {print $2}' | sort -u)
  outside=$(comm -13 <(echo "$defined") <(echo "$undefined"))
  if foreign=$(grep -Ev "$allowed" <<<"$outside" | grep .); then
    echo "$1 needs from outside what a bare-metal image does not have: $foreign" >&2
    exit 1
  fi
  echo "$1 needs from outside: $(tr '\n' ' ' <<<"$outside")"
}
check cbcan_canopen 15000
check cbcan_core 4000 cbcan_canopen
check cbcan_modbus 800
check cbcan_slcan 500

for source in channel local_node; do
  told=$(arm-none-eabi-g++ -mcpu=cortex-m3 -mthumb -mbig-endian -std=c++20 -w -fsyntax-only -I "$2/firmware" -I "$2/regmap/include" \
    "$2/firmware/cbcan/coprocessor/$source.cpp" 2>&1) || true
  grep -q "error: static assertion failed: the coprocessor needs a little-endian processor" <<<"$told" ||
    { printf '%s.cpp for a big-endian processor:\n%s\n' "$source" "$told" >&2; exit 1; }
done
