#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs the self-test image for Zynq UltraScale+ in QEMU, whose two CAN controllers are on one bus. The clock counts
# instructions, so that a busy machine changes nothing.
# usage: zynqmp_selftest.sh IMAGE
set -euo pipefail
image=$1

# run [ARGUMENT]: the image's output; its exit code.
run() {
  timeout --signal=KILL 240 qemu-system-aarch64 -M xlnx-zcu102 -object can-bus,id=can -machine canbus0=can -machine canbus1=can \
    -kernel "$image" -icount shift=5,sleep=off -semihosting-config "enable=on,target=native,arg=selftest,arg=${1:-}" \
    -audiodev none,id=none -display none -monitor none -serial null 2>&1 </dev/null | grep -v 'audiodev default'
  return "${PIPESTATUS[0]}"
}

code=0
output=$(run) || code=$?
echo "$output"
((code == 0)) || { echo "the image ended with exit code $code" >&2; exit 1; }

# An undefined instruction has to be reported and to end the run. (With the MMU off, QEMU lets every access pass.)
code=0
fault=$(run fault) || code=$?
echo "$fault"
if ((code != 1)) || ! grep -q '^fault: vector 0000000000000004 ESR 0000000002000000 ELR 00000000FFFC' <<<"$fault"; then
  echo "no report of a fault, or exit code $code instead of 1" >&2
  exit 1
fi

ran=$(($(grep -c '^passed ' <<<"$output") + 1))
echo "$ran cases ran"
if ((ran < ${CBCAN_CASES:-0})); then
  echo "but $CBCAN_CASES are committed: some were lost" >&2
  exit 1
fi
