"""tools/gpu-report with a compiler that repeats what nvcc once said: tables, JSON, and what ends it with 1."""

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
TOOL = ROOT / "tools" / "gpu-report"

# As nvcc 13.0 says it: registers and spills of these kernels, by the file that it compiles. Names without anything
# special stand for the kernels that the test does not look at.
SAID = """ptxas info    : Compiling entry function '{name}' for '{arch}'
ptxas info    : Function properties for {name}
    {stack} bytes stack frame, {stores} bytes spill stores, {loads} bytes spill loads
ptxas info    : Used {registers} registers, used 1 barriers
ptxas info    : Compile time = 362.090 ms
"""
ANONYMOUS = "52_GLOBAL__N__2cc5284a_14_node_update_cu_56f0fd68_9709"
KERNELS = {
    "tile_pass_mixed": {"_ZN7breccia4cuda9tile_passIfEEvNS0_13PassArgumentsIT_EE": (128, 0)},
    "tile_pass_double": {"_ZN7breccia4cuda9tile_passIdEEvNS0_13PassArgumentsIT_EE": (178, 0)},
    "node_update": {
        f"_ZN7breccia4cuda{ANONYMOUS}11node_updateIfEEvNS0_13NodeArgumentsIT_EE": (46, 0),
        f"_ZN7breccia4cuda{ANONYMOUS}14collect_sharedIfEEvNS0_8GridViewIT_EEPKjjPS4_": (30, 0),
    },
    "lone_pass": {"_ZN7breccia4cuda9lone_passIfEEvNS0_13PassArgumentsIT_EE": (79, 0)},
    "observe_kernels": {"_ZN7breccia4cuda11probe_tilesIdEEvNS0_14ProbeArgumentsIT_EE": (124, 48)},
}


def load():
    sys.dont_write_bytecode = True
    loader = importlib.machinery.SourceFileLoader("gpu_report", str(TOOL))
    report = importlib.util.module_from_spec(importlib.util.spec_from_loader("gpu_report", loader))
    loader.exec_module(report)
    return report


REPORT = load()


def said(kernels, arch):
    return "ptxas info    : 0 bytes gmem\n" + "".join(
        SAID.format(name=name, arch=arch, registers=registers, stack=stack, stores=stack, loads=stack)
        for name, (registers, stack) in kernels.items()
    )


def run(changed=None):
    """The tool with an nvcc that repeats; `changed` takes the place of what it says of a file."""
    kernels = KERNELS | {"tree_sums": {f"_Z{len(name)}{name}v": (32, 0) for name in REPORT.WINDOW}} | (changed or {})
    with tempfile.TemporaryDirectory() as folder:
        for name in {source.stem for source in REPORT.SOURCES}:
            (Path(folder) / f"{name}.said").write_text(said(kernels.get(name, {}), "sm_90"))
        nvcc = Path(folder) / "nvcc"
        nvcc.write_text(f'#!/bin/bash\ncat "{folder}/$(basename "${{!#}}" .cu).said" >&2\n')
        nvcc.chmod(0o755)
        files = [Path(folder) / "kernels.json", Path(folder) / "cards.json"]
        process = subprocess.run(
            [sys.executable, TOOL, "--arch", "90", "--json", files[0], "--cards", files[1]],
            env=os.environ | {"PATH": f"{folder}:{os.environ['PATH']}"}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        return process, *(json.loads(file.read_text()) if file.exists() else None for file in files)


class GpuReport(unittest.TestCase):
    def test_tables_and_files(self):
        process, kernels, cards = run()
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        (tile,) = [k for k in kernels if k["kernel"] == "tile_pass<float>"]
        for key in ("arch", "hot", "registers", "shared_bytes", "stack_bytes", "spill_stores", "spill_loads", "bytes_per_particle"):
            self.assertIn(key, tile)
        self.assertEqual((tile["registers"], tile["arch"], tile["hot"]), (128, "sm_90", True))
        self.assertEqual(tile["occupancy"], 0.25)
        (line,) = [line for line in process.stdout.splitlines() if line.startswith("tile_pass<float>")]
        self.assertEqual(line.split()[-2:], [f"{tile['bytes_per_particle']:.0f}", str(tile["operations_per_particle"])])
        self.assertGreater(tile["bytes_per_particle"], 200)
        self.assertGreater(tile["operations_per_particle"], 1000)
        # Bytes of a step are those of its kernels.
        node = [k for k in kernels if k["kernel"] == "node_update<float>"][0]["bytes_per_particle"]
        (card,) = [c for c in cards if (c["card"], c["precision"]) == ("H100 SXM", "mixed")]
        self.assertAlmostEqual(card["bytes_per_particle_step"], tile["bytes_per_particle"] + node, delta=0.1)
        self.assertAlmostEqual(card["particle_steps_per_second"] * card["bytes_per_particle_step"] / 3.35e12, 1, delta=1e-3)
        self.assertIn("H100 SXM", process.stdout)
        # A cold kernel may have a stack; it is named.
        self.assertIn("stack or spills in probe_tiles<double>", process.stdout)

    def test_spill_of_a_hot_kernel(self):
        name = next(iter(KERNELS["tile_pass_mixed"]))
        process, _, _ = run({"tile_pass_mixed": {name: (128, 8)}})
        self.assertEqual(process.returncode, 1)
        self.assertRegex(process.stderr, r"^gpu-report: tile_pass<float> on sm_90 has 8 bytes of stack and 8 \+ 8 of spills; .*\n$")

    def test_hot_kernel_that_is_gone(self):
        process, _, _ = run({"lone_pass": {}})
        self.assertEqual(process.returncode, 1)
        self.assertIn("no kernel lone_pass in src/cuda", process.stderr)

    def test_bounds_of_a_step(self):
        with tempfile.TemporaryDirectory() as folder:
            counted = REPORT.costs(folder)
        rows = REPORT.rooflines(counted)
        hot = [{"kernel": name, "hot": True, "arch": "sm_90", "stack_bytes": 0, "spill_stores": 0, "spill_loads": 0}
               for name in REPORT.HOT + REPORT.WINDOW]  # fmt: skip
        self.assertEqual(REPORT.faults(hot, rows), [])
        # 281 bytes, of which 216 are the particle's own; arithmetic that takes an H100 longer than its memory.
        counted["float"]["tile_bytes_particle"] *= 1.15
        (line,) = REPORT.faults(hot, REPORT.rooflines(counted))
        self.assertRegex(line, "moves 3.* bytes a particle; 300 at most")
        counted["float"]["tile_bytes_particle"] /= 1.15
        counted["float"]["operations"] = 20000
        (line,) = REPORT.faults(hot, REPORT.rooflines(counted))
        self.assertRegex(line, "3.4e.09 particle-steps/s at best in mixed precision; 4e.09 at least")

    def test_compiler_that_fails(self):
        with tempfile.TemporaryDirectory() as folder:
            nvcc = Path(folder) / "nvcc"
            nvcc.write_text("#!/bin/bash\necho 'no such option' >&2\nexit 1\n")
            nvcc.chmod(0o755)
            process = subprocess.run([sys.executable, TOOL], env=os.environ | {"PATH": f"{folder}:{os.environ['PATH']}"},
                                     capture_output=True, text=True, check=False)  # fmt: skip
        self.assertEqual((process.returncode, process.stdout), (2, ""))
        self.assertIn("gpu-report: nvcc failed:\nno such option", process.stderr)


if __name__ == "__main__":
    unittest.main()
