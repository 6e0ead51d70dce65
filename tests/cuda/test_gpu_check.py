"""tools/gpu-check without a GPU: what it says, and all that it does with the library of the emulated device."""

import ctypes
import importlib.machinery
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def gpu_check(*options):
    return subprocess.run([ROOT / "tools/gpu-check", *options], capture_output=True, text=True, check=False)


class GpuCheck(unittest.TestCase):
    def test_without_a_device(self):
        try:
            ctypes.CDLL("libcuda.so.1")
            self.skipTest("there is a driver here")
        except OSError:
            pass
        process = gpu_check()
        self.assertEqual((process.returncode, process.stdout), (2, ""))
        self.assertRegex(process.stderr, "^gpu-check: there is no CUDA device here .*: nothing has been checked\n$")

    def test_on_the_emulated_device(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "check.json"
            process = gpu_check("--emulated", "--build", os.environ["BRECCIA_BUILD"], "--json", str(file))
            self.assertEqual(process.returncode, 0, process.stdout + process.stderr)
            found = json.loads(file.read_text(encoding="utf-8"))
        self.assertTrue(found["emulated"])
        self.assertEqual(found["tests"]["failed"], [])
        self.assertEqual(found["tests"]["passed"], 10)
        self.assertTrue(found["messages"]["same"])
        self.assertEqual(found["messages"]["nccl"]["way"], "NCCL 2.28.9")
        self.assertIn("MPI", found["messages"]["mpi"]["way"])
        self.assertEqual({rate["precision"] for rate in found["rates"]}, {"mixed", "double"})
        for rate in found["rates"]:
            self.assertGreater(rate["device"], 0)
            self.assertGreater(rate["host"], 0)
        (gravity,) = found["gravity"]
        self.assertEqual((gravity["chosen"], gravity["particles"]), ("direct", 1200))
        self.assertLess(gravity["rms"], 1e-5)
        self.assertIn("emulated", process.stdout)

    def test_missing_library_is_told_from_wrong_messages(self):
        loader = importlib.machinery.SourceFileLoader("gpu_check", str(ROOT / "tools/gpu-check"))
        check = importlib.util.module_from_spec(importlib.util.spec_from_loader("gpu_check", loader))
        sys.dont_write_bytecode = True
        loader.exec_module(check)
        missing = check.reason(
            'breccia: error: parallel.device_messages = "nccl": libnccl.so.2: cannot open\n-----\nmpirun: rank 0 ...\n-----\n'
        )
        self.assertTrue(check.is_missing(missing), missing)
        wrong = check.reason(
            "breccia: error: NCCL: the first message of rank 1 to rank 0 did not come as it was sent; run with "
            'parallel.device_messages = "mpi"\n-----\n'
        )
        self.assertFalse(check.is_missing(wrong), wrong)

    def test_build_that_is_not_there(self):
        process = gpu_check("--emulated", "--build", "/nowhere")
        self.assertEqual(process.returncode, 2)
        self.assertIn("/nowhere has no", process.stderr)


if __name__ == "__main__":
    unittest.main()
