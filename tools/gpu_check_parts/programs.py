"""Programs that tools/gpu-check runs: each has a time of its own, all of them share one limit."""

import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Unfinished(Exception):
    """Something could not be built or run to its end: neither passed nor failed."""


class TimeUp(Unfinished):
    """The limit for all programs together has come."""


class Finished(NamedTuple):
    failure: str  # empty where it ended with 0
    out: str
    errors: str


class Programs:
    def __init__(self, seconds):
        self.seconds = seconds
        self.end = time.monotonic() + seconds

    def run(self, command, seconds=None, environment=None):
        """What a program said and how it ended; None for `seconds`: all that is left."""
        left = self.end - time.monotonic()
        if left <= 0:
            raise self.time_up()
        allowed = left if seconds is None else min(seconds, left)
        # Files instead of pipes: what a killed program started may hold a pipe open for ever.
        with tempfile.TemporaryFile("w+", errors="replace") as out, tempfile.TemporaryFile("w+", errors="replace") as errors:
            code = wait(command, allowed, environment, out, errors)
            if code is None and allowed == left:
                raise self.time_up()
            for file in (out, errors):
                file.seek(0)
            return Finished(how_it_ended(code, seconds), out.read(), errors.read())

    def time_up(self):
        return TimeUp(f"the time for everything, {self.seconds:g} s, was up")


def how_it_ended(code, seconds):
    if code is None:
        return f"did not end in {seconds:g} s"
    return "" if code == 0 else f"ended with {code}" if code > 0 else f"ended by signal {-code}"


def wait(command, seconds, environment, out, errors):
    """The exit code, or None where time is up: then the program has been ended."""
    environment = os.environ | (environment or {})
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=errors,
                               start_new_session=True)  # fmt: skip
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        return None
    finally:
        if process.poll() is None:
            end(process)


def end(process):
    """Asks first: mpirun then ends its ranks, which are in groups of their own."""
    for number, seconds in ((signal.SIGTERM, 10), (signal.SIGKILL, None)):
        os.killpg(process.pid, number)
        try:
            process.wait(seconds)
            return
        except subprocess.TimeoutExpired:
            pass
