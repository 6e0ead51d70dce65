"""Timelines of ranks: from a trace file to a picture."""

import json

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

LANES = ("stages", "tiles", "messages")
COLOURS = {
    "grid": "#8c8c8c",
    "g2p, stress, p2g": "#4f7cac",
    "boundary tiles": "#d1603d",
    "interior tiles": "#4f7cac",
    "shared nodes": "#e3b23c",
    "wait for sums": "#b01e28",
    "wait for velocities": "#b01e28",
    "sums": "#d1603d",
    "velocities": "#3d8f6a",
}
OTHER = "#a79bb8"


def read(path):
    """Bars of a trace file: list of (rank, lane, name, begin, end), times in ms."""
    with open(path, encoding="utf-8") as file:
        events = json.load(file)["traceEvents"]
    return [(e["pid"], LANES[e["tid"]], e["name"], 1e-3 * e["ts"], 1e-3 * (e["ts"] + e["dur"]))
            for e in events if e["ph"] == "X"]


def window(bars, steps):
    """First and last moment of `steps` fused steps of rank 0 in the middle, without a sorting between them if possible."""
    fused = sorted(b[3:] for b in bars if b[0] == 0 and b[2] == "g2p, stress, p2g")
    if not fused:
        raise ValueError("no step in which particles and grid go on without a stop: run more steps")
    steps = min(steps, len(fused))
    # The shortest stretch of as many steps holds no sorting, the middle one of the shorter half is a usual one.
    stretches = sorted((fused[n + steps - 1][1] - fused[n][0], n) for n in range(len(fused) - steps + 1))
    chosen = stretches[len(stretches) // 4][1]
    return fused[chosen][0], fused[chosen + steps - 1][1]


def draw(bars, path, steps, light):
    """Draws the bars of some steps: a row for each rank and lane."""
    begin, end = window(bars, steps)
    margin = 0.02 * (end - begin)
    end += 8 * margin
    ink, paper = ("black", "white") if light else ("#dddddd", "#111418")
    rows = [(rank, lane) for rank in sorted({b[0] for b in bars}) for lane in LANES]
    figure, axes = pyplot.subplots(figsize=(11, 0.5 * len(rows) + 1.3), facecolor=paper)
    axes.set_facecolor(paper)
    shown = {}
    for rank, lane, name, first, last in bars:
        if last < begin - margin or first > end:
            continue
        row = rows.index((rank, lane))
        colour = COLOURS.get(name, OTHER)
        # Nested bars are drawn smaller; a bar without length still shows.
        height = 0.45 if name == "shared nodes" or name.startswith("wait") else 0.8
        handle = axes.barh(row, max(last - first, 0.002 * (end - begin)), left=first - begin, height=height, color=colour,
                           edgecolor=paper, linewidth=0.4, zorder=3 if height < 0.8 else 2)
        shown.setdefault(name, handle)
    axes.set_xlim(-margin, end - begin)
    axes.set_yticks(range(len(rows)), [f"rank {rank}  {lane}" for rank, lane in rows], color=ink)
    axes.invert_yaxis()
    axes.set_xlabel("time [ms]", color=ink)
    axes.tick_params(colors=ink)
    for spine in axes.spines.values():
        spine.set_color(ink)
    figure.legend(shown.values(), shown.keys(), ncols=5, loc="upper center", frameon=False, labelcolor=ink, fontsize=8)
    figure.tight_layout(rect=(0, 0, 1, 0.86))
    figure.savefig(path, dpi=130, facecolor=paper)
