"""The job scripts with the commands of the batch system replaced: what they run, when they submit themselves again."""

import json
import os
import re
import stat
import subprocess
import tempfile
import unittest
from pathlib import Path

BRECCIA = os.environ["BRECCIA_COMMAND"]
HOME = Path(os.environ["BRECCIA_SOURCE_DIR"])
SCRIPTS = HOME / "jobscripts"
SCENE = """\
[scene]
end = "1000 s"
[grid]
cell = "10 km"
[time]
step = "0.05 s"
[effects]
gravity = "direct"
[[body]]
shape = "sphere"
radius = "50 km"
particles = 1500
"""


class Scripts(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        (self.folder / "scene.toml").write_text(SCENE)
        self.replace("qsub")
        self.replace("scontrol")

    def replace(self, program):
        """A program of that name that only notes how it was called."""
        path = self.folder / program
        path.write_text(f'#!/bin/sh\necho {program} "$@" >> {self.folder}/calls\n')
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    def calls(self):
        path = self.folder / "calls"
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return lines

    def run_script(self, name, *arguments, **variables):
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("SLURM_", "PBS_"))}
        environment |= {"PATH": f"{self.folder}:{os.environ['PATH']}", "BRECCIA_HOME": str(HOME), "BRECCIA": BRECCIA}
        return subprocess.run(
            [SCRIPTS / name, *map(str, arguments)], cwd=self.folder, env=environment | variables,
            capture_output=True, text=True, timeout=120,
        )

    def run_pbs(self, **variables):
        defaults = {"PBS_O_WORKDIR": str(self.folder), "SCENE": "scene.toml", "OUT": "out", "WALLTIME": "00:00:03"}
        return self.run_script("pbs-cpu.sh", **(defaults | {"LAUNCHER": "mpirun -n 2"} | variables))

    def test_pbs_submits_itself_until_done(self):
        # 1e7 steps of 1,500 particles with gravity: hours on any machine, so that two jobs run out of time.
        scene = self.folder / "scene.toml"
        scene.write_text(SCENE.replace("1000 s", "500000 s"))
        for _ in range(2):
            process = self.run_pbs(RESOURCES="select=1:ncpus=2")
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertEqual(
                self.calls(), [f"qsub -V -l walltime=00:00:03 -l select=1:ncpus=2 {SCRIPTS}/pbs-cpu.sh"])
        steps = int(re.findall(r"stopped at .* step (\d+),", process.stderr)[-1]) + 32
        scene.write_text(SCENE.replace("1000 s", f"{steps * 0.05} s"))
        process = self.run_pbs(RESOURCES="select=1:ncpus=2")
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertEqual(self.calls(), [])
        summary = json.loads((self.folder / "out/summary.json").read_text())
        self.assertEqual(summary["steps"], steps)

    def test_a_failure_is_not_repeated(self):
        process = self.run_pbs(SCENE="absent.toml")
        self.assertEqual(process.returncode, 2)
        self.assertIn("absent.toml", process.stderr)
        self.assertIn("not continued", process.stderr)
        self.assertEqual(self.calls(), [])

    def test_a_missing_variable_is_named(self):
        self.assertIn("OUT", self.run_pbs(OUT="").stderr)
        self.assertIn("-v WALLTIME=hh:mm:ss", self.run_pbs(WALLTIME="").stderr)

    def test_walltime_leaves_time_for_the_checkpoint(self):
        echo = {"LAUNCHER": "echo"}
        self.assertIn("--walltime 11:55:00", self.run_pbs(WALLTIME="12:00:00", **echo).stdout)
        self.assertIn("--walltime 00:09:00", self.run_pbs(WALLTIME="00:10:00", **echo).stdout)

    def test_slurm_requeues_after_a_checkpoint_only(self):
        slurm = {"SLURM_JOB_ID": "7", "SLURM_SUBMIT_DIR": str(HOME)}
        for code, calls in ((75, ["scontrol requeue 7"]), (0, []), (3, [])):
            launcher = self.folder / f"launcher{code}"
            launcher.write_text(f"#!/bin/sh\nexit {code}\n")
            launcher.chmod(0o755)
            for script in ("slurm-cpu.sh", "slurm-gpu.sh"):
                process = self.run_script(script, "scene.toml", "out", LAUNCHER=str(launcher), **slurm)
                self.assertEqual(process.returncode, 3 if code == 3 else 0, process.stderr)
                self.assertEqual(self.calls(), calls)

    def test_a_warning_before_the_run_is_explained(self):
        """Slurm warns a job at its start that is shorter than the time in --signal."""
        script = f"source {SCRIPTS}/common.sh; kill -USR1 $$; echo run"
        process = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=60)
        self.assertEqual(process.returncode, 2, process.stderr)
        self.assertIn("--time must be longer", process.stderr)
        self.assertEqual(process.stdout, "")

    def test_the_table_has_the_cases_of_the_paper(self):
        cases = set()
        for task in range(135):
            slurm = {"SLURM_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": str(task), "SLURM_SUBMIT_DIR": str(HOME)}
            process = self.run_script("slurm-table.sh", "scene.toml", "out", LAUNCHER="echo", **slurm)
            words = process.stdout.splitlines()[0]
            velocity, angle = (int(words.split(key)[1].split()[0]) for key in ("impact.velocity=", "impact.angle="))
            self.assertIn(f"--out out/v{velocity:03d}-a{angle:02d} ", words)
            cases.add((velocity, angle))
        self.assertEqual(cases, {(v, a) for v in range(50, 401, 25) for a in range(5, 46, 5)})


if __name__ == "__main__":
    unittest.main()
