"""`breccia check`: the plan for people and for programs."""

import json
import unittest
from math import pi

from command import CommandTest, breccia


class Check(CommandTest):
    def check_json(self, *arguments, ranks=1):
        process = breccia("check", self.write_scene(), *arguments, "--json", "-", ranks=ranks)
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        return json.loads(process.stdout)

    def test_bodies(self):
        for ranks in (1, 2):
            target, impactor = self.check_json(ranks=ranks)["bodies"]
            self.assertEqual((target["name"], target["particles"]), ("target", 300))
            # Basalt of 2700 kg/m3; the mass of a sphere is exact whatever its particles are.
            self.assertAlmostEqual(target["mass"] / (2700 * 4 / 3 * pi * 50e3**3), 1, delta=1e-12)
            self.assertEqual(impactor["position"], [140e3, 0, 0])
            self.assertEqual(impactor["velocity"], [-200, 0, 0])
            self.assertEqual(impactor["spin"], [0, 0, 0])

    def test_plan(self):
        plan = self.check_json(ranks=2)
        self.assertEqual(plan["time_step"], 0.25)
        self.assertIn("scene", plan["time_step_limited_by"])
        self.assertEqual((plan["steps"], plan["particles"], plan["ranks"]), (400, 400, 2))
        self.assertGreater(plan["memory_per_rank"], plan["bytes_per_particle"] * 200)
        self.assertGreater(plan["wall_seconds"], 0)

    def test_effects_and_overrides(self):
        effects = self.check_json()["effects"]
        self.assertEqual(set(effects), {"gravity", "shear", "strength", "damage", "viscosity", "energy"})
        for name, effect in effects.items():
            self.assertIsInstance(effect["on"], bool)
            self.assertTrue(effect["reason"], name)
        self.assertTrue(effects["gravity"]["on"])
        without = self.check_json("--set", "effects.gravity=off", "--set", "effects.energy=false")
        self.assertFalse(without["effects"]["gravity"]["on"])
        self.assertFalse(without["effects"]["energy"]["on"])
        self.assertLess(without["bytes_per_particle"], self.check_json()["bytes_per_particle"])

    def test_override_of_a_list(self):
        keys = self.check_json("--set", 'gravity.uniform=["0", "0", "-9.81 m/s2"]')["parameters"]
        uniform = next(key for key in keys if key["key"] == "gravity.uniform")
        self.assertTrue(uniform["given"])
        self.assertIn("-9.81", uniform["value"])

    def test_text_names_everything_once(self):
        for ranks in (1, 2):
            process = breccia("check", self.write_scene(), ranks=ranks)
            self.assertEqual((process.returncode, process.stderr), (0, ""))
            for heading in ("Parameters", "Effects", "Bodies", "Plan"):
                self.assertEqual(process.stdout.count(f"{heading}"), 1, heading)
            for key in ("* grid.cell", "  gravity.interval", "time step", "memory per rank", "wall time"):
                self.assertIn(key, process.stdout)

    def test_json_beside_text(self):
        file = self.folder / "plan.json"
        process = breccia("check", self.write_scene(), "--json", file)
        self.assertEqual(process.returncode, 0)
        self.assertIn("Plan", process.stdout)
        self.assertEqual(json.loads(file.read_text())["particles"], 400)


if __name__ == "__main__":
    unittest.main()
