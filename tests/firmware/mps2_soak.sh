#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs a day of the board's time in QEMU. The clock counts instructions and idle time is skipped, so that it takes one or two
# minutes and does not depend on the load of the machine. The image checks itself.
# usage: mps2_soak.sh IMAGE
set -euo pipefail

code=0
output=$(timeout --signal=KILL 800 qemu-system-arm -M mps2-an385 -kernel "$1" -icount shift=5,sleep=off \
  -semihosting-config enable=on,target=native -display none -monitor none -serial null -serial null 2>&1 </dev/null) || code=$?
echo "$output"
((code == 0)) || { echo "the image ended with exit code $code" >&2; exit 1; }
grep -qx 'passed  a day' <<<"$output" || { echo "the image ended before the day was over" >&2; exit 1; }
