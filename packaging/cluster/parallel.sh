#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A search in 100 parts by GNU parallel over ssh, in the project's folder: packaging/cluster/parallel.sh MACHINES. Of the machines,
# a line of that file each, "8/user@host" makes 8 parts at a time, in a folder of the same name. Once more: it goes on where it was.
set -euo pipefail
search='cbcan-sim run --explore OPTIONS scenarios/' # or: cbcan-sim --config plant.toml --explore OPTIONS -- ./program
files=(scenarios plants)                            # what the machines need; they have cbcan-sim
parts=${PARTS:-100}
part="-j 1 --shard {}/$parts --state parts/{}.state"

mkdir -p parts
for ((i = 1; i <= parts; ++i)); do touch "parts/$i.state"; done
# Exit code 0: nothing broken, 1: broken, 2: a mistake. A part that was killed, or whose machine is gone, is started again.
seq "$parts" | parallel --sshloginfile "$1" --workdir . "${files[@]/#/--basefile=}" --transferfile parts/{}.state \
  --return parts/{}.state --retries 3 "${search/OPTIONS/$part} >/dev/null; [ \$? -le 2 ]" ||
  echo "$? parts have failed; what they have not tried is tried here" >&2
cat parts/*.state >all.state
eval "${search/OPTIONS/--state all.state --junit results.xml --out failures}"
