"""Draw the figures of a study as PNG and SVG: all trajectories, and the paper's four samples with outlines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sim_backend.physics.lanes import State, Timing
from tools.sweep.grid import Case

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

DOTS_PER_INCH = 150
SAMPLE_SECONDS = 120.0
"""Part of a sample's ten minutes that is drawn."""
OUTLINE_EVERY_S = 15.0
MOST_LINES = 1000
"""A panel with more trajectories shows an evenly spaced subset."""


def save(figure: Figure, out: Path, name: str) -> list[str]:
    """Write a figure as NAME.png and NAME.svg; the same figure gives the same bytes. Returns the file names."""
    import matplotlib as mpl

    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(out / f"{name}.png", dpi=DOTS_PER_INCH)
        figure.savefig(out / f"{name}.svg", metadata={"Date": None})
    return [f"{name}.png", f"{name}.svg"]


def trajectories(cases: Sequence[Case], states: Floats, ends: Floats, title: str) -> Figure:
    """Draw the path of every slider's centre, one panel per shape.

    `states`: (cases, records, 6), NaN after an end; `ends`: (cases, 2), the final x, y (possibly between two records).
    """
    import numpy as np

    shapes = list(dict.fromkeys(case.shape for case in cases))
    figure = _figure(7.0, 1.2 + 1.9 * len(shapes))
    panels = figure.subplots(len(shapes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, shape in zip(panels, shapes, strict=True):
        chosen = [i for i, case in enumerate(cases) if case.shape == shape]
        drawn = chosen[:: -(-len(chosen) // MOST_LINES)]
        for i in drawn:
            kept = states[i, ~np.isnan(states[i, :, 0]), :2]
            axes.plot(*np.vstack([kept, ends[i]]).T, linewidth=0.5, alpha=0.4)
        axes.axhline(0.0, color="black", linewidth=0.8, linestyle="--")
        subset = "" if len(drawn) == len(chosen) else f", {len(drawn)} of them shown"
        axes.set_title(f"{shape}: {len(chosen)} pushes{subset}", fontsize=9)
        axes.set_ylabel("y (m)")
    panels[-1].set_xlabel("x (m)")
    figure.suptitle(title, fontsize=10)
    return figure


def samples(cases: Sequence[Case], timing: Timing) -> Figure:
    """Draw cases with the slider's outline, contact point and pushing direction along the first two minutes."""
    from sim_backend.physics.lanes import simulate_lane
    from tools.sweep.grid import lane_of

    every = max(1, round(1.0 / timing.dt_s))
    steps = min(timing.steps, round(SAMPLE_SECONDS / timing.dt_s))
    fine = Timing(timing.dt_s, steps, every)
    figure = _figure(7.0, 1.7 * len(cases))
    panels = figure.subplots(len(cases), 1, sharex=True, squeeze=False)[:, 0]
    for axes, case in zip(panels, cases, strict=True):
        _, states = simulate_lane(lane_of(case), fine)
        axes.plot([s[0] for s in states], [s[1] for s in states], linewidth=1.0, color="tab:blue")
        for state in states[:: max(1, round(OUTLINE_EVERY_S / (every * timing.dt_s)))]:
            _draw_slider(axes, case, state)
        axes.axhline(0.0, color="black", linewidth=0.6, linestyle="--")
        axes.set_aspect("equal")
        axes.set_title(f"{case.shape}, contact friction {case.contact_friction:g}", fontsize=9)
        axes.set_ylabel("y (m)")
    panels[-1].set_xlabel("x (m)")
    return figure


def _draw_slider(axes: Any, case: Case, state: State) -> None:
    """Draw outline, contact point and pushing direction (black), and a circle's heading (red)."""
    x, y, phi, s, fx, fy = state
    c, si = math.cos(phi), math.sin(phi)
    if case.shape == "circle":
        angles = [2 * math.pi * k / 60 for k in range(61)]
        body = [(case.radius_m * math.cos(a), case.radius_m * math.sin(a)) for a in angles]
        side = math.pi - s / case.radius_m
        contact = (case.radius_m * math.cos(side), case.radius_m * math.sin(side))
        axes.plot([x, x + case.radius_m * c], [y, y + case.radius_m * si], color="tab:red", linewidth=0.8)
    else:
        h, w = case.length_m / 2, (case.length_m if case.shape == "square" else case.width_m) / 2
        body = [(-h, w), (-h, -w), (h, -w), (h, w), (-h, w)]
        contact = (-h, s)
    axes.plot(
        [x + c * bx - si * by for bx, by in body],
        [y + si * bx + c * by for bx, by in body],
        color="tab:blue",
        linewidth=0.6,
    )
    contact_x, contact_y = x + c * contact[0] - si * contact[1], y + si * contact[0] + c * contact[1]
    push = {
        "open-loop": 0.0,
        "line": -case.k_y_rad_per_m * contact_y,
    }.get(case.law, (case.k_f + 1) * math.atan2(fy, fx) + case.k_y_rad_per_m * contact_y)
    axes.plot(contact_x, contact_y, "k.", markersize=3)
    length = 0.5
    axes.plot(
        [contact_x - length * math.cos(push), contact_x],
        [contact_y - length * math.sin(push), contact_y],
        color="black",
        linewidth=0.8,
    )


def _figure(width_in: float, height_in: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure
