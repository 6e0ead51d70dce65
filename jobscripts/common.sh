# shellcheck shell=bash
# Sourced by the job scripts.

# A job shorter than its warning is warned before there is anything to stop.
trap 'echo "SIGUSR1 before the run began: --time must be longer than the time in --signal" >&2; exit 2' USR1

# Runs a command and hands SIGUSR1 on to it: breccia then writes a checkpoint and ends with 75. Returns its exit code.
run_with_checkpoint_signal() {
  local child status signalled
  "$@" </dev/null &
  child=$!
  trap 'signalled=1; kill -USR1 "$child" 2>/dev/null' USR1
  # The signal ends `wait`, not the run: wait again until it has ended by itself.
  while :; do
    signalled=0
    status=0
    wait "$child" || status=$?
    ((signalled)) || break
  done
  trap - USR1
  return "$status"
}

# breccia_command SCENE OUT [OPTION...]: sets the array `command` to the run that begins, or goes on where it stopped.
breccia_command() {
  local scene=$1 out=$2
  shift 2
  local breccia=${BRECCIA:-$BRECCIA_HOME/build/release/breccia}
  [[ -x $breccia ]] || { echo "no program $breccia: run tools/build, or set BRECCIA" >&2; exit 2; }
  # LAUNCHER is split into words on purpose: it is a command with options.
  # shellcheck disable=SC2034,SC2206
  command=($LAUNCHER "$breccia" run "$scene" --out "$out" --restart auto "$@")
}

# finish STATUS COMMAND...: after the run ended with STATUS; the command queues the job again, where there is more to do.
finish() {
  local status=$1
  shift
  case $status in
    0) echo "done" ;;
    75) echo "stopped with a checkpoint: to be continued"; "$@" ;;
    *) echo "breccia ended with $status: not continued" >&2; exit "$status" ;;
  esac
}
