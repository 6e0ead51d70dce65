#!/usr/bin/env bash
#SBATCH --job-name=breccia-table
#SBATCH --array=0-134%16
#SBATCH --nodes=1
#SBATCH --ntasks=4
#SBATCH --time=12:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=%x-%A_%a.log
# The table of the method paper: 15 impact velocities (50 to 400 m/s) by 9 angles (5 to 45 degrees), each case a task
# of its own that continues until it is done. From the project's folder:
#   sbatch [--array=0-134%N ...] jobscripts/slurm-table.sh SCENE.toml OUT [OPTION...]
# Case n goes to OUT/vVVV-aAA. Environment as in slurm-cpu.sh.
set -euo pipefail
: "${SLURM_ARRAY_TASK_ID:?submit this script with sbatch}"
[[ $# -ge 2 ]] || { echo "usage: sbatch jobscripts/slurm-table.sh SCENE.toml OUT [OPTION...]" >&2; exit 2; }
BRECCIA_HOME=${BRECCIA_HOME:-$SLURM_SUBMIT_DIR}
# shellcheck source=common.sh
source "$BRECCIA_HOME/jobscripts/common.sh"

velocity=$((50 + 25 * (SLURM_ARRAY_TASK_ID / 9)))
angle=$((5 + 5 * (SLURM_ARRAY_TASK_ID % 9)))
scene=$1
out=$2/$(printf 'v%03d-a%02d' "$velocity" "$angle")
shift 2
export OMP_NUM_THREADS=1
LAUNCHER=${LAUNCHER:-mpirun --bind-to core}
breccia_command "$scene" "$out" --set impact.velocity="$velocity m/s" --set impact.angle="$angle deg" "$@"

status=0
run_with_checkpoint_signal "${command[@]:?}" || status=$?
finish "$status" scontrol requeue "$SLURM_JOB_ID"
