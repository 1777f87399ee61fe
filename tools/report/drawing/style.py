"""Common style of the report's figures: text size, colours that colour-blind people can distinguish, shaded phases."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from robot_io.tick import Phase
from tools.report.bounded_series import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito, "Color Universal Design" (2008).
BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#AA4499"
GREY, INK = "#8a8a8a", "#222222"
CORRIDOR = "#f1f5f1"

WIDTH_IN = 6.4
DPI = 110

PHASE_COLOURS = {
    Phase.SETTLE: "#eeeeee",
    Phase.TARE: "#e3e3e3",
    Phase.APPROACH: "#fbf1cc",
    Phase.PUSH: "#dcecf7",
    Phase.LOST: "#f9d9c4",
    Phase.LOST_HOLD: "#f3c3a6",
    Phase.REST: "#e6f2dd",
    Phase.RETREAT: "#d7ead9",
    Phase.CHECK: "#ececec",
    Phase.DONE: "#ffffff",
    Phase.FAILED: "#f6cfd6",
}
DARK = {
    INK: "#e4e7ea",
    "#000000": "#e4e7ea",
    "#ffffff": "#171717",
    "#666666": "#9aa4ad",
    GREY: "#a8a8a8",
    "#888888": "#a0a0a0",
    "#c4c4c4": "#4a4a4a",
    "#cccccc": "#555555",
    BLUE: "#5eb3f0",
    ORANGE: "#f0b93a",
    GREEN: "#3fcf9f",
    VERMILLION: "#ff8a4c",
    SKY: "#7cc6f2",
    PURPLE: "#d488cc",
    CORRIDOR: "#1b201c",
    "#eeeeee": "#262626",
    "#e3e3e3": "#2e2e2e",
    "#fbf1cc": "#3a3418",
    "#dcecf7": "#1b2c3a",
    "#f9d9c4": "#472c1a",
    "#f3c3a6": "#5a3118",
    "#e6f2dd": "#23331a",
    "#d7ead9": "#1d3a24",
    "#ececec": "#2a2a2a",
    "#f6cfd6": "#4a1f28",
}
"""What a colour becomes on a dark page."""

TIME, PLAN = "time", "plan"
"""What the axes of a figure show, as their gid: a page finds by it where to draw its cursor."""
_LABEL_SHARE = 0.05
"""A phase shorter than this share of the axis has no room for its name."""

_STYLE: Any = {
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10,
    "legend.fontsize": 9.5,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#666666",
    "axes.labelcolor": INK,
    "text.color": INK,
    "axes.grid": True,
    "grid.color": "#c4c4c4",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.4,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "#cccccc",
    "savefig.facecolor": "white",
    # Names come from a log: never interpret them as formulas.
    "text.parse_math": False,
    "axes.unicode_minus": False,
    "agg.path.chunksize": 20_000,
    # Text stays text in SVG, and the same figure gives the same bytes.
    "svg.fonttype": "none",
    "svg.hashsalt": "push",
}


@contextmanager
def style() -> Iterator[None]:
    """Apply the style while figures are drawn and written."""
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):
        yield


def new_figure(height_in: float, *, constrained: bool = True) -> Figure:
    """Return an empty figure that needs no display; `constrained`: matplotlib computes its layout."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained" if constrained else None)
    FigureCanvasAgg(figure)
    return figure


def new_panels(height_in: float, *, left_in: float = 0.75, gap_in: float = 0.1) -> Figure:
    """Return an empty figure with fixed margins for panels one above another, `gap_in` apart.

    The space for labels is known; letting matplotlib compute it would take as long as drawing.
    """
    figure = new_figure(height_in, constrained=False)
    figure.subplots_adjust(
        left=left_in / WIDTH_IN, right=0.985, bottom=0.5 / height_in, top=1.0 - 0.27 / height_in, hspace=gap_in
    )
    return figure


def png(figure: Figure, dpi: float = DPI) -> bytes:
    """Return a figure as PNG; the same figure gives the same bytes."""
    lay_out(figure)
    target = io.BytesIO()
    figure.savefig(target, dpi=dpi, format="png", metadata={"Software": None}, pil_kwargs={"compress_level": 3})
    return target.getvalue()


def lay_out(figure: Figure) -> None:
    """Fix the layout of a figure, so that its axes stay where they are."""
    engine = figure.get_layout_engine()
    if engine is not None:
        # Lay out once, here: savefig with an engine draws everything twice, a third of a report's time.
        engine.execute(figure)
        figure.set_layout_engine("none")


def warm_up() -> None:
    """Load what drawing needs (matplotlib, its fonts) by drawing an empty figure."""
    with style():
        figure = new_figure(1.0)
        figure.subplots()
        figure.savefig(io.StringIO(), format="svg")


def plain(text: str, most: int = 40) -> str:
    """Return text from a log reduced to what the figure's font can show, at most `most` characters."""
    kept = "".join(letter if " " <= letter <= "~" else "?" for letter in text)
    return kept if len(kept) <= most else kept[: most - 3] + "..."


def phase_spans(ticks: dict[str, Floats]) -> list[tuple[Phase, float, float]]:
    """Return (phase, from, to) in s, in order; unknown phases are left out."""
    times, phases = ticks["t_s"], ticks["phase"]
    if not len(times):
        return []
    changes = np.flatnonzero(np.diff(phases)) + 1
    starts, ends = [0, *changes.tolist()], [*changes.tolist(), len(times) - 1]
    known = {int(phase) for phase in Phase}
    return [
        (Phase(int(phases[begin])), float(times[begin]), float(times[end]))
        for begin, end in zip(starts, ends, strict=True)
        if phases[begin] in known
    ]


def shade_phases(axes: Axes, ticks: dict[str, Floats], *, named: bool) -> None:
    """Shade the phases behind a time plot, and write their names above it where they fit."""
    spans = phase_spans(ticks)
    if not spans:
        return
    begin, end = spans[0][1], spans[-1][2]
    length = max(end - begin, 0.1)
    axes.set_xlim(begin, begin + length)
    axes.set_gid(TIME)
    for phase, since, until in spans:
        axes.axvspan(since, until, color=PHASE_COLOURS[phase], linewidth=0, zorder=0)
        if named and until - since >= _LABEL_SHARE * length:
            axes.text(
                (since + until) / 2,
                1.01,
                phase.name.lower().replace("_", " "),
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=8.5,
                clip_on=False,
            )


def no_data(axes: Axes, text: str) -> None:
    """Write into an empty plot why it is empty."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=11, color=GREY)
