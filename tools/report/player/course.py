"""The course of a push for the page's player: where everything was, ten times a second, as small as it can be."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from robot_io.tick import Phase
from tools.report.bounded_series import Floats
from tools.report.drawing.plan_view import RunInPlan, outline
from tools.report.run_data import RunData

RATE_HZ = 10.0
MOST_FRAMES = 6000


def course(run: RunData) -> dict[str, Any]:
    """Return the course of a run: lists of equal length over time (s, m, rad, N, m/s; null where unknown), in the plan.

    Frame: x along the path from first contact, y to its left. An empty dict where nothing can be played.
    """
    ticks, place = run.ticks, RunInPlan(run)
    if len(ticks["t_s"]) < 2 or not np.isfinite(place.x).any():
        return {}
    begin_s, end_s = float(ticks["t_s"][0]), float(ticks["t_s"][-1])
    frames = min(MOST_FRAMES, max(2, round((end_s - begin_s) * RATE_HZ) + 1))
    times = np.linspace(begin_s, end_s, frames)
    at = np.clip(np.searchsorted(ticks["t_s"], times), 0, len(ticks["t_s"]) - 1)
    seen_s, object_x, object_y, object_yaw = place.slider()
    rows: dict[str, list[Any]] = {
        "t": _rounded(times, 2),
        "x": _rounded(place.x[at], 3),
        "y": _rounded(place.y[at], 3),
        "fx": _rounded(ticks["force_x"][at], 1),
        "fy": _rounded(ticks["force_y"][at], 1),
        "theta_f": _rounded(np.degrees(ticks["theta_f"][at]), 1),
        "theta_p": _rounded(np.degrees(ticks["theta_p"][at]), 1),
        "v": _rounded(ticks["speed_measured"][at], 3),
        "phase": [int(phase) for phase in ticks["phase"][at]],
    }
    if len(seen_s):
        near = np.clip(np.searchsorted(seen_s, times), 0, len(seen_s) - 1)
        rows |= {
            "ox": _rounded(object_x[near], 3),
            "oy": _rounded(object_y[near], 3),
            "oyaw": _rounded(object_yaw[near], 3),
        }
    pushed = np.flatnonzero(ticks["phase"] == Phase.PUSH)
    real = run.rig.base.level == "hardware"
    return {
        "rows": rows,
        "first_contact_s": float(ticks["t_s"][pushed[0] if len(pushed) else 0]),
        "phases": {int(phase): phase.name.lower().replace("_", " ") for phase in Phase},
        "outline": [[round(x, 4), round(y, 4)] for x, y in outline(run) or []],
        "ball_m": 0.0 if real else run.rig.world.ball_radius_m,
        "corridor_m": run.rig.goal.corridor_m,
        "distance_m": run.rig.control.distance_m,
    }


def as_json(value: dict[str, Any]) -> str:
    """Return a value as JSON that can stand in a page's script element."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _rounded(values: Floats, digits: int) -> list[float | int | None]:
    """Return numbers as short as they may be; null where there is none."""
    found: list[float | int | None] = []
    for value in np.round(values, digits).tolist():
        finite = value == value and abs(value) < 1e9
        found.append((int(value) if value == int(value) else value) if finite else None)
    return found
