"""`breccia run` from scene to summary: which files there are and what they say. Their physics is tested elsewhere."""

import csv
import json
import unittest

from command import CommandTest, breccia

STEPS = 40


class Run(CommandTest):
    def run_scene(self, *arguments, ranks=1):
        out = self.folder / f"out{ranks}"
        process = breccia("run", self.write_scene(), "--out", out, *arguments, ranks=ranks)
        self.assertEqual(process.returncode, 0, process.stderr)
        return out, json.loads((out / "summary.json").read_text())

    def test_files_and_summary(self):
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                out, summary = self.run_scene("--until", "10 s", ranks=ranks)
                names = {path.name for path in out.iterdir()}
                snapshots = {"snap_0000.hdf", "snap_0001.hdf", "run.hdf.series"}
                self.assertEqual(names, snapshots | {"checkpoint_0000.h5", "diagnostics.csv", "summary.json"})
                self.assertEqual((summary["particles"], summary["steps"], summary["ranks"]), (400, STEPS, ranks))
                self.assertAlmostEqual(summary["simulated_time"], 10.0, delta=1e-9)
                # The particles carry the mass: none may be lost.
                self.assertEqual(summary["conservation"]["mass"], 0.0)
                # 60 km apart and closing at 200 m/s: two bodies after 10 s, each whole.
                self.assertEqual(len(summary["remnants"]), 2)
                # Mixed precision stores the mass of a particle as a float: 2^-24 of it may be off.
                self.assertAlmostEqual(summary["remnants"][0]["mass_over_target"], 1.0, delta=6e-8)
                self.assertEqual(summary["scene"]["grid.cell"], "10 km")

    def test_steps_and_override(self):
        _, summary = self.run_scene("--steps", 3, "--set", "time.step=0.125 s")
        self.assertEqual(summary["steps"], 3)
        self.assertAlmostEqual(summary["simulated_time"], 0.375, delta=1e-12)

    def test_diagnostics_begin_and_end(self):
        out, _ = self.run_scene("--steps", 5)
        with open(out / "diagnostics.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["step [1]"] for row in (rows[0], rows[-1])], ["0", "5"])

    def test_profile_lists_stages(self):
        process = breccia("run", self.write_scene(), "--out", self.folder / "out", "--steps", 2, "--profile")
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertIn("stage", process.stdout)

    def test_parts_of_gravity_are_in_profile_and_summary(self):
        for ranks in (1, 2):
            out = self.folder / f"gravity{ranks}"
            process = breccia(
                "run", self.write_scene(), "--out", out, "--steps", 2, "--profile", "--set", "effects.gravity=tree",
                ranks=ranks,
            )
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertIn("gravity: tree", process.stdout)
            self.assertIn("gravity at the end: tree, the scene says so", process.stdout)
            summary = json.loads((out / "summary.json").read_text())
            self.assertEqual(summary["gravity"]["evaluations"], {"tree": 1})
            self.assertGreater(summary["gravity"]["pairs"] + summary["gravity"]["cell_interactions"], 0)
            stages = {stage["stage"]: stage["seconds"] for stage in summary["stages"]}
            self.assertLessEqual(stages["gravity: sort"] + stages["gravity: tree"], stages["gravity"])

    def test_default_folder_is_named_after_the_scene(self):
        process = breccia("run", self.write_scene(), "--steps", 1, cwd=self.folder)
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertTrue((self.folder / "out" / "scene" / "summary.json").exists())

    def test_analysis_of_a_snapshot_equals_that_of_the_run(self):
        out, summary = self.run_scene("--steps", 2)
        for ranks in (1, 2):
            process = breccia("analyze", out / "snap_0001.hdf", "--json", "-", ranks=ranks)
            self.assertEqual((process.returncode, process.stderr), (0, ""))
            remnants = json.loads(process.stdout)["remnants"]
            self.assertEqual(len(remnants), len(summary["remnants"]))
            for found, expected in zip(remnants, summary["remnants"]):
                self.assertAlmostEqual(found["mass"] / expected["mass"], 1, delta=1e-12)
                self.assertAlmostEqual(found["c_over_a"], expected["c_over_a"], delta=1e-6)
                self.assertEqual(found["class"], expected["class"])

    def test_analysis_of_what_is_no_snapshot(self):
        scene = self.write_scene()
        for ranks in (1, 2):
            self.assert_fails(breccia("analyze", self.folder / "absent.hdf", ranks=ranks), 4, "absent.hdf")
            self.assert_fails(breccia("analyze", scene, ranks=ranks), 4, "scene.toml")


if __name__ == "__main__":
    unittest.main()
