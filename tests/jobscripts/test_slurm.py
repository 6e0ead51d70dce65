"""A job that meets its time limit: checkpoint, queued again, continued, and the result of an uninterrupted run."""

import json
import os
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

# Two bodies that touch at once; it runs as long as the test says.
SCENE = """\
[scene]
end = "1e6 s"
[grid]
cell = "5 km"
[time]
step = "0.25 s"
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


def seconds_until(scene, folder, end):
    start = time.monotonic()
    command = ["mpirun", "-n", "2", BRECCIA, "run", scene, "--until", f"{end} s", "--out", folder]
    subprocess.run(command, check=True, capture_output=True, timeout=600)
    return time.monotonic() - start


class TimeLimit(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="slurm")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.folder.chmod(0o755)
        self.scene = self.folder / "scene.toml"
        self.scene.write_text(SCENE)

    def test_continues_until_done(self):
        # A run of about 60 s on this machine: the time limit is one minute, the signal comes 20 s before it or earlier.
        trial = 200
        end = trial * max(2, int(60 / seconds_until(self.scene, self.folder / "trial", trial)))
        with private_slurm.PrivateSlurm(self.folder) as slurm:
            number = self.submit(slurm, end)
            job = self.wait_for_end(slurm, number)
        log = (self.folder / "job.log").read_text()
        self.assertEqual(job["JobState"], "COMPLETED", f"{log}\n{job}")
        self.assertGreaterEqual(int(job["Restarts"]), 1, log)
        self.assertIn("stopped with a checkpoint: to be continued", log)
        self.assertTrue(log.endswith("done\n"), log)
        self.compare_with_uninterrupted(end)

    def submit(self, slurm, end):
        job = [HOME / "jobscripts" / "slurm-cpu.sh", self.scene, self.folder / "job", "--until", f"{end} s"]
        options = ["--parsable", "--ntasks-per-node=2", "--time=1", "--signal=B:USR1@20"]
        options += [f"--output={self.folder}/job.log", f"--chdir={HOME}"]
        export = f"--export=ALL,BRECCIA={BRECCIA},LAUNCHER=mpirun,BRECCIA_HOME={HOME}"
        return slurm.run("sbatch", *options, export, *map(str, job)).strip()

    def wait_for_end(self, slurm, number):
        deadline = time.monotonic() + 540
        ended = 0
        while time.monotonic() < deadline:
            job = slurm.job(number)
            # A job that is queued again has the state of one that ended for a moment.
            ended = ended + 1 if job["JobState"] not in ("PENDING", "RUNNING", "COMPLETING", "REQUEUED") else 0
            if ended == 30 or job["JobState"] == "COMPLETED":
                return job
            if job["JobState"] == "PENDING" and job["Reason"] == "BeginTime":
                # Slurm holds a job back for two minutes after a requeue.
                slurm.run("scontrol", "update", f"JobId={number}", "StartTime=now")
            time.sleep(1)
        raise AssertionError((self.folder / "job.log").read_text())

    def compare_with_uninterrupted(self, end):
        seconds_until(self.scene, self.folder / "whole", end)
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
