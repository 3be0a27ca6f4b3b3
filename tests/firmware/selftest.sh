#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs the self-test image of a board in QEMU, with two CAN controllers on one bus. The clock counts instructions, so that a
# busy machine changes nothing.
# usage: selftest.sh zynqmp|virt IMAGE
set -euo pipefail
case $1 in
  zynqmp) machine=(-M xlnx-zcu102 -machine canbus0=can -machine canbus1=can) text=FFF below=FFFB ;;
  virt)
    machine=(-M 'virt,highmem=off' -cpu cortex-a53 -nodefaults -device 'kvaser_pci,canbus=can,addr=1' -device 'kvaser_pci,canbus=can,addr=2')
    text=400 below=4007
    ;;
esac
image=$2

# run [ARGUMENT]: the image's output; its exit code.
run() {
  timeout --signal=KILL 240 qemu-system-aarch64 -object can-bus,id=can "${machine[@]}" -kernel "$image" \
    -icount shift=5,sleep=off -semihosting-config "enable=on,target=native,arg=selftest,arg=${1:-}" \
    -audiodev none,id=none -display none -monitor none -serial null 2>&1 </dev/null | grep -v 'audiodev default'
  return "${PIPESTATUS[0]}"
}

code=0
output=$(run) || code=$?
echo "$output"
((code == 0)) || { echo "the image ended with exit code $code" >&2; exit 1; }

ran=$(grep -c '^passed ' <<<"$output")

# fault WORD PATTERN: what the image does when asked by this word is reported in these terms, and ends the run.
fault() {
  local report code=0
  report=$(run "$1") || code=$?
  echo "$report"
  if ((code != 1)) || ! grep -Eqx "fault: vector 0{15}4 $2" <<<"$report"; then
    echo "$1: the exit code is $code, and it should be 1 with a report that matches $2" >&2
    exit 1
  fi
  ran=$((ran + 1))
}
fault undefined "ESR 0{8}02000000 ELR 0{8}$text.{5} FAR .*"
fault null "ESR 0{8}96000046 ELR 0{8}$text.{5} FAR 0{16}"         # a write, translation fault
fault deep "ESR 0{8}96000047 ELR 0{8}$text.{5} FAR 0{8}$below.{4}"  # likewise, below the stack

echo "$ran cases ran"
if ((ran < ${CBCAN_CASES:-0})); then
  echo "but $CBCAN_CASES are committed: some were lost" >&2
  exit 1
fi
