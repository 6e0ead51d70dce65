#!/usr/bin/env bash
#PBS -N breccia
#PBS -l select=1:ncpus=32:mpiprocs=32
#PBS -l walltime=12:00:00
#PBS -j oe
# A run on CPU cores that continues itself, job after job, until it is done. From the project's folder:
#   qsub -v SCENE=scenes/impact-200-15.toml,OUT=out/impact,WALLTIME=12:00:00 jobscripts/pbs-cpu.sh
# PBS gives no warning before the end of a job's time: breccia itself stops 5 minutes before WALLTIME, which is the one
# of the job, writes a checkpoint and ends with 75; the script then submits itself again.
# Environment: OPTIONS (further options of breccia run), RESOURCES (the -l options of qsub, to be asked for again),
# BRECCIA_HOME, BRECCIA, LAUNCHER as in slurm-cpu.sh.
set -euo pipefail
: "${PBS_O_WORKDIR:?submit this script with qsub}" "${SCENE:?-v SCENE=...}" "${OUT:?-v OUT=...}"
BRECCIA_HOME=${BRECCIA_HOME:-$PBS_O_WORKDIR}
cd "$PBS_O_WORKDIR"
# shellcheck source=common.sh
source "$BRECCIA_HOME/jobscripts/common.sh"
# shellcheck source=pbs.sh
source "$BRECCIA_HOME/jobscripts/pbs.sh"

export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
LAUNCHER=${LAUNCHER:-mpirun --map-by "slot:PE=$OMP_NUM_THREADS" --bind-to core}
# shellcheck disable=SC2086
breccia_command "$SCENE" "$OUT" --threads "$OMP_NUM_THREADS" --walltime "$(walltime_of_run)" ${OPTIONS:-}

status=0
run_with_checkpoint_signal "${command[@]:?}" || status=$?
finish "$status" submit_again pbs-cpu.sh
