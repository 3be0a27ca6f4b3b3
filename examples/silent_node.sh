#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Tests what a PLC sees of a silent node, without sleep: cbcan-sim --demo --clock manual -- examples/silent_node.sh
# Time stops until the transaction has started, and advances until it has ended.
exec 3<>"/dev/tcp/${CBCAN_CONTROL/://}"
exec 4< <("${CBCANCTL:-build/bin/cbcanctl}" read 99 0x1000 0 2>&1 3>&-)
printf 'wait transaction started\nwait transaction ended\n' >&3
head -n 2 <&3
cat <&4
