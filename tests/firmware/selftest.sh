#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs the self-test image of a machine in QEMU, with two CAN controllers on one bus. The clock counts instructions, so that the
# result does not depend on the load of the machine.
# usage: selftest.sh zynqmp|virt IMAGE
set -euo pipefail
case $1 in
  zynqmp) machine=(-M xlnx-zcu102 -machine canbus0=can -machine canbus1=can) ;;
  virt)
    machine=(-M 'virt,highmem=off' -cpu cortex-a53 -nodefaults -device 'kvaser_pci,canbus=can,addr=1' -device 'kvaser_pci,canbus=can,addr=2')
    ;;
esac
code=0
output=$(timeout --signal=KILL 240 qemu-system-aarch64 -object can-bus,id=can "${machine[@]}" -kernel "$2" \
  -icount shift=5,sleep=off -semihosting-config enable=on,target=native \
  -audiodev none,id=none -display none -monitor none -serial null 2>&1 </dev/null) || code=$?
grep -v 'audiodev default' <<<"$output"
((code == 0)) || { echo "the image ended with exit code $code" >&2; exit 1; }

ran=$(grep -c '^passed ' <<<"$output")
echo "$ran cases ran"
((ran > 0))
