"""Runs of the command as the checks need them, and what is compared of two of them."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

# Two bodies with every effect, about to touch; most windows write a checkpoint, some a snapshot.
SCENE = """\
[scene]
end = "40 s"
[grid]
cell = "9 km"
[time]
step = "0.4 s"
[[body]]
name = "target"
shape = "sphere"
radius = "50 km"
particles = 1000
[[body]]
name = "impactor"
shape = "sphere"
radius = "40 km"
particles = 500
[impact]
velocity = "200 m/s"
angle = "15 deg"
separation = "96 km"
[gravity]
interval = 4
[output]
snapshots = "every 4 s"
diagnostics = "every 1 s"
checkpoint_time = "every 1 s"
"""


class Runner:
    """Starts `breccia run` of one scene on some ranks."""

    def __init__(self, root, folder, ranks):
        self.breccia = root / "build" / "release" / "breccia"
        self.folder = folder
        self.ranks = ranks
        self.stuck_launchers = 0  # mpirun that did not end after all its ranks had
        self.scene = folder / "scene.toml"
        folder.mkdir(parents=True, exist_ok=True)
        self.scene.write_text(SCENE)

    def command(self, out, *arguments):
        run = [str(self.breccia), "run", str(self.scene), "--out", str(out), *map(str, arguments)]
        return run if self.ranks == 1 else ["mpirun", "--quiet", "-n", str(self.ranks), *run]

    def start(self, out, *arguments):
        return subprocess.Popen(
            self.command(out, *arguments),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def finish(self, out, *arguments, timeout=300):
        """Exit code and standard error; the code is None if the run had to be ended."""
        process = self.start(out, *arguments)
        try:
            errors = process.communicate(timeout=timeout)[1]
            return process.returncode, errors
        except subprocess.TimeoutExpired:
            end(process)
            return None, "does not end"


def end(process):
    """Kills a run with all its ranks: they are in a session of their own."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.communicate()


def ranks_of(process):
    """Process ids of the ranks that live: the children of mpirun, or the run itself."""
    if process.args[0] != "mpirun":
        return [] if process.poll() is not None else [process.pid]
    try:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    except (FileNotFoundError, ProcessLookupError):
        return []
    ranks = []
    for pid in map(int, children):
        try:
            name, _, state = Path(f"/proc/{pid}/stat").read_text().partition("(")[2].rpartition(")")
            if name == "breccia" and state.split()[0] != "Z":
                ranks.append(pid)
        except (FileNotFoundError, ProcessLookupError):
            pass
    return ranks


def results(out):
    """Everything of a finished run that a restart must not change, as text that can be compared."""
    summary = json.loads((out / "summary.json").read_text())
    kept = {key: summary[key] for key in ("steps", "simulated_time", "conservation", "damaged_fraction", "remnants")}
    table = []
    for line in (out / "diagnostics.csv").read_text().splitlines():
        table.append(line.rpartition(",")[0])  # without the wall time
    snapshots = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(out.glob("snap_*.hdf"))}
    return {"summary": kept, "rows": table, "snapshots": snapshots, "series": (out / "run.hdf.series").read_text()}


def differences(one, other):
    return [key for key in one if one[key] != other[key]]


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def wait_for(condition, seconds):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.002)
    return False
