"""Several runs in one picture: the lateral course of each over the distance along its path, one panel per object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robot_io.errors import ContactLost
from tools.report.bounded_series import Floats
from tools.report.compare.given_runs import ComparedRun
from tools.report.drawing.plan_view import PUSHED, RunInPlan, ended
from tools.report.drawing.style import (
    BLUE,
    CORRIDOR,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    new_figure,
    plain,
)
from tools.report.drawing.thinned import thinned_path
from tools.report.run_facts import object_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY)
DASHES = ("-", "--", ":", "-.")
MOST_IN_LEGEND = 24
PANEL_IN = 2.3


class Line:
    """How a run is drawn: its colour (runs without feedback are black, as in the paper) and its dashes."""

    def __init__(self, number: int, controller: str) -> None:
        plain_law = controller == "open-loop"
        self.colour = INK if plain_law else COLOURS[(number - 1) % len(COLOURS)]
        self.dashes = DASHES[((number - 1) // (1 if plain_law else len(COLOURS))) % len(DASHES)]


def line_of(one: ComparedRun) -> Line:
    """Return how a run is drawn, the same in picture, table and film."""
    return Line(one.number, one.run.rig.control.law)


def overlay(runs: Sequence[ComparedRun]) -> Figure:
    """Draw all runs, the object's centre where it is known, else the contact point. Raises no error for empty logs."""
    groups: dict[str, list[ComparedRun]] = {}
    for one in runs:
        groups.setdefault(object_words(one.run.rig) or one.run.rig.name, []).append(one)
    named = runs[:MOST_IN_LEGEND]
    rows = -(-len(named) // _columns(named))
    figure = new_figure(PANEL_IN * len(groups) + 0.3 + 0.2 * rows)
    panels = figure.subplots(len(groups), 1, squeeze=False, sharex=True)[:, 0]
    for axes, (name, members) in zip(panels, groups.items(), strict=True):
        _panel(axes, members)
        if len(groups) > 1:
            axes.set_title(plain(name, 70), loc="left")
    panels[-1].set_xlabel("along the path, from first contact (m)")
    handles = [line for axes in panels for line in axes.get_lines() if not line.get_label().startswith("_")]
    handles.sort(key=lambda line: int(str(line.get_gid())))
    figure.legend(
        handles=handles[:MOST_IN_LEGEND], loc="outside lower center", ncols=_columns(named), frameon=False
    )  # fmt: skip
    return figure


def course_of(one: ComparedRun) -> tuple[Floats, Floats]:
    """Return where a run went during its push (m, in the plan's frame)."""
    place = RunInPlan(one.run)
    pushed = np.flatnonzero(np.isin(place.phase, PUSHED))
    if not len(pushed):
        return np.empty(0), np.empty(0)
    seen_s, along, left, _ = place.slider()
    if not len(seen_s):
        return place.x[pushed], place.y[pushed]
    times = one.run.ticks["t_s"]
    during = (seen_s >= times[pushed[0]]) & (seen_s <= times[pushed[-1]])
    return along[during], left[during]


def _panel(axes: Axes, runs: Sequence[ComparedRun]) -> None:
    corridor_m = max(one.run.rig.goal.corridor_m for one in runs)
    axes.axhspan(-corridor_m, corridor_m, color=CORRIDOR, linewidth=0, zorder=0)
    axes.axhline(0.0, color=INK, linewidth=0.8, linestyle=(0, (5, 4)))
    for one in runs:
        x, y = thinned_path(*course_of(one))
        line = line_of(one)
        label = f"{one.number}: {plain(one.label, 44)}"
        (drawn,) = axes.plot(x, y, color=line.colour, linestyle=line.dashes, linewidth=1.3, label=label)
        drawn.set_gid(str(one.number))
        if len(x) and ended(one.run) == ContactLost.exit_code:
            axes.plot(x[-1], y[-1], "X", color=line.colour, markersize=7, label="_lost")
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -1.1 * corridor_m), max(high, 1.1 * corridor_m))
    axes.set_ylabel("left of path (m)")


def _columns(runs: Sequence[ComparedRun]) -> int:
    longest = max(len(one.label) for one in runs)
    return 3 if longest <= 16 and len(runs) > 4 else 2 if longest <= 34 else 1
