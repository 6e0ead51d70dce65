"""Runs against the model, and what the model says of larger machines, as lines of text and as numbers."""

from . import model, series

NOT_ENGINE = ("gravity", "output", "checkpoint", "balance", "time step")
# Parts of gravity that grow with the mesh, not with the particles.
MESH_PARTS = ("transform", "boxes")


def stage_seconds(run):
    """Engine, near field and mesh seconds of a step, from the stage timers."""
    stages = run["stages"]
    engine = sum(s for name, s in stages.items() if name not in NOT_ENGINE and ":" not in name)
    gravity = stages.get("gravity", 0.0)
    mesh = sum(s for name, s in stages.items() if name.startswith("gravity: ") and name[9:].startswith(MESH_PARTS))
    return engine, gravity - mesh, mesh


def evaluations(run):
    gravity = run["gravity"]
    return sum(gravity["evaluations"].values()) if gravity else 0


def fitted(run, network):
    """The machine that one run on one rank tells of."""
    engine, near, mesh = stage_seconds(run)
    count = max(1, evaluations(run)) / run["steps"]
    return model.fit([{"particles": run["particles"], "per_cell": series.PER_CELL, "engine": engine,
                       "gravity_near": near / count, "gravity_mesh": mesh / count}], network)


def against_model(runs, network):
    """The model fitted to the run on one rank and to the network alone, and what it says of each run."""
    machine = fitted(runs[0], network)
    rows = []
    for run in runs:
        share = evaluations(run) / run["steps"]
        case = model.Case(run["particles"], series.PER_CELL, interval=round(1 / share) if share else 0)
        said = model.step(case, machine, run["ranks"])
        rows.append({"ranks": run["ranks"], "particles": run["particles"],
                     "measured": sum(stage_seconds(run)), "predicted": said.total,
                     "measured_halo_bytes": run["halo_bytes_of_first_step"], "predicted_halo_bytes": said.halo_bytes})
    return {"machine": machine.__dict__, "rows": rows}


def comparison(found):
    machine = found["machine"]
    lines = ["", f"model: {1e9 * machine['particle']:.1f} ns a particle and step, "
                 f"{1e9 * machine['gravity_particle']:.0f} ns a particle and {1e9 * machine['gravity_node']:.1f} ns a mesh "
                 f"node and evaluation, {1e6 * machine['latency']:.1f} us a message, "
                 f"{1e-9 * machine['bandwidth']:.2f} GB/s",
             f"{'ranks':>5} {'ms/step':>9} {'model':>9} {'ratio':>6} {'halo kB':>9} {'model':>9} {'ratio':>6}"]
    for r in found["rows"]:
        bytes_ratio = r["measured_halo_bytes"] / r["predicted_halo_bytes"] if r["predicted_halo_bytes"] else 1.0
        lines.append(f"{r['ranks']:>5} {1e3 * r['measured']:>9.3f} {1e3 * r['predicted']:>9.3f} "
                     f"{r['measured'] / r['predicted']:>6.2f} {1e-3 * r['measured_halo_bytes']:>9.1f} "
                     f"{1e-3 * r['predicted_halo_bytes']:>9.1f} {bytes_ratio:>6.2f}")
    return lines


def predictions(machine, sizes=(1e6, 1e8, 1e9), most=1024):
    """A table of the model: milliseconds a step and efficiency over the fewest ranks that hold the particles."""
    lines = [f"{machine.name}: ms a step (efficiency over the first column's ranks; slabs that have work)",
             f"{'ranks':>6}" + "".join(f"{f'{n:.0e} particles':>26}" for n in sizes)]
    first = {n: model.step(model.Case(n), machine, 1).total for n in sizes}
    ranks = 1
    while ranks <= most:
        row = f"{ranks:>6}"
        for n in sizes:
            said = model.step(model.Case(n), machine, ranks)
            row += f"{1e3 * said.total:>12.3f} ({first[n] / said.total / ranks:>4.2f};{said.busy_ranks:>5})"
        lines.append(row)
        ranks *= 2
    return lines
