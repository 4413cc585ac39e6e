#!/bin/bash
#SBATCH --job-name=heart-cohort
#SBATCH --array=1-{TASKS}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={THREADS}
#SBATCH --mem={MEMORY}M
#SBATCH --time={MINUTES}
{PARTITION}#SBATCH --signal=B:TERM@30
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=heart-cohort-%A_%a.log
set -eu
first=$(((SLURM_ARRAY_TASK_ID - 1) * {EACH} + 1))
last=$((first + {EACH} - 1))
last=$((last < {SHARDS} ? last : {SHARDS}))
set -- {PROGRAM} {COHORT} {FOLDER}
# The program takes the place of the batch shell, to which B: sends the signal.
exec "$1" --quiet{RUN_MEMORY} --threads "${SLURM_CPUS_PER_TASK:-{THREADS}}" cohort run "$2" --out "$3" --shard "$first-$last/{SHARDS}"
