"""The memory that `breccia check` tells of, against what a run takes."""

import json
import os
import subprocess
import sys
import unittest
from unittest import mock

from command import BRECCIA, SCENE, CommandTest, breccia

EMULATED = os.environ["BRECCIA_EMULATED_CUDA"]

# Most memory [KiB] that a program had at a time.
RESIDENT = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


class Memory(CommandTest):
    def plan(self, *arguments, scene=None):
        process = breccia("check", scene or self.write_scene(), *arguments, "--json", "-")
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        return json.loads(process.stdout)

    # Dense, and so thin that the grid takes most of it: what the kernel says of a run, to a quarter. The program itself
    # takes 33 MB of it.
    def test_memory_is_what_a_run_takes(self):
        text = SCENE.replace("300", "20000").replace("100\n", "5000\n").replace("0.25 s", "0.01 s")
        for cell in ("4.3 km", "0.7 km"):
            scene = self.write_scene(text.replace("10 km", cell))
            without = ("--set", "effects.gravity=off")
            plan = self.plan(*without, scene=scene)
            out = self.folder / cell.replace(" ", "")
            command = [BRECCIA, "run", str(scene), "--device", "host", "--steps", "1", "--out", str(out), *without]
            process = subprocess.run([sys.executable, "-c", RESIDENT, *command], capture_output=True, text=True, check=True)
            taken = 1024 * int(process.stdout.split()[-1])
            self.assertAlmostEqual(plan["memory_per_rank"] / taken, 1, delta=0.25, msg=cell)

    def test_memory_of_devices(self):
        with mock.patch.dict(os.environ, BRECCIA_CUDA_LIBRARY=EMULATED):
            plan = self.plan("--set", "effects.gravity=tree")
            without = self.plan("--set", "effects.gravity=off")
            double = self.plan("--set", "numerics.precision=double")
            self.assertIn("on CUDA devices", breccia("check", self.write_scene()).stdout)
        # 400 particles: 150 bytes of fields, twice for sorting; some ten tiles of 14 KiB, blocks of 2 KiB.
        self.assertTrue(2e5 < plan["device_memory_per_rank"] < 2e6, plan["device_memory_per_rank"])
        self.assertLess(without["device_memory_per_rank"], plan["device_memory_per_rank"])
        self.assertGreater(double["device_memory_per_rank"], 1.5 * plan["device_memory_per_rank"])
        with mock.patch.dict(os.environ, BRECCIA_CUDA_LIBRARY=str(self.folder / "none.so")):
            self.assertNotIn("device_memory_per_rank", self.plan())


if __name__ == "__main__":
    unittest.main()
