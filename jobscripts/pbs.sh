# shellcheck shell=bash
# Sourced by the PBS job scripts.

# WALLTIME (hh:mm:ss, that of the job) less five minutes, or less a tenth where that is shorter.
walltime_of_run() {
  local hours minutes seconds total margin
  IFS=: read -r hours minutes seconds <<<"${WALLTIME:?-v WALLTIME=hh:mm:ss, that of the job}"
  total=$((10#$hours * 3600 + 10#$minutes * 60 + 10#$seconds))
  margin=$((total / 10 < 300 ? total / 10 : 300))
  total=$((total - margin))
  printf '%02d:%02d:%02d' $((total / 3600)) $((total / 60 % 60)) $((total % 60))
}

# submit_again SCRIPT: the same job once more, with its environment (-V), the time WALLTIME and, where the first was
# submitted with -l options of its own, RESOURCES ("select=2:ncpus=32:mpiprocs=32").
submit_again() {
  qsub -V -l walltime="$WALLTIME" ${RESOURCES:+-l "$RESOURCES"} "$BRECCIA_HOME/jobscripts/$1"
}
