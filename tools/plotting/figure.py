"""The figure: a row of two views per snapshot, with scale bar, time and the meaning of the colours."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib import patheffects  # noqa: E402
from matplotlib.colors import LogNorm, Normalize, to_rgb  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

from . import clumps, render  # noqa: E402

# Told apart also by readers with colour-blindness: sand, blue, then the rest of Okabe and Ito's set, softened.
BODY_COLOURS = ["#e3bf8c", "#6fa8d6", "#7fc4a4", "#d98b6a", "#c79ac0", "#e6d96a"]
PIXELS = 900
PANEL_INCHES = 4.6
X, Y, Z = np.eye(3)
VIEWS = [("x", "y", X, Y), ("x", "z", X, Z)]


class Style:
    """Colours of everything but the particles."""

    def __init__(self, light):
        self.background = to_rgb("#ffffff" if light else "#0c0f16")
        self.text = "#1d2330" if light else "#e8eaf0"
        self.faint = "#6a7285" if light else "#8d96aa"
        # Keeps letters legible where particles lie behind them.
        self.halo = [patheffects.withStroke(linewidth=3.0, foreground=self.background)]


def time_text(seconds):
    """Time in the unit people would say it in."""
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if abs(seconds) >= 2 * size:
            return f"{seconds / size:.4g} {unit}"
    return f"{seconds:.4g} s"


def length_text(metres):
    return f"{metres / 1000:g} km" if metres >= 1000 else f"{metres:g} m"


def scale_bar_length(width):
    """The longest round length (1, 2 or 5 times a power of ten) below a third of the width [m]."""
    power = 10.0 ** np.floor(np.log10(width / 3))
    return max(f * power for f in (1, 2, 5) if f * power <= width / 3)


class Colouring:
    """Colours of the particles of all snapshots by body number or by a field, on one common scale."""

    def __init__(self, snapshots, name):
        self.name = name
        self.contrast = 1.0 if name == "body" else 0.6
        if name == "body":
            return
        all_values = [snapshot.values(name) for snapshot in snapshots]
        self.unit = all_values[0][1]
        finite = np.concatenate([values[np.isfinite(values)] for values, _ in all_values])
        self.norm = self._norm(finite)
        self.map = matplotlib.colormaps["magma"]

    def _norm(self, values):
        if self.name == "Damage":
            return Normalize(0.0, 1.0)
        low, high = np.percentile(values, [1, 99.5]) if len(values) else (0.0, 1.0)
        if low > 0 and high > 100 * low:
            return LogNorm(low, high)
        return Normalize(low, high if high > low else low + 1.0)

    def __call__(self, snapshot):
        if self.name == "body":
            palette = np.array([to_rgb(colour) for colour in BODY_COLOURS])
            return palette[snapshot.body % len(palette)]
        values, _ = snapshot.values(self.name)
        # The dark end of the map would vanish in the shadows: it starts a little above black.
        return self.map(0.12 + 0.88 * np.clip(self.norm(values), 0.0, 1.0))[:, :3]

    def explain(self, figure, snapshots, style, area):
        """Legend or colour bar in `area` (left, bottom, width, height) of the figure."""
        axes = figure.add_axes(area)
        axes.set_axis_off()
        if self.name == "body":
            self._legend(axes, snapshots, style)
            return
        # The bar shows the colours as they are used, from where the map starts.
        used = matplotlib.colors.ListedColormap(self.map(np.linspace(0.12, 1.0, 256)))
        bar_axes = axes.inset_axes([0.0, 0.55, 1.0, 0.25])
        bar = figure.colorbar(matplotlib.cm.ScalarMappable(self.norm, used), cax=bar_axes, orientation="horizontal")
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        bar.set_label(f"{self.name}{unit}", color=style.text, fontsize=9)
        bar.ax.tick_params(colors=style.faint, labelsize=8, length=3)
        bar.outline.set_visible(False)

    @staticmethod
    def _legend(axes, snapshots, style):
        names = max((snapshot.body_names for snapshot in snapshots), key=len)
        bodies = sorted({int(b) for snapshot in snapshots for b in np.unique(snapshot.body)})[: len(BODY_COLOURS)]
        labels = [names[b] if b < len(names) and names[b] else f"body {b + 1}" for b in bodies]
        patches = [Patch(color=BODY_COLOURS[b % len(BODY_COLOURS)], label=label) for b, label in zip(bodies, labels)]
        axes.legend(handles=patches, loc="center right", ncols=3, frameon=False, labelcolor=style.text, fontsize=9,
                    handlelength=1.0, handleheight=1.0, columnspacing=1.4, borderaxespad=0.0)


def _frame(snapshot, link_cells, show_all):
    """Centre and half width [m] of the picture, and the spacing of the particles [m]."""
    spacing = clumps.mean_spacing(snapshot.position)
    length = link_cells * (snapshot.cell if snapshot.cell > 0 else 2.0 * spacing)
    chosen = snapshot.position if show_all else snapshot.position[clumps.largest(snapshot.position, length)]
    if show_all:
        low, high, margin = chosen.min(axis=0), chosen.max(axis=0), 1.1
    else:
        # Without the outermost particles: one thrown far out but still linked would make everything else small.
        (low, high), margin = np.percentile(chosen, [1.0, 99.0], axis=0), 1.4
    return (low + high) / 2, 0.5 * margin * float((high - low).max()) + spacing, spacing


def _draw_panel(axes, snapshot, frame, view_axes, colours, contrast, style):
    centre, half, spacing = frame
    right_name, up_name, right, up = view_axes
    view = render.View(centre, right, up, half)
    radius = 0.62 * spacing
    front = render.surface(view, snapshot.position, radius, PIXELS)
    grain = radius * PIXELS / (2 * half)
    axes.imshow(render.picture(front, colours, grain, style.background, contrast), extent=(-half, half, -half, half),
                interpolation="bilinear")
    axes.set_axis_off()
    _draw_axes_cross(axes, right_name, up_name, half, style)


def _draw_axes_cross(axes, right_name, up_name, half, style):
    origin, arm = -0.93 * half, 0.13 * half
    arrow = {"arrowstyle": "-|>", "color": style.faint, "lw": 1.0, "shrinkA": 0, "shrinkB": 0}
    for dx, dy, name in ((arm, 0, right_name), (0, arm, up_name)):
        axes.annotate("", (origin + dx, origin + dy), (origin, origin), arrowprops=arrow)
        axes.text(origin + 1.3 * dx, origin + 1.3 * dy, name, color=style.faint, fontsize=9, ha="center", va="center",
                  path_effects=style.halo)


def _draw_scale_bar(axes, half, style):
    length = scale_bar_length(2 * half)
    right, height = 0.93 * half, -0.93 * half
    axes.plot([right - length, right], [height, height], color=style.text, lw=2.2, solid_capstyle="butt",
              path_effects=[patheffects.withStroke(linewidth=4.5, foreground=style.background)])
    axes.text(right - length / 2, height + 0.03 * half, length_text(length), color=style.text, fontsize=10,
              ha="center", va="bottom", path_effects=style.halo)


def draw(snapshots, out, colour="body", show_all=False, link_cells=3.0, light=False):
    """Writes the picture `out` of the snapshots (in the order given, one row each)."""
    style = Style(light)
    colouring = Colouring(snapshots, colour)
    rows, top, gap = len(snapshots), 0.62, 0.06
    width, height = 2 * PANEL_INCHES + gap, rows * (PANEL_INCHES + gap) + top
    figure = plt.figure(figsize=(width, height), facecolor=style.background)
    for row, snapshot in enumerate(snapshots):
        frame, colours = _frame(snapshot, link_cells, show_all), colouring(snapshot)
        bottom = (rows - 1 - row) * (PANEL_INCHES + gap)
        for column, view_axes in enumerate(VIEWS):
            axes = figure.add_axes([column * (PANEL_INCHES + gap) / width, bottom / height, PANEL_INCHES / width,
                                    PANEL_INCHES / height])
            _draw_panel(axes, snapshot, frame, view_axes, colours, colouring.contrast, style)
            if column == 0 and rows > 1:
                axes.text(0.03, 0.95, time_text(snapshot.time), transform=axes.transAxes, color=style.text, fontsize=11,
                          path_effects=style.halo)
        _draw_scale_bar(axes, frame[1], style)
    title = snapshots[0].scene_name or "particles"
    if rows == 1:
        title += f"   t = {time_text(snapshots[0].time)}"
    figure.text(0.15 / width, 1 - 0.5 * top / height, title, color=style.text, fontsize=13, va="center")
    colouring.explain(figure, snapshots, style, [0.56, 1 - 0.92 * top / height, 0.42, 0.84 * top / height])
    figure.savefig(out, dpi=PIXELS / PANEL_INCHES, facecolor=style.background)
    plt.close(figure)
