#!/bin/bash
# The cases of a great sweep on eight nodes of a cluster, and a job that puts the parts together when all are done:
#   parts=$(sbatch --parsable --array=1-8 slurm.sh) && sbatch --dependency=afterok:$parts slurm.sh merge
#SBATCH --job-name=mechdesign
#SBATCH --cpus-per-task=16
#SBATCH --time=02:00:00
# A part that was finished is not computed again where the array is submitted once more.
set -euo pipefail
study=study.yaml
out=results/study
if [ "${1:-}" = merge ]; then
  exec mechdesign merge "$study" --out "$out" --junit "$out/report.xml"
fi
exec mechdesign sweep "$study" --out "$out" --jobs "$SLURM_CPUS_PER_TASK" --shard "$SLURM_ARRAY_TASK_ID/8" --resume
