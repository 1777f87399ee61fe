"""Draw the plan view: the paths of the contact point and the object from above, in the frame of the path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robot_io.errors import ContactLost
from robot_io.tick import Phase
from tools.report.bounded_series import Floats
from tools.report.drawing.style import (
    BLUE,
    CORRIDOR,
    GREEN,
    GREY,
    INK,
    PLAN,
    PURPLE,
    VERMILLION,
    WIDTH_IN,
    new_figure,
    no_data,
)
from tools.report.drawing.thinned import thinned_path
from tools.report.run_data import RunData

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PUSHED = (Phase.PUSH, Phase.LOST, Phase.LOST_HOLD, Phase.REST)
"""Phases from first contact to rest."""
OUTLINE_EVERY_M = 0.5
MOST_OUTLINES = 40
LEFT_IN, RIGHT_IN, BOTTOM_IN, LEGEND_IN = 0.75, 0.15, 0.55, 0.7
LOWEST_IN, HIGHEST_IN = 1.2, 7.0
"""Limits for a panel's height; both axes always have the same scale."""
FORCE_ARROW_M = 0.25
"""Length of the arrow for the median force."""


class RunInPlan:
    """A run in the plan's frame: x along the path from the first contact (or the path's origin), y to the left, m."""

    def __init__(self, run: RunData) -> None:
        self.run = run
        control = run.last.after.control if run.last else None
        self.contact_seen = bool(control and control.contact_seen)
        self.zero_m = (
            control.contact_from_m if control and self.contact_seen and math.isfinite(control.contact_from_m) else 0.0
        )
        heading = math.radians(run.rig.path.direction_deg)
        self._cos, self._sin, self._heading = math.cos(heading), math.sin(heading), heading
        self.x = run.ticks["along_m"] - self.zero_m
        self.y = run.ticks["lateral_m"]
        self.phase = run.ticks["phase"]

    def slider(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the object's time (s), position (m) and heading (rad) in the plan's frame."""
        table, origin = self.run.slider, self.run.rig.path.origin_m
        x, y = table["x_m"] - origin[0], table["y_m"] - origin[1]
        along, left = x * self._cos + y * self._sin - self.zero_m, y * self._cos - x * self._sin
        return table["t_s"], along, left, table["yaw_rad"] - self._heading

    def marks(self) -> list[int]:
        """Return ticks of the push, first and last included, about every half metre the contact point travelled."""
        pushed = np.flatnonzero(np.isin(self.phase, PUSHED))
        pushed = pushed[np.isfinite(self.x[pushed]) & np.isfinite(self.y[pushed])]
        if not len(pushed):
            return []
        # Twice a second: from tick to tick the noise of the pose would add up to more than the way.
        times = self.run.ticks["t_s"][pushed]
        seldom = np.searchsorted(times, np.arange(times[0], times[-1], 0.5))
        pushed = pushed[np.unique([*seldom.tolist(), len(pushed) - 1])]
        way = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(self.x[pushed]), np.diff(self.y[pushed])))))
        every = max(OUTLINE_EVERY_M, float(way[-1]) / MOST_OUTLINES)
        # The last mark shows the end; one just before it would only be covered.
        wanted = [*np.arange(0.0, max(way[-1] - every / 2, every / 2), every).tolist(), float(way[-1])]
        return [int(pushed[min(int(np.searchsorted(way, w)), len(pushed) - 1)]) for w in wanted]


def trajectory(run: RunData) -> Figure:
    """Draw one run from above."""
    place = RunInPlan(run)
    figure, axes = plan_axes([place], LEGEND_IN)
    if not np.isfinite(place.x).any():
        no_data(axes, "no pose of the base in this log")
        return figure
    axes.set_gid(PLAN)
    _draw(axes, place)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncols=3, frameon=False, handlelength=1.6, columnspacing=2.4)
    return figure


def plan_axes(places: Sequence[RunInPlan], legend_in: float) -> tuple[Figure, Axes]:
    """Return a figure with room for a legend above its only axes, which hold all of these runs at one scale."""
    x_range, y_range = _limits(places)
    scale = (WIDTH_IN - LEFT_IN - RIGHT_IN) / (x_range[1] - x_range[0])
    panel_in = scale * (y_range[1] - y_range[0])
    height_in = BOTTOM_IN + panel_in + legend_in
    figure = new_figure(height_in, constrained=False)
    width = 1.0 - (LEFT_IN + RIGHT_IN) / WIDTH_IN
    axes = figure.add_axes((LEFT_IN / WIDTH_IN, BOTTOM_IN / height_in, width, panel_in / height_in))
    axes.set_xlim(*x_range)
    axes.set_ylim(*y_range)
    all_seen = all(place.contact_seen for place in places)
    axes.set_xlabel("along the path, from first contact (m)" if all_seen else "along the path, from its origin (m)")
    axes.set_ylabel("left of path (m)")
    return figure, axes


def _draw(axes: Axes, place: RunInPlan) -> None:
    x, y, marks = place.x, place.y, place.marks()
    way = [-place.zero_m, place.run.rig.control.distance_m]
    axes.plot(way, [0.0, 0.0], color=INK, linestyle=(0, (5, 4)), linewidth=1.0, label="path")
    corridor_m = place.run.rig.goal.corridor_m
    axes.axhspan(-corridor_m, corridor_m, color=CORRIDOR, linewidth=0, zorder=0, label=f"corridor of {corridor_m:g} m")
    axes.plot(*thinned_path(x, y), color=BLUE, label="contact point", zorder=3, linewidth=1.7)
    _object(axes, place)
    _balls(axes, place)
    _forces(axes, place)
    if not marks:
        return
    start, end = marks[0], marks[-1]
    axes.plot(x[start], y[start], "o", color=GREEN, markersize=6, label="first contact", zorder=5)
    if ended(place.run) == ContactLost.exit_code:
        axes.plot(x[end], y[end], "X", color=PURPLE, markersize=9, label="object lost", zorder=6)
    else:
        axes.plot(x[end], y[end], "s", color=INK, markersize=5.5, label="end", zorder=6)


def ended(run: RunData) -> int | None:
    """Return the exit code recorded in the log, None if the log ends before the run does."""
    return run.last.output.exit_code if run.last and run.last.output.finished else None


def outline(run: RunData) -> list[tuple[float, float]] | None:
    """Return the object's closed outline in its own frame (m); None if its shape is unknown."""
    if run.rig.base.level == "hardware":
        return None
    slider = run.rig.world.slider
    if slider.shape == "circle":
        angles = (math.tau * k / 72 for k in range(73))
        return [(slider.radius_m * math.cos(a), slider.radius_m * math.sin(a)) for a in angles]
    h, w = slider.length_m / 2, slider.width_m / 2
    return [(-h, w), (-h, -w), (h, -w), (h, w), (-h, w)]


def _limits(places: Sequence[RunInPlan]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ranges along and across the path (m) that contain everything and keep the panel's height in limits."""
    xs = np.concatenate([values for place in places for values in (place.x, place.slider()[1])])
    ys = np.concatenate([values for place in places for values in (place.y, place.slider()[2])])
    reach = max(math.hypot(*corner) for place in places for corner in (outline(place.run) or [(0.2, 0.2)]))
    x_low, x_high = _range(xs)
    y_low, y_high = _range(ys)
    x_low, x_high = x_low - reach / 2, x_high + reach
    y_low, y_high = min(y_low, 0.0) - reach, max(y_high, 0.0) + reach
    scale = (WIDTH_IN - LEFT_IN - RIGHT_IN) / (x_high - x_low)
    more = max(0.0, LOWEST_IN / scale - (y_high - y_low)) / 2
    y_low, y_high = y_low - more, y_high + more
    more = max(0.0, scale * (y_high - y_low) / HIGHEST_IN - 1.0) * (x_high - x_low) / 2
    return (x_low - more, x_high + more), (y_low, y_high)


def _range(values: Floats) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)


def _object(axes: Axes, place: RunInPlan) -> None:
    times, x, y, yaw = place.slider()
    if not len(times):
        return
    first, last = 0, len(times)
    if len(place.run.ticks["t_s"]):  # motion before and after the run is not drawn
        first, last = np.searchsorted(times, (0.0, place.run.ticks["t_s"][-1])).tolist()
    centre = thinned_path(x[first:last], y[first:last])
    axes.plot(*centre, color=GREY, linewidth=1.2, linestyle=":", label="object's centre", zorder=2)
    shape = outline(place.run)
    label = "object"
    for tick in place.marks():
        at = min(int(np.searchsorted(times, place.run.ticks["t_s"][tick])), len(times) - 1)
        if not (math.isfinite(x[at]) and math.isfinite(y[at]) and math.isfinite(yaw[at])):
            continue
        c, s = math.cos(yaw[at]), math.sin(yaw[at])
        if shape is None:  # the shape is unknown: draw only the heading
            axes.plot([x[at], x[at] + 0.15 * c], [y[at], y[at] + 0.15 * s], color=GREY, linewidth=1.2, zorder=2)
            continue
        axes.fill(
            [x[at] + c * bx - s * by for bx, by in shape],
            [y[at] + s * bx + c * by for bx, by in shape],
            facecolor="#88888814",
            edgecolor="#888888",
            linewidth=0.9,
            zorder=1.5,
            label=label,
        )
        label = "_"


def _balls(axes: Axes, place: RunInPlan) -> None:
    """Draw the contact ball at each mark, but not for a real rig, whose ball size is unknown."""
    if place.run.rig.base.level == "hardware":
        return
    from matplotlib.patches import Circle

    for tick in place.marks():
        at = (float(place.x[tick]), float(place.y[tick]))
        axes.add_patch(Circle(at, place.run.rig.world.ball_radius_m, facecolor="none", edgecolor=BLUE, linewidth=0.9))


def _forces(axes: Axes, place: RunInPlan) -> None:
    ticks, marks = place.run.ticks, place.marks()
    fx, fy = ticks["force_x"], ticks["force_y"]
    size = np.hypot(fx, fy)
    marks = [tick for tick in marks if size[tick] > place.run.rig.control.force_min_N]
    if not marks:
        return
    scale = FORCE_ARROW_M / float(np.median(size[marks]))
    axes.quiver(
        place.x[marks],
        place.y[marks],
        fx[marks] * scale,
        fy[marks] * scale,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        color=VERMILLION,
        width=0.003,
        headwidth=5,
        zorder=4,
    )
    # A quiver has no legend entry of its own.
    axes.plot([], [], color=VERMILLION, linewidth=2, label="force on the object")
