#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A search as a Slurm array of 100 parts, and a job that reports them: packaging/cluster/slurm.sh, in the project's folder,
# which all machines share. Once more: it goes on where it was.
#SBATCH --job-name=explore --requeue --open-mode=append --output=parts/%x-%a.txt
set -euo pipefail
search() { cbcan-sim run --explore "$@" scenarios/; } # or: cbcan-sim --config plant.toml --explore "$@" -- ./program

mkdir -p parts
if [[ -z ${SLURM_JOB_ID:-} ]]; then
  array=$(sbatch --parsable --array=1-"${PARTS:-100}" "$0")
  sbatch --dependency="afterany:$array" --output=report.txt --open-mode=truncate "$0"
elif [[ -n ${SLURM_ARRAY_TASK_ID:-} ]]; then
  search -j "$SLURM_CPUS_ON_NODE" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --state "parts/$SLURM_ARRAY_TASK_ID.state" && exit
  code=$? # 0: nothing broken, 1: broken, 2: a mistake. Otherwise it was killed, or the machine is to blame.
  ((code > 2 && ${SLURM_RESTART_COUNT:-0} < 3)) && scontrol requeue "$SLURM_JOB_ID"
  exit "$code"
else
  cat parts/*.state >all.state
  search --state all.state --junit results.xml --out failures
fi
