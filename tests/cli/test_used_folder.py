"""What a run makes of an output folder that another run has used: it goes on, starts anew, or says why it does not."""

import json
import shutil
import unittest

from command import SCENE, CommandTest, breccia

EVERY_WINDOW = '\n[gravity]\ninterval = 8\n[output]\ncheckpoint_time = "every 2 s"\nsnapshots = "every 6 s"\n'
NO_CHECKPOINTS = ("--set", "output.checkpoint_time=off", "--set", "output.checkpoint_wall=off")


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def times(folder):
    return [file["time"] for file in json.loads((folder / "run.hdf.series").read_text())["files"]]


class UsedFolder(CommandTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write_scene(SCENE + EVERY_WINDOW)
        self.out = self.folder / "out"

    def attempt(self, *arguments, out=None, ranks=1):
        return breccia("run", self.scene, "--out", out or self.out, *arguments, ranks=ranks)

    def run_scene(self, *arguments, out=None, ranks=1):
        process = self.attempt(*arguments, out=out, ranks=ranks)
        self.assertEqual(process.returncode, 0, process.stderr)
        return process.stderr

    def copy(self, name):
        shutil.copytree(self.out, self.folder / name)
        return self.folder / name

    def assert_refused(self, code, words, *arguments):
        before = content(self.out)
        self.assert_fails(self.attempt("--restart", "auto", *arguments), code, *words)
        self.assertEqual(content(self.out), before)

    def test_no_checkpoint(self):
        self.run_scene("--steps", 60, *NO_CHECKPOINTS)
        self.assertEqual(times(self.out), [0, 6, 12, 15])
        # A result is not done over; one of another scene neither.
        self.assert_refused(2, ["without a checkpoint", str(self.out)], "--steps", 70)
        (self.out / "summary.json").unlink()  # as if it had been killed
        self.assert_refused(2, ["grid.cell (10 km there, 9 km here)", "snap_0000.hdf"], "--set", "grid.cell=9 km")
        said = self.run_scene("--restart", "auto", "--until", "5 s", *NO_CHECKPOINTS, ranks=2)
        self.assertIn(f"no checkpoint in {self.out}: starting anew", said)
        self.assertEqual(times(self.out), [0, 5])

    def test_windows_of_the_run_before_count(self):
        """Of 24 steps in windows of 8, which would be the first window now."""
        self.run_scene("--steps", 24, *NO_CHECKPOINTS)
        self.assert_refused(2, ["without a checkpoint"], "--steps", 30, "--set", "gravity.interval=64")

    def test_branch_without_a_checkpoint_of_its_own(self):
        self.run_scene("--steps", 60)
        trunk, self.out = self.out, self.folder / "branch"
        began = sorted(trunk.glob("checkpoint_*"))[0]
        self.run_scene("--restart", began, "--steps", 62, *NO_CHECKPOINTS)
        for ended in (True, False):
            with self.subTest(ended=ended):
                self.assert_refused(2, ["did not begin there", "--restart FILE"], "--steps", 70, "--set", "grid.cell=9 km"
                                    if not ended else "output.keep=3")  # fmt: skip
                (self.out / "summary.json").unlink(missing_ok=True)
        self.assertIn("continuing from", self.run_scene("--restart", began, "--steps", 70))

    def test_end_within_the_first_window(self):
        """It leaves no checkpoint, and nothing that a new run would not have at once."""
        self.run_scene("--steps", 7)
        self.assertFalse(list(self.out.glob("checkpoint_*")))
        self.assertIn("starting anew", self.run_scene("--restart", "auto", "--steps", 9))
        self.assertEqual(times(self.out), [0, 2.25])

    def test_later_end(self):
        """A run leaves a checkpoint of its last window: a later end gives what one run to that end would have given."""
        once = ("--set", "output.checkpoint_time=off")
        whole = self.folder / "whole"
        self.run_scene("--until", "20 s", *once, out=whole)
        self.run_scene("--until", "15 s", *once)
        self.assertEqual([path.name for path in self.out.glob("checkpoint_*")], ["checkpoint_0000.h5"])
        self.assertIn("step 56", self.run_scene("--restart", "auto", "--until", "20 s", *once))
        for name, expected in content(whole).items():
            if name.startswith(("snap_", "run")):
                self.assertEqual((self.out / name).read_bytes(), expected, name)
        # On the way to a later end it has none.
        process = self.attempt("--restart", "auto", "--until", "1e6 s", "--walltime", "0:0:1")
        self.assertEqual(process.returncode, 75, process.stderr)
        self.assertFalse((self.out / "summary.json").exists())

    def test_damage_beside_good_checkpoints(self):
        self.run_scene("--steps", 60)
        whole = self.copy("whole")
        self.run_scene("--restart", "auto", "--steps", 61, out=whole)
        self.assertEqual(times(whole), [0, 6, 12, 15.25])
        for ranks, (name, damaged, left) in enumerate((
            ("run.hdf.series", b'{"files": [', [0, 6, 12, 15.25]),
            ("snap_0000.hdf", b"", [6, 12, 15.25]),
        ), start=1):
            with self.subTest(name=name):
                out = self.copy(name)
                (out / "summary.json").unlink()
                (out / "run.hdf.series").unlink()
                (out / name).write_bytes(damaged)
                said = self.run_scene("--restart", "auto", "--steps", 61, out=out, ranks=ranks)
                self.assertIn(f"warning: {out / name}: ", said)
                self.assertIn("continuing from", said)
                self.assertEqual(times(out), left)

    def test_odd_summary(self):
        self.run_scene("--steps", 60)
        odd = {"time_step": None, "simulated_time": 1e9, "steps": 1, "scene": {}}
        for ranks, summary in enumerate((odd, ["steps"]), start=1):
            with self.subTest(summary=summary):
                (self.out / "summary.json").write_text(json.dumps(summary))
                said = self.run_scene("--restart", "auto", "--steps", 61, ranks=ranks)
                self.assertIn(f"warning: {self.out}/summary.json: not the summary of a run", said)
                self.assertIn("continuing from", said)

    def test_names_that_no_file_can_have(self):
        long = "a" * 300
        for option in (("--restart", "auto", "--out", long), ("--restart", long, "--out", "out"), ("--out", long)):
            process = breccia("run", self.scene, *option, cwd=self.folder)
            self.assert_fails(process, 4, long, ": File name too long")
            self.assertNotIn("filesystem error", process.stderr)

    def test_stop_left_by_the_run_before(self):
        self.run_scene("--steps", 16)
        (self.out / "stop").touch()
        said = self.run_scene("--restart", "auto", "--steps", 32)
        self.assertIn(f"{self.out}/stop was there before this run", said)
        self.assertFalse((self.out / "stop").exists())


if __name__ == "__main__":
    unittest.main()
