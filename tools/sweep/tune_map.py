"""Draw the map of `push tune`: which gains are stable for all assumed sliders, with known gains marked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from sim_backend.physics.gain_limits import WARN_SHARE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PRESETS = {
    "paper, simulation": (0.1, 0.01),
    "paper, hardware": (0.1, 0.3),
    "journal version, hardware": (0.3, 0.5),
    "authors' rigid-body simulation": (0.3, 0.1),
    "this program's rigs": (0.3, 0.2),
}
"""Well-known gains (k_f, k_y in rad/m) marked on the map (Heins & Schoellig, both papers and their code)."""


def draw(limits: Sequence[tuple[float, float]], recommended: tuple[float, float], what: str) -> Figure:
    """Draw the map. `limits`: maximum stable k_y for each k_f. `what`: the assumed sliders in a few words."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    k_f = [point[0] for point in limits]
    k_y = [max(point[1], 0.0) for point in limits]
    top = 1.15 * max(*k_y, *(gains[1] for gains in PRESETS.values()))
    axes.fill_between(k_f, k_y, top, color="tab:red", alpha=0.15, label="oscillates or diverges for some slider")
    axes.fill_between(k_f, [WARN_SHARE * v for v in k_y], k_y, color="tab:orange", alpha=0.25, label="small margin")
    axes.fill_between(k_f, 0.0, [WARN_SHARE * v for v in k_y], color="tab:green", alpha=0.2, label="stable for all")
    for name, (f, y) in PRESETS.items():
        axes.plot(f, y, "ko", markersize=4)
        axes.annotate(f"{name} {f:g}/{y:g}", (f, y), textcoords="offset points", xytext=(6, 4), fontsize=8)
    f, y = recommended
    axes.plot(f, y, "*", color="tab:blue", markersize=13)
    axes.annotate(
        f"recommended {f:g}/{y:g}", (f, y), textcoords="offset points", xytext=(8, -14), fontsize=9, color="tab:blue"
    )
    axes.set_xlim(k_f[0], k_f[-1])
    axes.set_ylim(0.0, top)
    axes.set_xlabel("k_f")
    axes.set_ylabel("k_y (rad/m)")
    axes.set_title(what, fontsize=9)
    axes.legend(loc="upper left", fontsize=8)
    return figure
