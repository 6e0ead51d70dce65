"""Runs of a series: the flagship impact with a number of particles on a number of ranks, best of several."""

import json
import resource
import subprocess
import tempfile
from pathlib import Path

from . import batch

ROOT = Path(__file__).resolve().parents[2]
PER_CELL = 1.412  # particles in a cell, as in the paper's baseline

SCENE = """\
[scene]
name = "scaling"
end = "1e6 s"
[grid]
cell = "{cell!r} m"
[time]
step = "{step!r} s"
[[body]]
shape = "sphere"
radius = "50 km"
particles = {each}
[[body]]
shape = "sphere"
radius = "50 km"
particles = {each}
[impact]
velocity = "200 m/s"
angle = "15 deg"
separation = "101 km"
[effects]
gravity = "{gravity}"
[output]
checkpoint_wall = "off"
"""


def scene(particles, gravity):
    """The flagship impact at contact with this many particles: cell and step follow (physics.md 6)."""
    each = particles // 2
    volume = 4.0 / 3.0 * 3.141592653589793 * 50e3**3
    cell = (PER_CELL * volume / each) ** (1.0 / 3.0)
    return SCENE.format(cell=cell, step=1e5 / 819200 * cell / 2500.0, each=each, gravity=gravity)


def user_seconds():
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


def reduce(summary, user):
    """What the tables, the pictures and the model need of a run's summary.json."""
    steps = summary["steps"]
    return {
        "ranks": summary["ranks"],
        "threads": summary["threads"],
        "device": summary["device"],
        "particles": summary["particles"],
        "steps": steps,
        "seconds_per_step": summary["wall_seconds"] / steps,
        "user_seconds_of_all_ranks": user,
        "stages": {s["stage"]: s["seconds"] / steps for s in summary["stages"]},
        "gravity": summary["gravity"],
        "slabs": summary["slabs"],
        "machine": summary["machine"],
    }


def run_once(options, particles, ranks, folder, steps):
    """One run; None if it failed, which is said."""
    out = folder / f"{particles}_{ranks}"
    toml = folder / f"{particles}.toml"
    toml.write_text(scene(particles, options.gravity))
    program = [str(options.program), "run", str(toml), "--out", str(out), "--steps", str(steps),
               "--device", options.device]
    for setting in options.set:
        program += ["--set", setting]
    before = user_seconds()
    done = subprocess.run(batch.command(options.launcher, ranks, program), env=options.environment, check=False,
                          capture_output=True, text=True)
    user = user_seconds() - before
    if done.returncode:
        print(f"{ranks} ranks, {particles} particles: exit code {done.returncode}: {done.stderr.strip()[-400:]}")
        return None
    result = reduce(json.loads((out / "summary.json").read_text()), user)
    subprocess.run(["rm", "-r", str(out)], check=True)
    return result


def run(options, kind):
    """The runs of a strong or weak series, best of `repeats` by wall time; in turns, so that other load meets all."""
    best = {}
    with tempfile.TemporaryDirectory(prefix="breccia_scaling_", dir=options.scratch) as scratch:
        for _ in range(options.repeats):
            for ranks in options.ranks:
                particles = options.particles * (ranks if kind == "weak" else 1)
                found = run_once(options, particles, ranks, Path(scratch), options.steps)
                if found is None:
                    continue
                before = best.get(ranks)
                if before is None or found["seconds_per_step"] < before["seconds_per_step"]:
                    least = found["user_seconds_of_all_ranks"] if before is None else min(
                        found["user_seconds_of_all_ranks"], before["user_seconds_of_all_ranks"])
                    best[ranks] = {**found, "user_seconds_of_all_ranks": least}
        for ranks, found in best.items():
            # summary.json has those of the last step, when the bodies have come closer, or touch.
            first = run_once(options, found["particles"], ranks, Path(scratch), 1)
            found["halo_bytes_of_first_step"] = first["slabs"]["halo_bytes_max"] if first else 0
    return [best[r] for r in sorted(best)]


def measure_network(options):
    """Latency [s] and bandwidth [B/s] between two ranks, by breccia_bench messages."""
    program = [str(options.program.with_name("breccia_bench")), "messages", "--json", "-"]
    done = subprocess.run(batch.command(options.launcher, 2, program), env=options.environment, check=True,
                          capture_output=True, text=True)
    found = json.loads(done.stdout[done.stdout.index("{"):])
    return found["latency"], found["bandwidth"]


def speed_up(first, run):
    """How much more a run does in a second than the first one."""
    return first["seconds_per_step"] / run["seconds_per_step"] * run["particles"] / first["particles"]


def table(runs, kind):
    """Lines of text: speed-up and efficiency over the run on the fewest ranks."""
    first = runs[0]
    lines = [f"{'ranks':>5} {'particles':>10} {'ms/step':>9} {'speed-up':>8} {'efficiency':>10} {'CPU ratio':>9} "
             f"{'imbalance':>9} {'halo kB/step':>12}"]
    for r in runs:
        more = r["particles"] / first["particles"]
        speed = speed_up(first, r)
        efficiency = speed * first["ranks"] / r["ranks"]
        cpu = r["user_seconds_of_all_ranks"] / first["user_seconds_of_all_ranks"] / more
        slabs = r["slabs"]
        lines.append(f"{r['ranks']:>5} {r['particles']:>10} {1e3 * r['seconds_per_step']:>9.3f} {speed:>8.2f} "
                     f"{efficiency:>10.2f} {cpu:>9.3f} {slabs['imbalance_mean']:>9.3f} "
                     f"{1e-3 * r['halo_bytes_of_first_step']:>12.1f}")
    return [f"{kind} scaling"] + lines
