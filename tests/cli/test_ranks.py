"""Runs on several ranks: the same bytes on any number of them where asked for, and what a run says of its messages."""

import json
import unittest

from command import SCENE, CommandTest, breccia

# In contact from the start: wherever the slabs meet, they share nodes.
TOUCHING = SCENE.replace('"140 km"', '"84 km"')
REPRODUCIBLE = """
[numerics]
reproducible = true
[output]
snapshots = "every 4 s"
checkpoint_time = "every 4 s"
keep = 9
"""


class Ranks(CommandTest):
    def run_scene(self, scene, out, *arguments, ranks=1, code=0):
        process = breccia("run", scene, "--out", self.folder / out, "--steps", "40", *arguments, ranks=ranks)
        self.assertEqual(process.returncode, code, process.stderr)
        return process

    def assert_same_snapshots(self, one, other):
        snapshots = sorted(path.name for path in (self.folder / one).glob("snap_*.hdf"))
        self.assertGreater(len(snapshots), 2)
        for name in snapshots:
            self.assertEqual((self.folder / one / name).read_bytes(), (self.folder / other / name).read_bytes(), name)

    def test_same_bytes_on_any_number_of_ranks(self):
        scene = self.write_scene(TOUCHING + REPRODUCIBLE)
        off = ("--set", "effects.gravity=off")
        for ranks in (1, 2, 3):
            self.run_scene(scene, f"on_{ranks}", *off, ranks=ranks)
        self.assert_same_snapshots("on_1", "on_2")
        self.assert_same_snapshots("on_1", "on_3")
        # Two ranks go on where three were, and end as one does.
        for late in sorted((self.folder / "on_3").glob("checkpoint_*"))[1:]:
            late.unlink()
        (self.folder / "on_3" / "summary.json").unlink()
        self.run_scene(scene, "on_3", *off, "--restart", "auto", ranks=2)
        self.assert_same_snapshots("on_1", "on_3")

    def test_host_only(self):
        scene = self.write_scene(TOUCHING + REPRODUCIBLE)
        process = self.run_scene(scene, "out", "--device", "cuda", code=2)
        self.assertIn("numerics.reproducible", process.stderr)

    def test_messages_are_told_of(self):
        scene = self.write_scene(TOUCHING)
        timeline = self.folder / "timeline.json"
        process = self.run_scene(scene, "out", "--profile", "--timeline", timeline, ranks=2)
        self.assertRegex(process.stdout, r"messages of nodes: +\d+\.\d %")
        halo = json.loads((self.folder / "out" / "summary.json").read_text())["halo"]
        self.assertTrue(0.0 <= halo["hidden_fraction"] <= 1.0, halo)
        self.assertGreater(halo["bytes_per_step"], 0)
        self.assertGreater(halo["in_flight_seconds"], 0.0)
        events = json.loads(timeline.read_text())["traceEvents"]
        for rank in (0, 1):
            bars = [e for e in events if e["ph"] == "X" and e["pid"] == rank]
            names = {e["name"] for e in bars}
            self.assertLessEqual({"grid", "boundary tiles", "interior tiles", "sums", "velocities"}, names)
            # Boundary tiles of a pass are done before its sums are sent, and those arrive after that.
            for sums in (e for e in bars if e["name"] == "sums"):
                self.assertGreaterEqual(sums["dur"], 0.0)
                before = [e for e in bars if e["name"] == "boundary tiles" and e["ts"] <= sums["ts"]]
                self.assertTrue(all(e["ts"] + e["dur"] <= sums["ts"] + 0.01 for e in before))

    def test_one_rank_has_no_messages(self):
        self.run_scene(self.write_scene(TOUCHING), "out")
        self.assertIsNone(json.loads((self.folder / "out" / "summary.json").read_text())["halo"])


if __name__ == "__main__":
    unittest.main()
