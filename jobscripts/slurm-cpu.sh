#!/usr/bin/env bash
#SBATCH --job-name=breccia
#SBATCH --nodes=1
#SBATCH --ntasks-per-node=32
#SBATCH --cpus-per-task=1
#SBATCH --time=12:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=%x-%j.log
# A run on CPU cores that continues itself, job after job, until it is done. From the project's folder:
#   sbatch [--nodes=N --time=... ...] jobscripts/slurm-cpu.sh SCENE.toml OUT [options of breccia run]
# One rank per core; --cpus-per-task=T for T threads per rank. 300 s before the time limit Slurm sends SIGUSR1: the run
# writes a checkpoint, ends with 75, and the job is queued again. Any other failure is not repeated.
# Environment: BRECCIA_HOME (project folder), BRECCIA (program), LAUNCHER (default: mpirun with binding to cores).
set -euo pipefail
: "${SLURM_JOB_ID:?submit this script with sbatch}"
[[ $# -ge 2 ]] || { echo "usage: sbatch jobscripts/slurm-cpu.sh SCENE.toml OUT [OPTION...]" >&2; exit 2; }
BRECCIA_HOME=${BRECCIA_HOME:-$SLURM_SUBMIT_DIR}
# shellcheck source=common.sh
source "$BRECCIA_HOME/jobscripts/common.sh"

threads=${SLURM_CPUS_PER_TASK:-1}
export OMP_NUM_THREADS=$threads OMP_PROC_BIND=close OMP_PLACES=cores
LAUNCHER=${LAUNCHER:-mpirun --map-by "slot:PE=$threads" --bind-to core}
breccia_command "$@" --threads "$threads"

status=0
run_with_checkpoint_signal "${command[@]:?}" || status=$?
finish "$status" scontrol requeue "$SLURM_JOB_ID"
