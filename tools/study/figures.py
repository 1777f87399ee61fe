"""The figures of a study, SVG: all courses over each other, a heat map over two axes, survival over the distance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from tools.study.results import Runs, groups, number

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

MOST_COURSES = 400
"""A panel with more shows an evenly spaced subset."""
MOST_PANELS = 8
COLUMN = "end_lateral_m"


def save(figure: Figure, folder: Path, name: str) -> str:
    """Write a figure as NAME.svg; the same figure gives the same bytes. Returns the file's name."""
    import matplotlib as mpl

    folder.mkdir(exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
    return f"{folder.name}/{name}.svg"


def courses(runs: Runs, kept: dict[int, Floats], key: str, title: str) -> Figure:
    """Draw where the object went, one panel for each value of a column; what did not end in `done` is red.

    kept: by run, shape (n, 3): way of the ball (m), the object's lateral offset (m) and heading (rad), PATH frame.
    """
    panels = list(groups(runs, [key]).items())[:MOST_PANELS]
    figure = _figure(7.0, 0.9 + 1.8 * len(panels))
    drawn = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, ((value,), rows) in zip(drawn, panels, strict=True):
        shown = [row for row in rows[:: -(-len(rows) // MOST_COURSES)] if int(row["run"]) in kept]
        for row in shown:
            course = kept[int(row["run"])]
            colour = "tab:blue" if row["verdict"] == "done" else "tab:red"
            axes.plot(course[:, 0], course[:, 1], linewidth=0.7, alpha=0.6, color=colour)
        axes.axhline(0.0, color="black", linewidth=0.8, linestyle="--")
        subset = "" if len(shown) == len(rows) else f", {len(shown)} of them shown"
        axes.set_title(f"{key} = {value}: {len(rows)} pushes{subset}", fontsize=9)
        axes.set_ylabel("object (m)")
    drawn[-1].set_xlabel("way from the start of the path (m)")
    figure.suptitle(title, fontsize=10)
    return figure


def heat_map(runs: Runs, down: str, across: str, title: str) -> Figure:
    """Draw the median size of the end offset over two columns, with the share that was done in each cell."""
    import numpy as np

    cells = groups(runs, [down, across])
    rows, columns = (list(dict.fromkeys(key[i] for key in cells)) for i in (0, 1))
    colours = np.full((len(rows), len(columns)), np.nan)
    figure = _figure(2.0 + 0.9 * len(columns), 1.4 + 0.5 * len(rows))
    axes = figure.subplots()
    for (row, column), found in cells.items():
        i, j = rows.index(row), columns.index(column)
        values = [abs(x) for one in found if not math.isnan(x := number(one[COLUMN]))]
        if values:
            colours[i, j] = 100 * median(values)
        done = sum(one["verdict"] == "done" for one in found)
        axes.text(j, i, f"{done}/{len(found)}", ha="center", va="center", fontsize=7)
    image = axes.imshow(colours, aspect="auto", cmap="viridis_r")
    figure.colorbar(image, label="median end offset (cm); numbers: done of all")
    axes.set_xticks(range(len(columns)), [_short(c) for c in columns], rotation=30, ha="right", fontsize=7)
    axes.set_yticks(range(len(rows)), [_short(r) for r in rows], fontsize=7)
    axes.set_xlabel(across, fontsize=8)
    axes.set_ylabel(down, fontsize=8)
    figure.suptitle(title, fontsize=9)
    return figure


def survival(runs: Runs, key: str, title: str) -> Figure:
    """Draw which share of the pushes was still going after each distance, a line for each value of a column.

    A push that reached its distance has not ended by itself: its line goes on.
    """
    figure = _figure(7.0, 3.2)
    axes = figure.subplots()
    for (value,), rows in list(groups(runs, [key]).items())[:MOST_PANELS]:
        ways, shares = survivors(rows)
        axes.step(ways, shares, where="post", label=_short(value))
    axes.set_ylim(-0.02, 1.05)
    axes.set_xlabel("distance (m)")
    axes.set_ylabel("share still pushed")
    axes.legend(title=key, fontsize=7, title_fontsize=7)
    figure.suptitle(title, fontsize=10)
    return figure


def survivors(rows: Sequence[dict[str, str]]) -> tuple[list[float], list[float]]:
    """Return the steps of the share still pushed: at 0 m all, less 1/n where one was lost or stopped."""
    ends = sorted(max(0.0, way) for row in rows if int(row["exit_code"]) not in (0, 9)
                  and not math.isnan(way := number(row["distance_m"])))  # fmt: skip
    reached = max((way for row in rows if not math.isnan(way := number(row["distance_m"]))), default=0.0)
    unknown = sum(math.isnan(number(row["distance_m"])) for row in rows)
    left, ways, shares = len(rows) - unknown, [0.0], [(len(rows) - unknown) / len(rows)]
    for way in ends:
        left -= 1
        ways.append(way)
        shares.append(left / len(rows))
    return [*ways, max(reached, ways[-1])], [*shares, shares[-1]]


def draw_all(runs: Runs, kept: dict[int, Floats], axes: Sequence[str], folder: Path, name: str) -> list[str]:
    """Draw every figure that the axes give; return the names of the files. axes: the listed ones."""
    several = [axis for axis in axes if len(groups(runs, [axis])) > 1]
    key = next((axis for axis in several if axis == "control.law"), several[0] if several else "law")
    title = f"{name}: {len(runs.rows)} pushes"
    files = [save(courses(runs, kept, key, title), folder, "trajectories")]
    files.append(save(survival(runs, key, title), folder, "survival"))
    if len(several) > 1:
        down, across = key, next(axis for axis in several if axis != key)
        files.append(save(heat_map(runs, down, across, title), folder, "heat-map"))
    return files


def _short(text: str) -> str:
    return text if len(text) <= 28 else text[:27] + "."


def _figure(width_in: float, height_in: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure
