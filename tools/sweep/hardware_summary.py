"""Summarise the simulated experiment and compare it with the paper's real one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING, Any

from tools.parallel.part import Row
from tools.sweep.hardware import CORRIDOR_M, DISTANCE_M, OPEN_LOOP_FAILS_M, SLIDERS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def summarise_hardware(rows: Sequence[Row], states: Floats) -> dict[str, Any]:
    """Return the figures behind the paper's claims for each slider, and the runs in which this model differs.

    `states`: (runs, kept, 3), the slider's pose, NaN after a run's end.
    """
    sliders: dict[str, Any] = {}
    differing: list[str] = []
    for slider in SLIDERS:
        closed = [r for r in rows if r["slider"] == slider and r["controller"] == "force"]
        opened = [r for r in rows if r["slider"] == slider and r["controller"] == "open-loop"]
        inside = [r for r in closed if r["code"] == "done" and float(r["max_abs_y_m"]) < CORRIDOR_M]
        lost = [r for r in opened if r["code"] == "lost" and float(r["distance_m"]) < OPEN_LOOP_FAILS_M]
        sliders[slider] = {
            "closed_loop_runs": len(closed),
            "closed_loop_done": sum(r["code"] == "done" for r in closed),
            "closed_loop_inside_corridor": len(inside),
            "closed_loop_max_abs_y_m": _greatest(closed, "max_abs_y_m"),
            "closed_loop_max_abs_final_y_c_m": _greatest(closed, "lateral_error_m"),
            "closed_loop_weave_growth": _median(
                [_growth(states[i]) for i, r in enumerate(rows) if r in closed and r["code"] == "done"]
            ),
            "open_loop_runs": len(opened),
            "open_loop_lost_within_2_m": len(lost),
            "open_loop_lost_after_m": sorted(float(r["distance_m"]) for r in opened if r["code"] == "lost"),
        }
        for row in closed:
            if row not in inside:
                differing.append(
                    f"{slider}, run {row['run']}: {row['code']}, maximum |y| {_two_decimals(row, 'max_abs_y_m')} m "
                    f"(start {float(row['edge_offset_m']):+.3f} m off the middle)"
                )
        for row in opened:
            if row not in lost:
                differing.append(
                    f"{slider}, open-loop run {row['run']}: {row['code']} after {_two_decimals(row, 'distance_m')} m "
                    f"(start {float(row['edge_offset_m']):+.3f} m off the middle)"
                )
    return {"study": "hardware", "runs": len(rows), "sliders": sliders, "otherwise_than_the_paper": differing}


def hardware_sentences(summary: dict[str, Any]) -> list[str]:
    """Return the summary as readable lines."""
    lines = []
    for slider, s in summary["sliders"].items():
        lines.append(
            f"{slider}: {s['closed_loop_inside_corridor']} of {s['closed_loop_runs']} pushes reach {DISTANCE_M:g} m "
            f"inside the 1 m corridor; open loop loses the object within {OPEN_LOOP_FAILS_M:g} m in "
            f"{s['open_loop_lost_within_2_m']} of {s['open_loop_runs']} "
            f"(after {', '.join(f'{d:.2f}' for d in s['open_loop_lost_after_m'])} m)"
        )
        if (growth := s["closed_loop_weave_growth"]) is not None and growth > 1:
            lines.append(
                f"  the oscillation grows: |y| reaches {growth:.2f} times as far in the second half as in the "
                "first (median); `push tune` gives gains that settle"
            )
    return [*lines, *(f"  unlike the paper: {line}" for line in summary["otherwise_than_the_paper"])]


def _growth(poses: Floats) -> float:
    """Return the ratio of maximum |y| in the second half of the push to that in the first half."""
    x, y = poses[:, 0], abs(poses[:, 1])
    start = x[0]
    middle = start + DISTANCE_M / 2
    return float(y[x > middle].max() / y[x <= middle].max())


def _median(values: Sequence[float]) -> float | None:
    return median(values) if values else None


def _greatest(rows: Sequence[Row], key: str) -> float | None:
    values = [abs(float(row[key])) for row in rows if key in row]
    return max(values, default=None)


def _two_decimals(row: Row, key: str) -> str:
    return f"{float(row[key]):.2f}" if key in row and math.isfinite(float(row[key])) else "-"
