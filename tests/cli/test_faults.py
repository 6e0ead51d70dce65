"""Runs that cannot go on: what they say, what they leave, how fast all ranks end."""

import json
import time
import unittest

from command import SCENE, CommandTest, breccia

# A step of twice the stable one, with nothing that takes the energy out again.
GAINING = ("--set", "time.step=2.6 s", "--set", "effects.strength=off", "--set", "output.diagnostics=every 10 s")
FAST = ("--set", 'body[1].velocity=["-2e5 m/s", "0", "0"]')


class Numerics(CommandTest):
    def fails(self, ranks, *arguments):
        scene = self.write_scene(SCENE.replace('end = "100 s"', 'end = "1e6 s"'))
        out = self.folder / f"out{ranks}"
        start = time.monotonic()
        process = breccia("run", scene, "--out", out, *arguments, ranks=ranks)
        self.assertLess(time.monotonic() - start, 30)
        self.assertEqual(process.returncode, 3, process.stderr)
        # Progress may have been printed before.
        *_, error = process.stderr.splitlines()
        self.assertEqual(process.stderr.count("error"), 1, process.stderr)
        self.assertTrue(error.startswith("breccia: error: "), error)
        self.assertIn("dump.hdf", error)
        self.assertIn("time.step", error)
        return error, out

    def test_particle_before_and_after(self):
        """On two ranks only the second one, with the smaller body, sees it."""
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                error, out = self.fails(ranks, *FAST)
                self.assertIn("moved more than a cell", error)
                report = json.loads((out / "dump.json").read_text())
                particle = report["particle"]
                self.assertIn(f"particle {particle['id']} ", error)
                self.assertGreaterEqual(particle["id"], 300)
                self.assertEqual(particle["rank"], ranks - 1)
                self.assertAlmostEqual(particle["before"]["velocity"][0], -2e5, delta=1)
                for key in ("velocity", "J", "internal_energy", "damage"):
                    self.assertIn(key, particle["after"])
                self.assertEqual(len(particle["position"]), 3)
                found = breccia("analyze", out / "dump.hdf", "--json", "-")
                self.assertEqual(found.returncode, 0, found.stderr)

    def test_energy_gain(self):
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                error, out = self.fails(ranks, *GAINING)
                self.assertIn("energy", error)
                self.assertIn("numerics.energy_gain", error)
                self.assertTrue((out / "dump.hdf").exists())
                fastest = json.loads((out / "dump.json").read_text())["fastest_particle"]
                self.assertGreater(max(map(abs, fastest["state"]["velocity"])), 200)
                self.assertEqual(len(fastest["position"]), 3)

    def test_the_bound_is_a_key(self):
        scene = self.write_scene()
        process = breccia(
            "run", scene, "--out", self.folder / "out", "--steps", 64, *GAINING, "--set", "numerics.energy_gain=1e6"
        )
        self.assertNotIn("energy_gain", process.stderr)


if __name__ == "__main__":
    unittest.main()
