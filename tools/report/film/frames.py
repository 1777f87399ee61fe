"""The frames of a film: pushes from above, side by side in time from their first contact, four times as fast."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robot_io.errors import UsageError
from tools.report.compare.given_runs import ComparedRun
from tools.report.compare.picture import line_of
from tools.report.drawing.plan_view import PUSHED, RunInPlan, outline, plan_axes
from tools.report.drawing.style import CORRIDOR, INK, VERMILLION, plain, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SPEED = 4.0
"""Seconds of a run shown in a second of film."""
FRAMES_PER_S = 10.0
MOST_FRAMES = 600
BEFORE_S = 1.0
"""How long before the first contact a film begins."""
ARROW_M = 0.3
"""Length of the arrow for the greatest force of the run."""
DPI = 100
MOST_IN_LEGEND, COLUMNS = 12, 3
LEGEND_ROW_IN = 0.21
LONGEST_M, WINDOW_M = 10.0, 8.0
"""A longer path is shown through a window, which follows the run that is ahead."""

Image = NDArray[np.uint8]
"""Shape (height, width, 3), RGB."""


class Film:
    """Frames of one size: `width` and `height` (even numbers of pixels), `count` of them, `frames_per_s`."""

    def __init__(self, runs: Sequence[ComparedRun]) -> None:
        """Prepare the film. Raises UsageError where no run has anything to show."""
        self._actors = [_Actor(one) for one in runs if np.isfinite(RunInPlan(one.run).x).any()]
        if not self._actors:
            raise UsageError("there is nothing to film: no log has a pose of the base", where="push report")
        length_s = BEFORE_S + max(actor.length_s for actor in self._actors)
        wanted = math.ceil(length_s / SPEED * FRAMES_PER_S) + 1
        self.count = min(wanted, MOST_FRAMES)
        self.frames_per_s = FRAMES_PER_S * self.count / wanted
        self._times = np.linspace(-BEFORE_S, length_s - BEFORE_S, self.count)
        named = self._actors[:MOST_IN_LEGEND] if len(self._actors) > 1 else []
        with style():
            legend_in = 0.15 + LEGEND_ROW_IN * math.ceil(len(named) / COLUMNS)
            self._figure, self._axes = plan_axes([actor.place for actor in self._actors], legend_in)
            self._figure.set_dpi(DPI)
            self._draw_floor(named)
            for actor in self._actors:
                actor.enter(self._axes)
            at: dict[str, Any] = {"transform": self._axes.transAxes, "va": "top", "animated": True}
            self._clock = self._axes.text(0.01, 0.97, "", **at)
        begin, end = self._axes.get_xlim()
        self._follows = end - begin > LONGEST_M
        if self._follows:
            self._zoom(WINDOW_M / (end - begin))
        width, height = self._canvas.get_width_height()
        self.width, self.height = width - width % 2, height - height % 2

    def frames(self) -> Iterator[Image]:
        """Yield every frame in order."""
        with style():
            self._canvas.draw()
            floor = self._canvas.copy_from_bbox(self._figure.bbox)
            for time_s in map(float, self._times):
                moved = [artist for actor in self._actors for artist in actor.at(time_s)]
                if self._follows:
                    ahead_m = max(actor.along_m for actor in self._actors)
                    self._axes.set_xlim(ahead_m - 0.6 * WINDOW_M, ahead_m + 0.4 * WINDOW_M)
                    self._canvas.draw()
                else:
                    self._canvas.restore_region(floor)
                self._clock.set_text(f"{max(time_s, 0.0):.1f} s")
                for artist in (*moved, self._clock):
                    self._axes.draw_artist(artist)
                yield np.asarray(self._canvas.buffer_rgba())[: self.height, : self.width, :3].copy()

    def _zoom(self, share: float) -> None:
        """Show less of the path, at the same scale in both directions and around y = 0."""
        low, high = self._axes.get_ylim()
        self._axes.set_ylim(-(high - low) / 2 * share, (high - low) / 2 * share)

    @property
    def _canvas(self) -> Any:
        return self._figure.canvas

    def _draw_floor(self, named: Sequence[_Actor]) -> None:
        corridor_m = max(actor.place.run.rig.goal.corridor_m for actor in self._actors)
        self._axes.axhspan(-corridor_m, corridor_m, color=CORRIDOR, linewidth=0, zorder=0)
        self._axes.axhline(0.0, color=INK, linestyle=(0, (5, 4)), linewidth=1.0)
        for actor in named:
            label, line = plain(actor.name, 30), actor.line
            self._axes.plot([], [], color=line.colour, linestyle=line.dashes, label=label)
        if named:
            self._figure.legend(loc="upper center", ncols=COLUMNS, frameon=False)


class _Actor:
    """One run in a film: its trail, object, ball and force."""

    def __init__(self, one: ComparedRun) -> None:
        self.place, self.line, self.name = RunInPlan(one.run), line_of(one), f"{one.number}: {one.label}"
        ticks = one.run.ticks
        pushed = np.flatnonzero(np.isin(self.place.phase, PUSHED))
        self._begin_s = float(ticks["t_s"][pushed[0]]) if len(pushed) else 0.0
        self._times = ticks["t_s"] - self._begin_s
        self.length_s = float(self._times[-1])
        self.along_m = 0.0
        force = np.hypot(ticks["force_x"], ticks["force_y"])
        self._arrow_m_per_N = ARROW_M / float(np.nanmax(force, initial=1.0))
        self._outline = outline(one.run)
        self._radius_m = 0.02 if one.run.rig.base.level == "hardware" else one.run.rig.world.ball_radius_m

    def enter(self, axes: Axes) -> None:
        """Create what moves; it is drawn frame by frame, not with the figure."""
        from matplotlib.patches import Circle, Polygon

        colour = self.line.colour
        (self._trail,) = axes.plot([], [], color=colour, linestyle=self.line.dashes, linewidth=1.4, animated=True)
        self._object = Polygon([(0.0, 0.0)], facecolor=f"{colour}22", edgecolor=colour, linewidth=1.0, animated=True)
        self._ball = Circle((0.0, 0.0), self._radius_m, facecolor="white", edgecolor=colour, animated=True)
        (self._force,) = axes.plot([], [], color=VERMILLION, linewidth=2.0, animated=True)
        axes.add_patch(self._object)
        axes.add_patch(self._ball)

    def at(self, time_s: float) -> list[Any]:
        """Move everything to a time (s since first contact); return what is to be drawn, from the bottom up."""
        tick = min(int(np.searchsorted(self._times, time_s)), len(self._times) - 1)
        if math.isfinite(self.place.x[tick]):
            self.along_m = float(self.place.x[tick])
        x, y = self.place.x, self.place.y
        step = max(1, tick // 1000)
        self._trail.set_data(x[: tick + 1 : step], y[: tick + 1 : step])
        if not (math.isfinite(x[tick]) and math.isfinite(y[tick])):
            return [self._trail]
        self._ball.set_center((float(x[tick]), float(y[tick])))
        ticks = self.place.run.ticks
        fx, fy = (ticks[name][tick] * self._arrow_m_per_N for name in ("force_x", "force_y"))
        self._force.set_data([x[tick], x[tick] + fx], [y[tick], y[tick] + fy])
        return [*self._outline_at(time_s + self._begin_s), self._trail, self._ball, self._force]

    def _outline_at(self, time_s: float) -> list[Any]:
        seen_s, x, y, yaw = self.place.slider()
        if not len(seen_s) or self._outline is None:
            return []
        k = min(int(np.searchsorted(seen_s, time_s)), len(seen_s) - 1)
        if not all(map(math.isfinite, (x[k], y[k], yaw[k]))):
            return []
        c, s = math.cos(yaw[k]), math.sin(yaw[k])
        self._object.set_xy([(x[k] + c * bx - s * by, y[k] + s * bx + c * by) for bx, by in self._outline])
        return [self._object]
