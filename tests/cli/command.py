"""Runs the built command as a user would, alone or under mpirun, and writes small scenes for it."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

BRECCIA = os.environ["BRECCIA_COMMAND"]
MPIRUN = os.environ["BRECCIA_MPIRUN"]
# Far above what any command here takes: reaching it means that ranks wait for each other.
TIMEOUT = 60

# Two spheres of a few hundred particles that meet head-on; everything else by default.
SCENE = """\
[scene]
end = "100 s"
[grid]
cell = "10 km"
[time]
step = "0.25 s"
[materials.basalt]
preset = "basalt"
[[body]]
name = "target"
shape = "sphere"
radius = "50 km"
particles = 300
damage = 1
[[body]]
name = "impactor"
shape = "sphere"
radius = "30 km"
particles = 100
damage = 1
position = ["140 km", "0 km", "0 km"]
velocity = ["-200 m/s", "0 m/s", "0 m/s"]
"""


def run_program(command, ranks=1, cwd=None):
    """Completed process with text output. mpirun's own remarks about a failed rank are switched off."""
    if ranks > 1:
        command = [MPIRUN, "-n", str(ranks), *command]
    environment = dict(os.environ, OMPI_MCA_orte_execute_quiet="1")
    with subprocess.Popen(
        command,
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            output, errors = process.communicate(timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            process.terminate()  # mpirun passes this on to its ranks; killed, it would leave them behind
            raise
    return subprocess.CompletedProcess(command, process.returncode, output, errors)


def breccia(*arguments, ranks=1, cwd=None):
    return run_program([BRECCIA, *map(str, arguments)], ranks, cwd)


class CommandTest(unittest.TestCase):
    """A test with a folder of its own, gone afterwards."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def write_scene(self, text=SCENE):
        path = self.folder / "scene.toml"
        path.write_text(text)
        return path

    def assert_fails(self, process, code, *words):
        """Exit code, nothing on standard output, one line on standard error that holds every one of `words`."""
        self.assertEqual(process.returncode, code, process.stderr)
        self.assertEqual(process.stdout, "")
        self.assertEqual(process.stderr.count("\n"), 1, process.stderr)
        self.assertTrue(process.stderr.startswith("breccia: error: "), process.stderr)
        for word in words:
            self.assertIn(word, process.stderr)
