"""A job that meets its time limit: checkpoint, queued again, continued, and the result of an uninterrupted run."""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import private_slurm

BRECCIA = os.environ["BRECCIA_COMMAND"]
HOME = Path(os.environ["BRECCIA_SOURCE_DIR"])
SKIPPED = 77

STEP = 0.25
# A job on its way has many more names.
ENDED = ("BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "TIMEOUT")
# Two bodies that touch at once, for hours.
SCENE = f"""\
[scene]
end = "1e6 s"
[grid]
cell = "5 km"
[time]
step = "{STEP} s"
[effects]
gravity = "off"
[[body]]
shape = "sphere"
radius = "50 km"
particles = 6000
damage = 1
[[body]]
shape = "sphere"
radius = "50 km"
particles = 6000
damage = 1
[impact]
velocity = "150 m/s"
angle = "20 deg"
separation = "105 km"
[output]
snapshots = "every 1e6 s"
diagnostics = "every 1e6 s"
checkpoint_wall = "off"
"""


class TimeLimit(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="slurm")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.folder.chmod(0o755)
        self.scene = self.folder / "scene.toml"
        self.scene.write_text(SCENE)

    def test_continues_until_done(self):
        with private_slurm.PrivateSlurm(self.folder) as slurm:
            number = self.submit(slurm)
            # Hours of work: the first job meets its limit of a minute however fast the machine is.
            self.wait_for(slurm, number, "PENDING", restarts=1)
            steps = int(re.findall(r"stopped at .* step (\d+),", self.log())[-1])
            end = STEP * (steps + steps // 8)
            self.scene.write_text(SCENE.replace("1e6 s", f"{end} s"))
            slurm.let_start(number)
            self.wait_for(slurm, number, "COMPLETED", restarts=1)
        self.assertIn("stopped with a checkpoint: to be continued", self.log())
        self.assertTrue(self.log().endswith("done\n"), self.log())
        self.compare_with_uninterrupted()

    def log(self):
        path = self.folder / "job.log"
        return path.read_text() if path.exists() else ""

    def submit(self, slurm):
        job = [HOME / "jobscripts" / "slurm-cpu.sh", self.scene, self.folder / "job"]
        # The signal comes 20 s before the limit, or up to 30 s earlier: Slurm looks every 30 s.
        options = ["--parsable", "--ntasks-per-node=2", "--time=1", "--signal=B:USR1@20"]
        options += [f"--output={self.folder}/job.log", f"--chdir={HOME}"]
        export = f"--export=ALL,BRECCIA={BRECCIA},LAUNCHER=mpirun,BRECCIA_HOME={HOME}"
        return slurm.run("sbatch", *options, export, *map(str, job)).strip()

    def wait_for(self, slurm, number, state, restarts):
        """Until the job has been queued again so often and is in that state; any other end is a failure."""
        deadline = time.monotonic() + 240
        while time.monotonic() < deadline:
            job = slurm.job(number)
            if job["JobState"] == state and int(job["Restarts"]) == restarts:
                return
            self.assertNotIn(job["JobState"], ENDED, f"{self.log()}\n{job}")
            time.sleep(0.3)
        self.fail(f"not {state} in time\n{self.log()}\n{job}")

    def compare_with_uninterrupted(self):
        command = ["mpirun", "-n", "2", BRECCIA, "run", self.scene, "--out", self.folder / "whole"]
        subprocess.run(command, check=True, capture_output=True, timeout=240)
        parts, whole = (json.loads((self.folder / name / "summary.json").read_text()) for name in ("job", "whole"))
        for key in ("steps", "simulated_time", "conservation", "remnants"):
            self.assertEqual(parts[key], whole[key], key)
        # Snapshots number 1 are those of the end.
        difference = subprocess.run(
            ["h5diff", self.folder / "job/snap_0001.hdf", self.folder / "whole/snap_0001.hdf", "/PartType0"],
            capture_output=True, text=True,
        )
        self.assertEqual(difference.returncode, 0, difference.stdout + difference.stderr)


if __name__ == "__main__":
    reason = private_slurm.missing()
    if reason:
        print(f"skipped: {reason}")
        sys.exit(SKIPPED)
    unittest.main()
