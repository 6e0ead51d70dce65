#!/usr/bin/env python3
"""Takes the place of breccia, breccia_bench and test_cuda_device in a build folder: right, or wrong as FAKE says.

FAKE holds NAME=HOW, separated by spaces. The test reads tools/gpu-check by what it makes of that.
"""

import json
import os
import sys
import time
from pathlib import Path

FAKE = dict(word.split("=") for word in os.environ.get("FAKE", "").split())
ROW = {"particles [1]": 6008, "kinetic_energy [J]": 1.3e22, "angular_momentum_z [kg m2/s]": 3.7e24, "internal_energy [J]": 5e16,
       "elastic_energy [J]": 2e15, "wall_seconds [s]": 0.1}  # fmt: skip


def option(name):
    return sys.argv[sys.argv.index(name) + 1]


def complain(text):
    """In one write: of several ranks each says it, and print() writes the end of the line by itself."""
    os.write(sys.stderr.fileno(), f"breccia: error: {text}\n".encode())


def misbehave(how):
    if how == "hangs":
        time.sleep(1000)
    if how == "fails":
        complain("it failed")
        sys.exit(4)
    if how == "missing":
        complain('parallel.device_messages = "nccl": libnccl.so.2: cannot open')
        sys.exit(2)


def test_cuda_device():
    misbehave(FAKE.get("tests"))
    if FAKE.get("tests") == "wrong":
        print("[  FAILED  ] Precisions/DeviceTest.DebrisEqualsHostEngine/mixed, where GetParam() = 1")
        sys.exit(1)
    if FAKE.get("tests") != "none":
        print("[       OK ] Precisions/DeviceTest.DebrisEqualsHostEngine/mixed (2 ms)")


def breccia_bench():
    misbehave(FAKE.get(sys.argv[1]))
    if sys.argv[1] == "engine":
        results = {"results": [{"precision": "mixed", "particle_steps_per_wall_second": 2e9}]}
    else:
        rms = {"wrong": 4e-4, "none": None}.get(FAKE.get("gravity"), 3e-4)
        results = [{"state": "a", "particles": int(option("--particles")), "method": "tree", "setting": "error 3.5e-04",
                    "chosen": "tree", "rms": rms, "seconds": 0.005, "phases": {"boxes": 0}}]  # fmt: skip
    Path(option("--json")).write_text(json.dumps(results))


def breccia():
    if sys.argv[1] == "info":
        print("simd      x86-64-v9 (AVX-1024): 32 floats\ndevices   host: some processor, 3 hardware threads")
        return
    ranks = int(os.environ.get("OMPI_COMM_WORLD_SIZE", "1"))
    way = "alone" if ranks == 1 else "waited" if "BRECCIA_MPI_AHEAD" in os.environ else option("--set").partition("=")[2]
    how = FAKE.get(way)
    misbehave(how)
    if os.environ.get("OMPI_COMM_WORLD_RANK", "0") != "0":
        return
    row = ROW | ({"elastic_energy [J]": 2.1e15} if how == "wrong" else {})
    out = Path(option("--out"))
    out.mkdir()
    (out / "diagnostics.csv").write_text(",".join(row) + "\n" + ",".join(map(str, row.values())) + "\n")
    (out / "summary.json").write_text('{"wall_seconds": 0.1}')
    if ranks > 1:
        print(f"messages between devices: {way}")


{"test_cuda_device": test_cuda_device, "breccia_bench": breccia_bench, "breccia": breccia}[Path(sys.argv[0]).name]()
