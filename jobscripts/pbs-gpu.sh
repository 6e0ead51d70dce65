#!/usr/bin/env bash
#PBS -N breccia-gpu
#PBS -l select=1:ncpus=32:mpiprocs=4:ngpus=4
#PBS -l walltime=12:00:00
#PBS -j oe
# A run on GPUs that continues itself, job after job, until it is done. One rank per GPU (mpiprocs = ngpus): each takes
# the device of its number on the node. From the project's folder:
#   qsub -v SCENE=scenes/impact-200-15.toml,OUT=out/impact,WALLTIME=12:00:00 jobscripts/pbs-gpu.sh
# The end of the job's time and the environment as in pbs-cpu.sh; RANKS_PER_NODE (4), CORES_PER_RANK (8).
set -euo pipefail
: "${PBS_O_WORKDIR:?submit this script with qsub}" "${SCENE:?-v SCENE=...}" "${OUT:?-v OUT=...}"
BRECCIA_HOME=${BRECCIA_HOME:-$PBS_O_WORKDIR}
cd "$PBS_O_WORKDIR"
# shellcheck source=common.sh
source "$BRECCIA_HOME/jobscripts/common.sh"
# shellcheck source=pbs.sh
source "$BRECCIA_HOME/jobscripts/pbs.sh"

cores=${CORES_PER_RANK:-8}
export OMP_NUM_THREADS=$cores
LAUNCHER=${LAUNCHER:-mpirun --map-by "ppr:${RANKS_PER_NODE:-4}:node:PE=$cores" --bind-to core}
# shellcheck disable=SC2086
breccia_command "$SCENE" "$OUT" --device cuda --walltime "$(walltime_of_run)" ${OPTIONS:-}

status=0
run_with_checkpoint_signal "${command[@]:?}" || status=$?
finish "$status" submit_again pbs-gpu.sh
