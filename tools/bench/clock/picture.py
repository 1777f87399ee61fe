"""The wake-ups of all columns as histograms, one panel a rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tools.bench.clock.wakeups import Wakeups
from tools.report.drawing.style import BLUE, GREEN, GREY, ORANGE, VERMILLION, new_figure, png, style
from tools.report.drawing.svg import svg

COLOURS = {
    "cyclictest": GREY,
    "bare": BLUE,
    "bare, spin": GREEN,
    "full": VERMILLION,
    "full, spin": ORANGE,
}
LEAST_US, MOST_US = 0.1, 20_000.0


def draw(path: Path, rates: Mapping[float, Mapping[str, Sequence[Wakeups]]]) -> None:
    """Write the picture, as SVG or PNG by the name's ending. Raises OSError."""
    with style():
        figure = new_figure(0.6 + 2.2 * len(rates))
        panels = figure.subplots(len(rates), 1, sharex=True, squeeze=False)[:, 0]
        edges = np.geomspace(LEAST_US, MOST_US, 90)
        for axes, (rate_hz, columns) in zip(panels, rates.items(), strict=True):
            for name, rounds in columns.items():
                late_us = np.concatenate([np.asarray(one.late_us) for one in rounds] or [np.empty(0)])
                counts, _ = np.histogram(np.clip(late_us, LEAST_US, MOST_US), edges)
                share = counts / max(1, len(late_us)) * 100.0
                axes.stairs(share, edges, color=COLOURS[name], linewidth=1.3, label=name)
            axes.set_xscale("log")
            axes.set_title(f"{rate_hz:g} Hz", fontsize=9)
            axes.set_ylabel("wake-ups (%)")
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        panels[0].legend(fontsize=7, ncols=len(COLOURS), loc="upper right", frameon=False)
        panels[-1].set_xlabel("late by (us)")
        path.write_bytes(png(figure) if path.suffix == ".png" else svg(figure).encode())
