"""Draw one run over time: force, speed, tracking, timing, safety. The plan view is in `plan_view.py`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from robot_io.tick import Mode
from tools.report.bounded_series import Floats, Span, Tally
from tools.report.drawing import plan_view
from tools.report.drawing.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    new_figure,
    new_panels,
    no_data,
    plain,
    shade_phases,
)
from tools.report.drawing.thinned import thinned
from tools.report.run_data import RunData

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_FAULT_ROWS = 12
FLOOR_N = 0.5
"""Smallest force on the logarithmic axis."""
MODE_COLOURS = {
    Mode.SILENT: "#cccccc",
    Mode.READY: SKY,
    Mode.PUSHING: GREEN,
    Mode.SLOW: "#F0E442",
    Mode.HOLD: ORANGE,
    Mode.STOP: VERMILLION,
    Mode.DEAD: INK,
}


FIGURES: dict[str, Callable[[RunData], Figure]]
"""What draws each figure of a run, by name, in the order of the page. Call it and write its figure within `style`."""


def force(run: RunData) -> Figure:
    """Draw the force on the object, and the raw reading against the limits (on a logarithmic scale)."""
    figure = new_panels(4.6)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    ticks, control, limits = run.ticks, run.rig.control, run.rig.limits
    if not len(ticks["t_s"]):
        return _empty(figure, (top, bottom))
    size = np.hypot(ticks["force_x"], ticks["force_y"])
    for axes in (top, bottom):
        shade_phases(axes, ticks, named=axes is top)
    top.plot(*thinned(ticks["t_s"], size), color=BLUE, label="horizontal")
    top.plot(*thinned(ticks["t_s"], ticks["force_y"]), color=PURPLE, linewidth=1.0, label="to the left")
    top.axhline(control.force_min_N, color=INK, linestyle=":", label=f"contact above {control.force_min_N:g} N")
    top.set_ylabel("force (N)")
    _legend(top, 3)
    bottom.semilogy(
        *thinned(ticks["t_s"], np.maximum(ticks["force_raw"], FLOOR_N)),
        color=GREY,
        linewidth=0.9,
        label="raw",
    )
    for value, colour, dashes, name in (
        (limits.max_force_N, VERMILLION, "-", "stop"),
        (limits.slow_force_N, ORANGE, "--", "slow"),
        (control.force_min_N, INK, ":", "contact"),
    ):
        bottom.axhline(value, color=colour, linestyle=dashes, linewidth=1.3, label=f"{name} {value:g} N")
    peak = _greatest(ticks["force_raw"])
    bottom.set_ylim(FLOOR_N, 1.6 * max(limits.max_force_N, peak))
    bottom.set_yticks([1, 10, 100], labels=["1", "10", "100"])
    bottom.set_ylabel("raw (N)")
    bottom.set_xlabel("time (s)")
    _legend(bottom, 4)
    return figure


def speed(run: RunData) -> Figure:
    """Draw the speed of the base: requested by the law, commanded after safety, measured by odometry."""
    figure = new_panels(3.1)
    axes = figure.subplots()
    ticks = run.ticks
    if not len(ticks["t_s"]):
        return _empty(figure, (axes,))
    shade_phases(axes, ticks, named=True)
    axes.plot(*thinned(ticks["t_s"], ticks["speed_measured"]), color=ORANGE, linewidth=2.6, label="measured")
    axes.plot(
        *thinned(ticks["t_s"], ticks["speed_wanted"]),
        color=INK,
        linewidth=1.0,
        linestyle="--",
        label="requested",
    )
    axes.plot(*thinned(ticks["t_s"], ticks["speed_command"]), color=BLUE, linewidth=1.1, label="commanded")
    greatest = max(_greatest(ticks[name]) for name in ("speed_measured", "speed_wanted", "speed_command"))
    axes.set_ylim(-0.04 * max(greatest, 0.01), 1.3 * max(greatest, 0.01))
    axes.set_xlabel("time (s)")
    axes.set_ylabel("speed (m/s)")
    _legend(axes, 3)
    return figure


def tracking(run: RunData) -> Figure:
    """Draw lateral offset, the angles of force and push, and the base's heading error."""
    figure = new_panels(5.6, left_in=1.0)
    panels = figure.subplots(3, 1, sharex=True)
    ticks = run.ticks
    if not len(ticks["t_s"]):
        return _empty(figure, tuple(panels))
    for axes in panels:
        shade_phases(axes, ticks, named=axes is panels[0])
        axes.axhline(0.0, color=INK, linewidth=0.7)
    offset, angles, heading = panels
    offset.plot(*thinned(ticks["t_s"], ticks["lateral_m"]), color=BLUE)
    _at_least(offset, 0.05)
    offset.set_ylabel("left of\npath (m)")
    angles.plot(*thinned(ticks["t_s"], np.degrees(ticks["theta_f"])), color=VERMILLION, linewidth=1.0, label="force")
    angles.plot(*thinned(ticks["t_s"], np.degrees(ticks["theta_p"])), color=BLUE, label="push")
    _at_least(angles, 5.0)
    angles.set_ylabel("angles\n(deg)")
    _legend(angles, 2)
    heading.plot(*thinned(ticks["t_s"], np.degrees(ticks["heading_error"])), color=GREEN)
    _at_least(heading, 1.0)
    heading.set_ylabel("heading\n(deg)")
    heading.set_xlabel(f"time (s); a heading error of {run.rig.limits.max_heading_error_deg:g} deg is a stop")
    figure.align_ylabels(panels)
    return figure


def timing(run: RunData) -> Figure:
    """Draw how late the ticks started, and when ticks were skipped."""
    virtual = run.late.total > 0 and run.late.worst_ms == 0.0
    figure = new_panels(1.6 if virtual else 4.0, gap_in=0.55)
    if virtual:
        _skips(figure.subplots(), run, "no tick was late: this run used a virtual clock")
        return figure
    top, bottom = figure.subplots(2, 1, height_ratios=(3, 1))
    if not run.late.total:
        return _empty(figure, (top, bottom))
    _lateness(top, run.late)
    _skips(bottom, run, "none")
    return figure


def _lateness(axes: Axes, late: Tally) -> None:
    wanted = np.geomspace(late.BIN_MS, max(late.worst_ms * 1.05, 1.0), 60)
    edges = np.unique(np.ceil(wanted / late.BIN_MS)) * late.BIN_MS
    edges = np.concatenate(([0.0], edges))
    axes.stairs(late.counts_in(edges), edges, fill=True, color=SKY)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.7)
    for value, colour, dashes, name in (
        (late.percentile_ms(50), INK, ":", "median"),
        (late.percentile_ms(99), BLUE, "--", "99 %"),
        (late.worst_ms, VERMILLION, "-", "worst"),
    ):
        axes.axvline(value, color=colour, linestyle=dashes, label=f"{name}: {value:.2f} ms")
    axes.set_xlim(late.BIN_MS / 2, edges[-1])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xlabel("lateness of a tick (ms)")
    axes.set_ylabel("ticks")
    _legend(axes, 3)


def _skips(axes: Axes, run: RunData, none: str) -> None:
    """Draw when how many ticks were skipped, or write `none`."""
    shade_phases(axes, run.ticks, named=True)
    axes.grid(visible=False)
    if run.skips:
        times, counts = zip(*run.skips, strict=True)
        axes.vlines(times, 0, counts, color=VERMILLION, linewidth=1.6)
        axes.set_ylim(0, 1.2 * max(counts))
    else:
        axes.set_ylim(0, 1)
        axes.set_yticks([])
        axes.text(0.5, 0.5, none, transform=axes.transAxes, ha="center", va="center", color=GREY)
    axes.set_ylabel("skipped")
    axes.set_xlabel("time (s)")


def safety(run: RunData) -> Figure:
    """Draw the supervisor's mode and every fault over time."""
    names = list(dict.fromkeys(span.name for span in run.faults))
    shown = names[:MOST_FAULT_ROWS]
    figure = new_figure(1.5 + 0.3 * len(shown))
    axes = figure.subplots()
    if not len(run.ticks["t_s"]):
        return _empty(figure, (axes,))
    shade_phases(axes, run.ticks, named=True)
    length = axes.get_xlim()[1] - axes.get_xlim()[0]
    used: dict[Mode, Any] = {}
    known = {str(int(mode)): mode for mode in Mode}
    for span in run.modes:
        mode = known.get(span.name)
        if mode is not None:
            used[mode] = axes.broken_barh([_bar(span, length)], (-0.4, 0.8), color=MODE_COLOURS[mode])
    for row, name in enumerate(shown, start=1):
        bars = [_bar(span, length) for span in run.faults if span.name == name]
        axes.broken_barh(bars, (row - 0.32, 0.64), color=VERMILLION)
    left_out = f" (and {len(names) - len(shown)} more)" if len(names) > len(shown) else ""
    labels = ["mode", *(plain(name, 14) for name in shown)]
    axes.set_yticks(range(len(labels)), labels=labels, fontsize=11)
    axes.set_ylim(len(labels) - 0.5, -0.6)
    axes.grid(visible=False)
    axes.set_xlabel(f"time (s){left_out}" if shown else "time (s); no fault")
    if used:
        modes = sorted(used)
        figure.legend(
            [used[mode] for mode in modes],
            [mode.name for mode in modes],
            loc="outside upper center",
            ncols=len(modes),
            frameon=False,
            handlelength=1.2,
        )
    return figure


def _bar(span: Span, length: float) -> tuple[float, float]:
    """Return (begin, width) in s, wide enough for a span of one tick to be visible."""
    return span.begin_s, max(span.end_s - span.begin_s, 0.003 * length)


def _empty(figure: Figure, panels: tuple[Axes, ...]) -> Figure:
    figure.set_figheight(1.5)
    for axes in panels:
        axes.set_axis_off()
    no_data(panels[0], "this log contains no ticks")
    return figure


def _legend(axes: Axes, columns: int) -> None:
    """Place the legend in the upper right, and make room for it."""
    low, high = axes.get_ylim()
    if axes.get_yscale() == "log":
        axes.set_ylim(low, high * (high / low) ** 0.3)
    else:
        axes.set_ylim(low, high + 0.22 * (high - low))
    axes.legend(loc="upper right", ncols=columns, borderpad=0.3, columnspacing=1.2, handlelength=1.6)


def _at_least(axes: Axes, span: float) -> None:
    """Let an axis show at least +-`span`, so that it does not magnify negligible values."""
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -span), max(high, span))


def _greatest(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else 0.0


FIGURES = {
    "trajectory": plan_view.trajectory,
    "tracking": tracking,
    "force": force,
    "speed": speed,
    "safety": safety,
    "timing": timing,
}
