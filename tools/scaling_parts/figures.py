"""The picture of a series: speed-up, efficiency, where the time of a step goes, bytes of the halo against the model."""

from plotting.project_python import ensure_packages

ensure_packages("matplotlib", "numpy")

import matplotlib  # noqa: E402

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

from . import series  # noqa: E402

STAGES = ("g2p, stress, p2g", "g2p", "stress, p2g", "grid", "sort", "gravity", "balance")


def draw(results, path):
    runs = results["runs"]
    ranks = [r["ranks"] for r in runs]
    first = runs[0]
    speed = [series.speed_up(first, r) for r in runs]
    figure, ((left, right), (below, bytes_axes)) = plt.subplots(2, 2, figsize=(10, 7.5), constrained_layout=True)
    left.plot(ranks, [r / ranks[0] for r in ranks], "--", color="0.6", label="ideal")
    left.plot(ranks, speed, "o-", label="measured")
    right.plot(ranks, [s * ranks[0] / r for s, r in zip(speed, ranks)], "o-", label="measured")
    right.axhline(1.0, color="0.6", ls="--")
    right.set_ylim(0, 1.2)
    if "model" in results:
        rows = results["model"]["rows"]
        said = [rows[0]["predicted"] / r["predicted"] * r["particles"] / rows[0]["particles"] for r in rows]
        left.plot(ranks, said, "x:", label="model")
        right.plot(ranks, [s * ranks[0] / r for s, r in zip(said, ranks)], "x:", label="model")
        bytes_axes.plot(ranks, [1e-3 * r["predicted_halo_bytes"] for r in rows], "x:", label="model")
    bottom = [0.0] * len(runs)
    for stage in STAGES:
        height = [1e3 * r["stages"].get(stage, 0.0) for r in runs]
        below.bar([str(r) for r in ranks], height, bottom=bottom, label=stage)
        bottom = [b + h for b, h in zip(bottom, height)]
    bytes_axes.plot(ranks, [1e-3 * r["halo_bytes_of_first_step"] for r in runs], "o-", label="measured")
    for axes, what in ((left, "speed-up"), (right, "efficiency"), (bytes_axes, "halo sent by a rank [kB a step]")):
        axes.set_xscale("log", base=2)
        axes.set_xticks(ranks, [str(r) for r in ranks])
        axes.set_ylabel(what)
    left.set_yscale("log", base=2)
    below.set_ylabel("first rank, by stage [ms a step]")
    for axes in (left, right, below, bytes_axes):
        axes.set_xlabel("ranks")
        axes.legend(fontsize=8)
    figure.suptitle(f"{results['kind']} scaling, {first['particles']} particles on {ranks[0]} rank(s)")
    figure.savefig(path, dpi=110)
    plt.close(figure)
