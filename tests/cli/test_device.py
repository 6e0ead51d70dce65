"""Where a run computes: the CUDA engine is loaded from a library; here one that emulates the device on the CPU."""

import csv
import json
import os
import unittest
from unittest import mock

from command import CommandTest, breccia

EMULATED = os.environ["BRECCIA_EMULATED_CUDA"]
NCCL = os.environ["BRECCIA_EMULATED_NCCL"]


def devices(library, count=1, memory=2 << 30):
    """The environment of a machine with this library and so many devices, each with so many bytes."""
    return mock.patch.dict(
        os.environ,
        BRECCIA_CUDA_LIBRARY=str(library),
        BRECCIA_EMULATED_DEVICES=str(count),
        BRECCIA_EMULATED_MEMORY=str(memory),
    )


class Device(CommandTest):
    def summary(self, out):
        return json.loads((self.folder / out / "summary.json").read_text())

    def last_row(self, out):
        with open(self.folder / out / "diagnostics.csv", newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))[-1]

    def run_scene(self, out, *options, ranks=1, steps=40):
        return breccia("run", self.write_scene(), "--steps", str(steps), "--out", out, *options, ranks=ranks, cwd=self.folder)

    def test_without_the_library(self):
        with devices(self.folder / "none.so"):
            for ranks in (1, 2):
                self.assert_fails(self.run_scene("a", "--device", "cuda", ranks=ranks), 2, "has no CUDA engine")
            process = self.run_scene("b")
            self.assertEqual((process.returncode, process.stdout), (0, ""))
            self.assertEqual(self.summary("b")["device"], "host")
            self.assertIn("has no CUDA engine", breccia("info").stdout)

    def test_without_a_device(self):
        with devices(EMULATED, 0):
            self.assert_fails(self.run_scene("a", "--device", "cuda"), 2, "no CUDA-capable device")
            process = self.run_scene("b")
            self.assertEqual(process.returncode, 0)
            self.assertIn("device: host (no CUDA-capable device", process.stdout)
            self.assertEqual(self.summary("b")["device"], "host")

    def test_library_that_is_none(self):
        broken = self.folder / "broken.so"
        broken.write_text("no library")
        with devices(broken):
            self.assert_fails(self.run_scene("a", "--device", "cuda"), 2, "broken.so")

    def test_device_gives_what_the_host_gives(self):
        with devices(EMULATED):
            process = self.run_scene("cuda")
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertIn("device: cuda (emulated device", process.stdout)
            self.assertEqual(self.run_scene("host", "--device", "host").stdout, "")
            self.assertIn("emulated device", breccia("info").stdout)
        self.assertEqual(self.summary("cuda")["device"], "cuda")
        self.assertEqual(self.summary("host")["device"], "host")
        cuda, host = self.last_row("cuda"), self.last_row("host")
        # Rounding of float positions and velocities, 1e-5 of a quantity; gravity included.
        for name in ("kinetic_energy [J]", "internal_energy [J]", "mass [kg]"):
            self.assertAlmostEqual(float(cuda[name]) / float(host[name]), 1.0, delta=1e-5, msg=name)

    def test_steps_of_a_device_are_not_booked_as_output(self):
        with devices(EMULATED):
            # It ends inside a window: nothing but the output waits for the device.
            self.assertEqual(self.run_scene("a", "--device", "cuda", steps=30).returncode, 0)
        summary = self.summary("a")
        seconds = {stage["stage"]: stage["seconds"] for stage in summary["stages"]}
        # Thirty emulated steps take ten times as long as two snapshots of so few particles.
        self.assertGreater(seconds["checks"], seconds["output"])
        self.assertGreater(summary["wall_seconds"], seconds["checks"])

    def test_a_device_for_each_rank(self):
        with devices(EMULATED, 2):
            process = self.run_scene("two", "--device", "cuda", ranks=2)
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertNotIn("warning", process.stderr)
            self.assertEqual(process.stdout.count("device: cuda (emulated device (1 of 2)"), 1)
        self.assertEqual((self.summary("two")["device"], self.summary("two")["ranks"]), ("cuda", 2))

    def by_nccl(self, out, library=NCCL, wanted="nccl", ranks=2, **more):
        """On a device for each rank, with this file for NCCL."""
        with mock.patch.dict(os.environ, BRECCIA_NCCL_LIBRARY=str(library), **more):
            wanted = f"parallel.device_messages={wanted}"
            return self.run_scene(out, "--device", "cuda", "--set", wanted, ranks=ranks, steps=10)

    def test_messages_by_nccl_are_those_by_mpi(self):
        ways = {"nccl": "NCCL 2.28.9", "auto": "NCCL 2.28.9", "mpi": "MPI, by way of pinned host memory"}
        rows = []
        with devices(EMULATED, 2):
            for wanted, way in ways.items():
                process = self.by_nccl(wanted, wanted=wanted)
                self.assertEqual(process.returncode, 0, process.stderr)
                self.assertEqual(process.stdout.count(f"messages between devices: {way}\n"), 1, process.stdout)
                row = self.last_row(wanted)
                rows.append({name: row[name] for name in row if not name.startswith("wall")})
            self.assertEqual(rows, 3 * rows[:1])
            self.assertNotIn("messages", self.by_nccl("one", ranks=1).stdout)

    def test_nccl_that_cannot_be(self):
        missing = self.folder / "libnccl.so.2"
        words = 'parallel.device_messages = "nccl": ', '; use "mpi" or "auto"'
        with devices(EMULATED, 2):
            self.assert_fails(self.by_nccl("a", missing), 2, *words, f"{missing}: cannot open")
            process = self.by_nccl("b", missing, wanted="auto")
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertIn(f"by way of pinned host memory (no NCCL: {missing}: cannot open", process.stdout)
        with devices(EMULATED, 1):
            self.assert_fails(self.by_nccl("a"), 2, *words, "up to 2 ranks share a CUDA device")
        self.assertFalse((self.folder / "a").exists())

    def test_lost_message_ends_the_run(self):
        with devices(EMULATED, 2):
            process = self.by_nccl("a", BRECCIA_NCCL_FAULT="lost", BRECCIA_NCCL_PATIENCE="1")
        self.assertEqual(process.returncode, 4, process.stderr)
        self.assertEqual(process.stderr.count("breccia: error: "), 1, process.stderr)
        self.assertIn("NCCL: messages between ranks: remote process exited", process.stderr)

    def test_more_ranks_than_devices(self):
        with devices(EMULATED):
            process = self.run_scene("two", "--device", "cuda", ranks=2, steps=2)
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertEqual(process.stderr.count("warning: up to 2 ranks share a CUDA device"), 1)

    def test_too_little_memory(self):
        with devices(EMULATED, memory=50_000):
            for ranks in (1, 2):
                process = self.run_scene("a", "--device", "cuda", ranks=ranks)
                self.assert_fails(process, 2, "emulated device has not enough memory")
                self.assertRegex(process.stderr, rf"needed by {ranks} ranks? \(\d+ bytes\), 0.01 GB available")

    def test_device_that_is_unfit(self):
        unfit = "emulated device cannot be used: it has "
        for variable, value, words in (
            ("BRECCIA_EMULATED_CAPABILITY", "75", "compute capability 7.5, and the engine needs 8.0"),
            ("BRECCIA_EMULATED_SHARED", "49152", "49152 bytes of shared memory for a thread block, and a tile takes "),
        ):
            with devices(EMULATED), mock.patch.dict(os.environ, {variable: value}):
                self.assert_fails(self.run_scene("a", "--device", "cuda"), 2, f"--device cuda: {unfit}{words}")
                process = self.run_scene(variable, steps=2)
                self.assertEqual(process.returncode, 0, process.stderr)
                self.assertIn(f"device: host ({unfit}{words}", process.stdout)

    def test_device_for_mixed_precision_only(self):
        with devices(EMULATED), mock.patch.dict(os.environ, BRECCIA_EMULATED_SHARED="101376"):
            self.assertEqual(self.run_scene("a", "--device", "cuda", steps=2).returncode, 0)
            for ranks in (1, 2):
                process = self.run_scene("b", "--device", "cuda", "--set", "numerics.precision=double", ranks=ranks)
                self.assert_fails(process, 2, "it has 101376 bytes of shared memory for a thread block, and a tile takes ")
                self.assertIn("in double precision; use --device host or auto", process.stderr)
            process = self.run_scene("c", "--set", "numerics.precision=double", steps=2)
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertIn("device: host (emulated device cannot be used: it has 101376 bytes", process.stdout)

    def test_run_continues_on_the_other_device(self):
        with devices(EMULATED):
            first = self.run_scene("out", "--walltime", "0", "--device", "cuda")
            self.assertEqual(first.returncode, 75, first.stderr)
            second = self.run_scene("out", "--restart", "auto", "--device", "host")
            self.assertEqual(second.returncode, 0, second.stderr)


if __name__ == "__main__":
    unittest.main()
