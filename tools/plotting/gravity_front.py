#!/usr/bin/env python3
"""Time against error of the gravity methods, as tools/bench gravity --json FILE measured them.

Usage: gravity_front.py RESULTS.json PICTURE.png
"""

import json
import pathlib
import sys

if __package__ in (None, ""):
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))

from plotting.project_python import ensure_packages  # noqa: E402

ensure_packages("matplotlib")

import matplotlib  # noqa: E402

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

STATES = {"a": "two spheres", "b": "body and debris to 2e4 km", "c": "fragments and debris",
          "n": "body and debris to 1e3 km", "f": "body and debris to 4e4 km"}
STYLES = {"tree": ("#2f6fb0", "o"), "treepm": ("#c2622d", "s"), "auto": ("#444444", "*")}


def draw_panel(axes, rows):
    for method, (colour, marker) in STYLES.items():
        mine = sorted((row for row in rows if row["method"] == method), key=lambda row: row["rms"])
        if not mine:
            continue
        seconds = [1e3 * row["seconds"] for row in mine]
        axes.plot([row["rms"] for row in mine], seconds, color=colour, marker=marker, label=f"{method}, rms")
        if method != "auto":
            axes.plot([row["p99"] for row in mine], seconds, color=colour, marker=marker, markerfacecolor="none",
                      linestyle=":", label=f"{method}, 99 %")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(which="both", alpha=0.2)
    direct = 1e3 * min(row["direct_seconds"] for row in rows)
    first = rows[0]
    axes.set_title(f"{first['state']}: {STATES.get(first['state'], '')}\n{first['particles']:,} particles; "
                   f"direct sum {direct:,.0f} ms", fontsize=9)


def draw(results, picture):
    panels = {}
    for row in results:
        panels.setdefault((row["particles"], row["state"]), []).append(row)
    sizes = sorted({size for size, _ in panels})
    states = sorted({state for _, state in panels})
    figure, grid = plt.subplots(len(sizes), len(states), squeeze=False, sharex=True, sharey="row",
                                figsize=(3.6 * len(states) + 0.6, 3.4 * len(sizes) + 0.4), layout="constrained")
    for row, size in zip(grid, sizes):
        for axes, state in zip(row, states):
            if (size, state) in panels:
                draw_panel(axes, panels[size, state])
        row[0].set_ylabel("time of an evaluation [ms]")
    for axes in grid[-1]:
        axes.set_xlabel("|da|/|a|")
    grid[0][0].legend(fontsize=8)
    figure.savefig(picture, dpi=130)


def main():
    if len(sys.argv) != 3:
        print(__doc__.strip().splitlines()[-1], file=sys.stderr)
        return 2
    try:
        draw(json.loads(pathlib.Path(sys.argv[1]).read_text()), sys.argv[2])
    except (OSError, ValueError, KeyError) as error:
        print(f"error: {sys.argv[1]}: {error}", file=sys.stderr)
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main())
