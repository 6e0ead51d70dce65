"""tools/gpu-check without a GPU: what it says, what it makes of programs that fail, and all that it does with the library of
the emulated device."""

import contextlib
import ctypes
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
sys.dont_write_bytecode = True

from gpu_check_parts import cards, machine, programs, stages  # noqa: E402


def gpu_check(*options, environment=None):
    return subprocess.run([ROOT / "tools/gpu-check", *options], env=os.environ | (environment or {}), capture_output=True,
                          text=True, check=False)  # fmt: skip


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
        self.assertGreaterEqual(found["tests"]["passed"], 10)
        self.assertTrue(found["messages"]["same"])
        self.assertEqual(found["messages"]["alone"]["way"], "none")
        self.assertEqual(found["messages"]["nccl"]["way"], "NCCL 2.28.9")
        self.assertEqual(found["messages"]["mpi"]["way"], "MPI, by way of pinned host memory")
        self.assertEqual(found["messages"]["waited"]["way"], "MPI, by way of pinned host memory, waited for in every step")
        self.assertEqual({rate["precision"] for rate in found["rates"]}, {"mixed", "double"})
        for rate in found["rates"]:
            self.assertGreater(rate["device"], 0)
            self.assertGreater(rate["host"], 0)
        (gravity,) = found["gravity"]
        self.assertEqual((gravity["chosen"], gravity["particles"]), ("direct", 1200))
        self.assertLess(gravity["rms"], 1e-5)
        self.assertEqual(gravity["allowed"], 1e-5)
        self.assertEqual((found["exit_code"], set(found["stages"].values())), (0, {"done"}))
        self.assertIn("x86-64", found["instruction_set"])
        self.assertIn("emulated", process.stdout)

    def test_build_that_is_not_there(self):
        process = gpu_check("--emulated", "--build", "/nowhere")
        self.assertEqual(process.returncode, 2)
        self.assertIn("--build /nowhere: there is no breccia; nothing has been checked", process.stderr)

    def test_best_instruction_set(self):
        v3 = "avx2 bmi1 bmi2 f16c fma movbe"
        v4 = f"{v3} avx512f avx512bw avx512cd avx512dq avx512vl"
        for flags, isa in ((v4, "x86-64-v4"), (f"{v3} avx512f", "x86-64-v3"), ("sse4_2 avx2", "x86-64-v2"), ("", "x86-64-v2")):
            self.assertEqual(machine.best_instruction_set(f"model name\t: X\nflags\t\t: fpu {flags}\nbugs\t\t: none\n"), isa)

    def test_rooflines_of_the_very_card_alone(self):
        for name in ("NVIDIA H100 PCIe", "NVIDIA H100 NVL", "NVIDIA A100-SXM4-40GB", "NVIDIA GH200 480GB", "emulated device"):
            best, why_none = cards.rooflines(name)
            self.assertEqual(best, {})
            self.assertTrue(why_none.startswith(f"No roofline for {name}: tools/gpu-report has those of "), why_none)
        best, why_none = cards.rooflines("NVIDIA H100 80GB HBM3")
        self.assertEqual((set(best), why_none), ({"mixed", "double"}, ""))
        self.assertGreater(best["mixed"], best["double"])

    def test_errors_allowed(self):
        for chosen, setting, allowed in (("direct", "default", 1e-5), ("direct", "all pairs", 1e-5),
                                         ("treepm", "default", 3.5e-4), ("tree", "error 1.2e-04", 1.2e-4)):  # fmt: skip
            self.assertEqual(stages.allowed_error({"chosen": chosen, "setting": setting}), allowed)


def command_lines():
    """Of all processes."""
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            yield file.read_bytes().replace(b"\0", b" ").decode(errors="replace")


class Short(programs.Programs):
    """Gives a run by NCCL four seconds."""

    def run(self, command, seconds=None, environment=None):
        return super().run(command, 4 if "parallel.device_messages=nccl" in command else seconds, environment)


class FakePrograms(unittest.TestCase):
    """A build folder of programs that do as they are told: what becomes of the exit code, and what is kept."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "tests").mkdir()
        for name in ("breccia", "breccia_bench", "tests/test_cuda_device"):
            shutil.copy(Path(__file__).parent / "fake_program.py", self.folder / name)

    def run_with(self, fake, *options, devices=2):
        file = self.folder / "new" / "check.json"
        process = gpu_check("--emulated", "--build", self.folder, "--json", file, *options,
                            environment={"FAKE": fake, "BRECCIA_EMULATED_DEVICES": str(devices)})  # fmt: skip
        return process, json.loads(file.read_text(encoding="utf-8"))

    def expect(self, code, stage, text, fake, *options, devices=2):
        """Exit code, how the stage ended, and that all others were done."""
        process, found = self.run_with(fake, *options, devices=devices)
        self.assertEqual((process.returncode, found["exit_code"]), (code, code), process.stdout + process.stderr)
        self.assertRegex(found["stages"][stage], text)
        self.assertEqual({state for name, state in found["stages"].items() if name != stage}, {"done"})
        return process, found

    def test_all_right(self):
        _, found = self.expect(0, "ranks", "^done$", "", "--commit", "v1")
        self.assertEqual((found["commit"], found["instruction_set"], found["host"]),
                         ("v1", "x86-64-v9 (AVX-1024): 32 floats", "some processor, 3 hardware threads"))  # fmt: skip

    def test_comparison_that_fails(self):
        self.expect(1, "comparison", "^failed: Precisions/DeviceTest.DebrisEqualsHostEngine/mixed$", "tests=wrong")
        self.expect(1, "comparison", r"^failed: \(no test ran\)$", "tests=none")

    def test_measurement_that_fails_leaves_the_others(self):
        process, found = self.expect(3, "rates", "^not done: breccia_bench engine ended with 4: .*it failed$", "engine=fails")
        self.assertEqual(found["tests"]["passed"], 1)
        self.assertIn("gpu-check: not done: rates", process.stderr)

    def test_errors_of_gravity(self):
        _, found = self.expect(1, "gravity", "^failed: tree .error 3.5e-04. of 1200 .*: rms error 4.0e-04, allowed 3.5e-04$",
                               "gravity=wrong")  # fmt: skip
        self.assertEqual(found["gravity"][0]["rms"], 4e-4)
        self.expect(1, "gravity", "^failed: .* rms error none", "gravity=none")

    def test_missing_library_is_no_fault_but_failed_messages_are(self):
        _, found = self.expect(0, "ranks", "^done$", "nccl=missing")
        self.assertTrue(found["messages"]["same"])
        self.expect(1, "ranks", "^failed: mpi: breccia: error: it failed$", "nccl=missing mpi=fails")
        self.expect(1, "ranks", "^failed: nccl: breccia: error: it failed$", "nccl=fails")

    def test_ranks_that_differ(self):
        self.expect(1, "ranks", "results by MPI and by NCCL are not the same", "nccl=wrong")
        self.expect(1, "ranks", "results by MPI and by MPI, waited for are not the same", "waited=wrong")
        self.expect(1, "ranks", "2 ranks differ from one in elastic_energy", "nccl=wrong waited=wrong mpi=wrong")

    def test_one_device_is_shared(self):
        process, found = self.expect(0, "ranks", "^done$", "", devices=1)
        self.assertIn("2 ranks on one device, MPI", process.stdout)
        self.assertNotIn("nccl", found["messages"])
        self.expect(1, "ranks", "2 ranks differ from one in elastic_energy", "mpi=wrong", devices=1)

    def test_stages_as_on_a_card(self):
        card = machine.Device("NVIDIA H100 80GB HBM3", 90, 1)
        where = stages.Context(programs.Programs(100), self.folder, card, False, {})
        tests, rates, gravity, messages = {}, [], [], {}
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            failed = (stages.compare_with_host(where, tests) + stages.measure_engine(where, rates)
                      + stages.measure_gravity(where, gravity) + stages.collide_on_ranks(where, messages))  # fmt: skip
        self.assertEqual((failed, tests["steps"], messages["devices"]), ([], 200, 1))
        self.assertEqual([rate["case"] for rate in rates], ["paper", "debris", "cell8_1e6"])
        # 2e9 of 11.9e9.
        self.assertRegex(said.getvalue(), r"cell8_1e6 +mixed +2000.000 +2000.0 +11\d\d\d +17 %")
        self.assertEqual([g["particles"] for g in gravity], [94648, 1000000])
        self.assertEqual(messages["steps"] % 32, 0)

    def test_time_is_up(self):
        begin = time.monotonic()
        process, found = self.run_with("gravity=hangs", "--limit", "15")
        self.assertEqual(process.returncode, 3, process.stdout + process.stderr)
        self.assertLess(time.monotonic() - begin, 60)
        states = [state.partition(":")[0] for state in found["stages"].values()]
        self.assertEqual(states, ["done", "done", "not done", "not done"])
        self.assertEqual(found["stopped"], "the time for everything, 15 s, was up")
        self.assertEqual(len(found["rates"]), 1)
        self.assertIn("gpu-check: stopped: the time for everything, 15 s, was up\n", process.stderr)

    def test_ranks_that_hang_are_ended(self):
        found = {}
        environment = {"FAKE": "nccl=hangs"}
        where = stages.Context(Short(100), self.folder, machine.Device("emulated device", 0, 2), True, environment)
        begin = time.monotonic()
        with contextlib.redirect_stdout(io.StringIO()):
            failed = stages.collide_on_ranks(where, found)
        self.assertEqual(failed, ["nccl: the run did not end in 4 s: no reason was given"])
        self.assertLess(time.monotonic() - begin, 60)
        self.assertIn("way", found["mpi"])
        # A killed process takes its moment to go.
        while self.programs_left() and time.monotonic() - begin < 90:
            time.sleep(0.1)
        self.assertEqual(self.programs_left(), [])

    def programs_left(self):
        """Those of this folder that still run."""
        return [line for line in command_lines() if str(self.folder) in line]


if __name__ == "__main__":
    unittest.main()
