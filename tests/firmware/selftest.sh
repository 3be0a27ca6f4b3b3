#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs the self-test image on QEMU's board virt, with two CAN controllers on one bus. The clock counts instructions, so that the
# result does not depend on the load of the machine.
# usage: selftest.sh IMAGE
set -euo pipefail
code=0
output=$(timeout --signal=KILL 240 qemu-system-aarch64 -M 'virt,highmem=off' -cpu cortex-a53 -nodefaults -object can-bus,id=can \
  -device 'kvaser_pci,canbus=can,addr=1' -device 'kvaser_pci,canbus=can,addr=2' -kernel "$1" \
  -icount shift=5,sleep=off -semihosting-config enable=on,target=native \
  -audiodev none,id=none -display none -monitor none -serial null 2>&1 </dev/null) || code=$?
grep -v 'audiodev default' <<<"$output"
((code == 0)) || { echo "the image ended with exit code $code" >&2; exit 1; }

ran=$(grep -c '^passed ' <<<"$output")
echo "$ran cases ran"
((ran > 0))
