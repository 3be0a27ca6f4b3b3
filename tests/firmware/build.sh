#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds everything for one kind of microcontroller, or some targets: libraries, images, tests that run in an emulator.
# usage: build.sh SOURCE_DIR BUILD_DIR TOOLCHAIN [TARGET...]
set -euo pipefail
cmake -S "$1" -B "$2" -G Ninja -DCMAKE_BUILD_TYPE=MinSizeRel -DCMAKE_TOOLCHAIN_FILE="$1/$3" >/dev/null
cmake --build "$2" ${4:+--target "${@:4}"} -- --quiet
