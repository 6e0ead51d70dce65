#!/usr/bin/env bash
#SBATCH --job-name=breccia-gpu
#SBATCH --nodes=1
#SBATCH --gpus-per-node=4
#SBATCH --ntasks-per-node=4
#SBATCH --cpus-per-task=8
#SBATCH --time=12:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=%x-%j.log
# A run on GPUs that continues itself, job after job, until it is done. From the project's folder:
#   sbatch [--nodes=N --gpus-per-node=G --ntasks-per-node=G ...] jobscripts/slurm-gpu.sh SCENE.toml OUT [OPTION...]
# One rank per GPU: each takes the device of its number on the node, and is bound to cores of its own. The end of the
# job's time as in slurm-cpu.sh.
# Environment: BRECCIA_HOME, BRECCIA, LAUNCHER as in slurm-cpu.sh.
set -euo pipefail
: "${SLURM_JOB_ID:?submit this script with sbatch}"
[[ $# -ge 2 ]] || { echo "usage: sbatch jobscripts/slurm-gpu.sh SCENE.toml OUT [OPTION...]" >&2; exit 2; }
BRECCIA_HOME=${BRECCIA_HOME:-$SLURM_SUBMIT_DIR}
# shellcheck source=common.sh
source "$BRECCIA_HOME/jobscripts/common.sh"

cores=${SLURM_CPUS_PER_TASK:-1}
export OMP_NUM_THREADS=$cores OMP_PROC_BIND=close OMP_PLACES=cores
LAUNCHER=${LAUNCHER:-mpirun --map-by "ppr:${SLURM_NTASKS_PER_NODE:-1}:node:PE=$cores" --bind-to core}
breccia_command "$@" --device cuda

status=0
run_with_checkpoint_signal "${command[@]:?}" || status=$?
finish "$status" scontrol requeue "$SLURM_JOB_ID"
