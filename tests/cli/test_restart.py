"""Stopping and continuing a run: what it goes on with, what it refuses, which files there are then."""

import csv
import json
import os
import re
import signal
import subprocess
import time
import unittest
import zlib

from command import BRECCIA, MPIRUN, SCENE, CommandTest, breccia

EVERY_WINDOW = '\n[gravity]\ninterval = 8\n[output]\ncheckpoint_time = "every 2 s"\nsnapshots = "every 6 s"\n'
STOPPED = 75


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def rows(folder):
    with open(folder / "diagnostics.csv") as file:
        return [{k: v for k, v in row.items() if not k.startswith("wall")} for row in csv.DictReader(file)]


def checkpoints(folder):
    return sorted(path.name for path in folder.glob("checkpoint_*"))


def with_checksum(content):
    """The checkpoint with the checksum of the file as it is: only that of a dataset tells what is wrong."""
    return bytes(content[:-8]) + zlib.crc32(content[:-24]).to_bytes(8, "little")


class Restart(CommandTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write_scene(SCENE + EVERY_WINDOW)

    def run_scene(self, out, *arguments, ranks=1, code=0):
        process = breccia("run", self.scene, "--out", self.folder / out, *arguments, ranks=ranks)
        self.assertEqual(process.returncode, code, process.stderr)
        return process

    def assert_same_run(self, one, other):
        """Every figure but the wall times: a restart is not to be seen in the results."""
        one, other = self.folder / one, self.folder / other
        self.assertEqual(rows(one), rows(other))
        self.assertEqual((one / "run.hdf.series").read_text(), (other / "run.hdf.series").read_text())
        # Byte for byte: files hold no times of writing.
        for path in one.glob("snap_*.hdf"):
            self.assertEqual(path.read_bytes(), (other / path.name).read_bytes(), path.name)
        for key in ("steps", "simulated_time", "conservation", "remnants"):
            self.assertEqual(summary(one)[key], summary(other)[key], key)

    def test_stop_file_and_continuation(self):
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                whole, parts = f"whole{ranks}", f"parts{ranks}"
                self.run_scene(whole, "--until", "20 s", ranks=ranks)
                # The run that is stopped finds the file at its first window, the next one at its first again.
                (self.folder / parts).mkdir()
                stop = self.folder / parts / "stop"
                process = self.start_until_rows(parts, ranks)
                stop.touch()
                errors = process.communicate(timeout=60)[1]
                self.assertEqual(process.returncode, STOPPED, errors)
                self.assertIn("a file named stop", errors)
                self.assertFalse(stop.exists())
                steps = int(re.search(r"stopped at .*step (\d+)", errors)[1])
                self.assertEqual(steps % 8, 0)
                # Past 20 s the run would have to be cut back, which is what dropping later rows is for; it ends before.
                process = self.run_scene(parts, "--restart", "auto", "--until", "20 s", ranks=ranks)
                self.assertIn("continuing from", process.stderr)
                if steps <= 80:
                    self.assert_same_run(whole, parts)

    def start(self, out, ranks, *options):
        """A running process; it would take hours to end."""
        command = [BRECCIA, "run", self.scene, "--out", self.folder / out, "--restart", "auto", "--set", "scene.end=1e6 s"]
        command += ["--set", "output.diagnostics=every 0.5 s", *options]
        if ranks > 1:
            command = [MPIRUN, "-n", str(ranks), *command]
        environment = dict(os.environ, OMPI_MCA_orte_execute_quiet="1")
        process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        return process

    def wait_for(self, condition):
        deadline = time.monotonic() + 60
        while not condition():
            self.assertLess(time.monotonic(), deadline, "the run does not start")
            time.sleep(0.005)

    def start_until_rows(self, out, ranks):
        """A running process that has written its first row; it would take hours to end."""
        process = self.start(out, ranks)
        path = self.folder / out / "diagnostics.csv"
        self.wait_for(lambda: path.exists() and path.read_text().count("\n") > 1)
        return process

    def test_signals(self):
        for ranks, number in ((1, signal.SIGUSR1), (2, signal.SIGUSR1), (1, signal.SIGTERM), (1, signal.SIGINT)):
            with self.subTest(ranks=ranks, signal=number.name):
                out = f"{number.name}{ranks}"
                process = self.start_until_rows(out, ranks)
                process.send_signal(number)
                errors = process.communicate(timeout=60)[1]
                self.assertEqual(process.returncode, STOPPED, errors)
                self.assertIn(number.name, errors)
                self.assertNotIn("error", errors)
                self.assertGreater(len(checkpoints(self.folder / out)), 0)

    def test_second_interrupt_ends_at_once(self):
        """In a window that would take hours the first one only asks."""
        out = "interrupted"
        scene = self.scene.read_text().replace("interval = 8", "interval = 4096").replace("particles = 300", "particles = 30000")
        self.scene.write_text(scene.replace('cell = "10 km"', 'cell = "2 km"').replace("0.25 s", "0.05 s"))
        process = self.start_until_rows(out, 1)
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=5)
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertEqual(checkpoints(self.folder / out), [])

    def test_signals_before_the_first_step_and_after_the_last(self):
        """From when the folder is there, particles still to be made, until the process has gone; mpirun itself hands them
        on only while it watches its ranks, and gets one."""
        self.scene.write_text(self.scene.read_text().replace("particles = 300", "particles = 30000"))
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                out = f"impatient{ranks}"
                process = self.start(out, ranks)
                self.wait_for((self.folder / out).exists)
                process.send_signal(signal.SIGUSR1)
                while ranks == 1 and process.poll() is None:
                    process.send_signal(signal.SIGUSR1)
                    time.sleep(0.002)
                errors = process.communicate(timeout=60)[1]
                self.assertEqual(process.returncode, STOPPED, errors)
                self.assertEqual(checkpoints(self.folder / out), ["checkpoint_0000.h5"])

    def test_walltime_counts_what_comes_before_the_first_step(self):
        start = time.monotonic()
        process = self.start("slow", 1, "--walltime", "3")
        self.wait_for((self.folder / "slow").exists)
        process.send_signal(signal.SIGSTOP)
        time.sleep(2.0)
        process.send_signal(signal.SIGCONT)
        errors = process.communicate(timeout=60)[1]
        self.assertEqual(process.returncode, STOPPED, errors)
        # 2 s, the rest of a window, a checkpoint and the end of MPI; counted from the first step it would be 4 s.
        self.assertLess(time.monotonic() - start, 3.8)

    def test_walltime(self):
        start = time.monotonic()
        process = breccia("run", self.scene, "--out", self.folder / "out", "--until", "1e6 s", "--walltime", "0:0:3")
        self.assertEqual(process.returncode, STOPPED, process.stderr)
        self.assertLess(time.monotonic() - start, 10)
        self.assertIn("wall time", process.stderr)

    def test_snapshot_on_demand(self):
        (self.folder / "out").mkdir()
        (self.folder / "out" / "output_now").touch()
        (self.folder / "out" / "diagnostics.csv").touch()
        self.run_scene("out", "--restart", "auto", "--steps", 16)
        self.assertFalse((self.folder / "out" / "output_now").exists())
        series = json.loads((self.folder / "out" / "run.hdf.series").read_text())
        self.assertEqual([file["time"] for file in series["files"]], [0, 2, 4])

    def test_continuation_after_a_loss(self):
        """Killed somewhere after a checkpoint: what was written since is dropped and comes again."""
        for ranks in (1, 2):
            whole, parts = f"w{ranks}", f"p{ranks}"
            self.run_scene(whole, "--until", "20 s", "--set", "scene.end=100 s", ranks=ranks)
            self.run_scene(parts, "--steps", 53, ranks=ranks)
            with open(self.folder / parts / "diagnostics.csv", "a") as file:
                file.write("13.5,54,0.2")
            self.run_scene(parts, "--until", "20 s", "--restart", "auto", ranks=ranks)
            self.assert_same_run(whole, parts)

    def test_newest_stay(self):
        self.run_scene("out", "--steps", 60)
        self.assertEqual(checkpoints(self.folder / "out"), ["checkpoint_0005.h5", "checkpoint_0006.h5"])

    def test_damaged_ones_are_passed_over(self):
        for ranks in (1, 2):
            out = f"out{ranks}"
            self.run_scene(out, "--steps", 60)
            newest = self.folder / out / "checkpoint_0006.h5"
            intact = newest.read_bytes()
            before = self.folder / out / "checkpoint_0005.h5"
            older = before.read_bytes()
            flipped = bytearray(intact)
            flipped[len(intact) // 2] ^= 1
            cases = [(bytes(flipped), "used: its checksum"), (with_checksum(flipped), "used: /Particles/")]
            if ranks == 1:
                cases += [(intact[:-1000], "truncated"), (b"", "truncated")]
            for damaged, word in cases:
                for path in (self.folder / out).glob("checkpoint_*"):
                    path.unlink()
                newest.write_bytes(damaged)
                before.write_bytes(older)
                process = self.run_scene(out, "--restart", "auto", "--steps", 61, ranks=ranks)
                for text in ("warning", "checkpoint_0006.h5", word, "checkpoint_0005.h5"):
                    self.assertIn(text, process.stderr)
                # What comes next takes the number of the damaged one.
                self.assertEqual(checkpoints(self.folder / out), ["checkpoint_0005.h5", "checkpoint_0006.h5"])
                newest.write_bytes(damaged)
                self.assert_fails(
                    breccia("run", self.scene, "--out", self.folder / out, "--restart", newest, ranks=ranks),
                    4, "checkpoint_0006.h5", word,
                )
                (self.folder / out / "summary.json").unlink()
            (self.folder / out / "checkpoint_0005.h5").write_bytes(b"nothing")
            self.assert_fails(
                breccia("run", self.scene, "--out", self.folder / out, "--restart", "auto", ranks=ranks),
                4, "checkpoint_0006.h5", "checkpoint_0005.h5",
            )

    def test_changed_scene(self):
        self.run_scene("out", "--steps", 20)
        before = {path.name: path.read_bytes() for path in (self.folder / "out").iterdir()}
        for key, value in (
            ("grid.cell", "11 km"),
            ("numerics.precision", "double"),
            ("materials.basalt.cohesion", "1e6 Pa"),
            ("body[0].particles", "301"),
            ("effects.gravity", "off"),
            ("time.step", "0.125 s"),
        ):
            process = breccia(
                "run", self.scene, "--out", self.folder / "out", "--restart", "auto", "--set", f"{key}={value}"
            )
            self.assert_fails(process, 2, key)
        self.assertEqual(before, {path.name: path.read_bytes() for path in (self.folder / "out").iterdir()})
        self.run_scene(
            "out", "--restart", "auto", "--steps", 24, "--set", "scene.end=50 s", "--set", "effects.gravity=tree",
            "--set", "output.snapshots=every 1 s", "--set", "parallel.axis=z",
        )
        self.assertEqual(summary(self.folder / "out")["steps"], 24)

    def test_finished_and_new_runs(self):
        self.run_scene("out", "--restart", "auto", "--until", "5 s")
        before = {path.name: path.read_bytes() for path in (self.folder / "out").iterdir()}
        self.run_scene("out", "--restart", "auto", "--until", "5 s")
        self.assertEqual(before, {path.name: path.read_bytes() for path in (self.folder / "out").iterdir()})
        (self.folder / "other").mkdir()
        (self.folder / "other" / "thesis.tex").touch()
        process = breccia("run", self.scene, "--out", self.folder / "other", "--restart", "auto")
        self.assert_fails(process, 2, "thesis.tex")
        process = breccia("run", self.scene, "--out", self.folder / "new", "--restart", "absent.h5")
        self.assert_fails(process, 4, "absent.h5")


if __name__ == "__main__":
    unittest.main()
