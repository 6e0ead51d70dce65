"""The stages of tools/gpu-check. Each fills in its results as they come, prints them, and returns what failed.

A stage raises Unfinished where a program that is no check itself fails; what it has found by then stays.
"""

import csv
import json
import os
import re
import tempfile
from pathlib import Path
from typing import NamedTuple

from .cards import rooflines
from .machine import Device
from .programs import ROOT, Programs, Unfinished


class Context(NamedTuple):
    programs: Programs
    folder: Path  # of what was built
    device: Device
    emulated: bool
    environment: dict


def compare_with_host(context, results):
    """tests/cuda/device_test.cpp: the engine on the device against that of the host."""
    steps = 20 if context.emulated else 200
    ended = context.programs.run([context.folder / "tests/test_cuda_device"], 240,
                                 context.environment | {"BRECCIA_DEVICE_STEPS": str(steps)})  # fmt: skip
    passed = len(re.findall(r"^\[       OK \]", ended.out, re.M))
    failed = sorted(set(re.findall(r"^\[  FAILED  \] (\S+?)(?:,|$)", ended.out, re.M)))
    if ended.failure:
        print(ended.out[-4000:], ended.errors[-4000:], sep="\n")
        failed = failed or [f"(the program {ended.failure})"]
    elif not passed:
        failed = ["(no test ran)"]
    results.update(steps=steps, passed=passed, failed=failed)
    print(f"{context.device.name}: {passed} tests of {steps} steps passed, {len(failed)} failed")
    for test in failed:
        print(f"  FAILED {test}")
    return failed


def bench(context, *options, seconds=120):
    """Results of breccia_bench."""
    with tempfile.TemporaryDirectory() as temporary:
        file = Path(temporary) / "bench.json"
        ended = context.programs.run([context.folder / "breccia_bench", *options, "--json", file], seconds, context.environment)
        if ended.failure:
            raise Unfinished(f"breccia_bench {options[0]} {ended.failure}: {ended.errors.strip()}")
        return json.loads(file.read_text(encoding="utf-8"))


def engine_rates(context, where, case, seconds):
    """Particle-steps/s of wall time by precision."""
    results = bench(context, "engine", "--device", where, "--case", case, "--seconds", str(seconds), "--cores", "1")["results"]
    return {r["precision"]: r["particle_steps_per_wall_second"] for r in results}


def measure_engine(context, results):
    # The paper's spheres, debris, and what fills a device; the emulated one is some thousand times slower.
    cases, seconds = (["cell8_1e4"], 0) if context.emulated else (["paper", "debris", "cell8_1e6"], 2)
    best, why_none = rooflines(context.device.name)
    if why_none:
        print(why_none)
    print(f"{'case':<10} {'precision':<10} {'M particle-steps/s':>19} {'host, 1 core':>13} {'roofline':>9} {'share':>6}")
    for case in cases:
        on_device = engine_rates(context, "cuda", case, seconds)
        on_host = engine_rates(context, "host", case, seconds)
        for precision, rate in on_device.items():
            results.append({"case": case, "precision": precision, "device": rate, "host": on_host.get(precision),
                            "roofline": best.get(precision)})  # fmt: skip
            print_rate(results[-1])
    return []


def print_rate(r):
    best = f"{1e-6 * r['roofline']:.0f}" if r["roofline"] else ""
    share = f"{100 * r['device'] / r['roofline']:.0f} %" if r["roofline"] else ""
    host = f"{1e-6 * r['host']:.1f}" if r["host"] else ""
    print(f"{r['case']:<10} {r['precision']:<10} {1e-6 * r['device']:>19.3f} {host:>13} {best:>9} {share:>6}")


def allowed_error(row):
    """The rms error that an evaluation may have, of the direct sums of 10,000 particles in double precision.

    A tree or a mesh may have the error that was asked for (by default 3.5e-4): the host's are 0.26 to 0.85 of it in these
    states (docs/performance.md), and the tests hold the device to 3e-6 of the host. All pairs in mixed precision have the
    rounding of floats, below 3e-6 in the tests; a tile of 128 sources left out of a million would be 1e-4.
    """
    if row["chosen"] == "direct":
        return 1e-5
    asked = re.search(r"error (\S+)", row["setting"])
    return float(asked[1]) if asked else 3.5e-4


def measure_gravity(context, results):
    """Milliseconds of evaluations of gravity on the device, of them the choice of boxes, and whether the field is right."""
    numbers, states, methods = ([1200], "a", ["auto"]) if context.emulated else (
        [94648, 1000000], "ab", ["direct", "tree", "treepm", "auto"])  # fmt: skip
    print(f"{'gravity':<10} {'particles':>9} {'setting':<14} {'ms':>8} {'boxes':>8} {'rms':>8} {'allowed':>8}")
    failed = []
    for particles in numbers:
        rows = bench(context, "gravity", "--device", "cuda", "--states", states, "--particles", str(particles), "--methods",
                     *methods, "--threads", str(os.cpu_count()))  # fmt: skip
        if not rows:
            failed.append(f"no evaluation of {particles} particles")
        for r in rows:
            keys = ("state", "particles", "method", "setting", "chosen", "rms")
            results.append({key: r[key] for key in keys} | {"ms": 1e3 * r["seconds"], "boxes_ms": 1e3 * r["phases"]["boxes"],
                                                            "allowed": allowed_error(r)})  # fmt: skip
            failed += judge_field(results[-1])
    return failed


def judge_field(g):
    # What is no number is null in JSON.
    right = g["rms"] is not None and g["rms"] <= g["allowed"]
    rms = "none" if g["rms"] is None else f"{g['rms']:.1e}"
    print(f"{g['state']} {g['method']:<8} {g['particles']:>9} {g['setting']:<14} {g['ms']:>8.2f} {g['boxes_ms']:>8.2f} "
          f"{rms:>8} {g['allowed']:>8.1e}{'' if right else '  FAILED'}")  # fmt: skip
    what = f"{g['method']} ({g['setting']}) of {g['particles']} particles, state {g['state']}"
    return [] if right else [f"{what}: rms error {rms}, allowed {g['allowed']:.1e}"]


def reason(ended):
    """Why a run failed, among what mpirun says."""
    lines = [line for line in ended.errors.splitlines() if line.startswith("breccia: error:")]
    return lines[0] if lines else f"the run {ended.failure}: {(ended.errors.strip() or 'no reason was given').splitlines()[0]}"


def is_missing(failed):
    """Whether a run by NCCL failed for want of the library (src/cuda/halo_messages.cpp): an installation, no fault."""
    return 'parallel.device_messages = "nccl":' in failed


class Way(NamedTuple):
    """How ranks exchange messages."""

    what: str
    ranks: int
    messages: str = "mpi"
    environment: dict = {}


ALONE = Way("1 rank", 1)
BY_MPI = {"mpi": Way("MPI", 2), "waited": Way("MPI, waited for", 2, environment={"BRECCIA_MPI_AHEAD": "0"})}
BY_NCCL = {"nccl": Way("NCCL", 2, "nccl")}


def collide(context, out, way, steps):
    """What carried messages, ms of wall time a step, last row of diagnostics; or why there is none."""
    command = [context.folder / "breccia", "run", ROOT / "scenes/impact-200-15-coarse.toml", "--device", "cuda", "--out", out,
               "--steps", str(steps), "--set", f"parallel.device_messages={way.messages}"]  # fmt: skip
    mpirun = ["bash", "-c", f'. tools/mpi-environment; exec mpirun -n {way.ranks} "$@"', "mpirun", *command]
    ended = context.programs.run(mpirun, 60, context.environment | way.environment)
    if ended.failure:
        return {"failed": reason(ended)}
    with open(out / "diagnostics.csv", newline="", encoding="utf-8") as file:
        last = list(csv.DictReader(file))[-1]
    said = re.search(r"^messages between devices: (.*)$", ended.out, re.M)
    return {
        "way": said[1] if said else "none",
        "ms_a_step": 1e3 * json.loads((out / "summary.json").read_text(encoding="utf-8"))["wall_seconds"] / steps,
        "row": {name: value for name, value in last.items() if not name.startswith("wall")},
    }


# What two ranks may differ by from one, relatively: sums are added in another order, and what rounding leaves grows in
# the contact. On the host it is 1e-7, 1e-7, 3e-6, 2e-5 after 400 steps in mixed precision.
ALIKE = {"particles [1]": 0, "kinetic_energy [J]": 1e-5, "angular_momentum_z [kg m2/s]": 1e-5, "internal_energy [J]": 1e-3,
         "elastic_energy [J]": 1e-3}  # fmt: skip


def unlike(row, alone):
    """Columns in which a run on two ranks is not that of one."""
    return [name for name, allowed in ALIKE.items()
            if not abs(float(row[name]) - float(alone[name])) <= allowed * abs(float(alone[name]))]  # fmt: skip


def collide_on_ranks(context, results):
    """The coarse flagship on one rank, then on two: by MPI ahead of the host and waited for in every step, and where each
    has a device by NCCL, all with the same bits."""
    shared = context.device.count < 2
    # Whole windows: the wait for the rest of one would be booked with the output, which wall_seconds leaves out.
    steps = 2 if context.emulated else 13 * 32
    ways = {"alone": ALONE} | BY_MPI | ({} if shared else BY_NCCL)
    results.update(steps=steps, devices=min(context.device.count, 2), same=None)
    rows = {}
    with tempfile.TemporaryDirectory() as out:
        for name, way in ways.items():
            run = results[name] = collide(context, Path(out) / name, way, steps)
            rows[name] = run.pop("row", None)
            where = way.what if way is ALONE else f"2 ranks on {'one device' if shared else '2 devices'}, {way.what}"
            print(f"{where}: " + (run.get("failed") or f"{run['ms_a_step']:.2f} ms a step (messages: {run['way']})"))
    failed = [f"{name}: {results[name]['failed']}" for name in ways
              if "failed" in results[name] and not (name == "nccl" and is_missing(results[name]["failed"]))]  # fmt: skip
    of_two = next((rows[name] for name in BY_MPI if rows[name]), None)
    if rows["alone"] and of_two:
        failed += [f"2 ranks differ from one in {name}: {of_two[name]}, not {rows['alone'][name]}"
                   for name in unlike(of_two, rows["alone"])]  # fmt: skip
    others = [name for name in ("waited", "nccl") if rows.get(name) and rows["mpi"]]
    different = [ways[name].what for name in others if rows[name] != rows["mpi"]]
    if others:
        results["same"] = not different
    failed += [f"results by MPI and by {what} are not the same" for what in different]
    if shared:
        print("  NCCL: not tried, it needs a device for each rank")
    for line in failed:
        print(f"  FAILED {line}")
    return failed
