#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A plant at free ports for each student: examples/class.sh FOLDER OPTION... <names
# Prints their addresses, and keeps them with logs and messages in FOLDER/NAME. Ends the plants when it ends.
set -euo pipefail
plants=()
trap 'kill "${plants[@]}" 2>/dev/null || true' EXIT
trap exit INT TERM HUP
while read -r name; do
  own=$1/$name
  mkdir -p "$own"
  read -r line < <(exec cbcan-sim --modbus 0.0.0.0:0 --log "$own/bus.log" "${@:2}" 2>>"$own/messages") ||
    { tail -n 2 "$own/messages" >&2 && exit 1; }
  plants+=($!)
  line=${line#ready }
  echo "$name ${line//0.0.0.0/$(hostname)}" >"$own/address"
  cat "$own/address"
done
wait "${plants[@]}"
