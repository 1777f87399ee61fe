"""Summarise a study: how its lanes ended, and the distributions behind the word "converged"."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING, Any

from sim_backend.physics.lanes import LaneEnd
from tools.parallel.part import Row
from tools.sweep.grid import Case, Study

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

CONVERGED_M = 0.05
"""A lane counts as converged when |y| and |y_c| end below this (the response is a slow, damped oscillation) ..."""
CONVERGED_HEADING_DEG = 1.0
"""... and the slider's centre moved in a direction this close to the path's over the last recorded interval."""


def summarise(study: Study, rows: Sequence[Row], states: Floats) -> dict[str, Any]:
    """Return the outcome per shape. `states` has shape (cases, records, 6), NaN after a lane's end."""
    shapes = {}
    for shape in dict.fromkeys(case.shape for case in study.cases):
        chosen = [i for i, case in enumerate(study.cases) if case.shape == shape]
        shapes[shape] = _outcome(study, chosen, rows, states)
    return {
        "study": study.name,
        "lanes": len(study.cases),
        "steps": sum(int(row["steps"]) for row in rows),
        "converged_when": f"|y|, |y_c| < {CONVERGED_M} m and heading < {CONVERGED_HEADING_DEG} degree at the end",
        "converged": sum(outcome["converged"] for outcome in shapes.values()),
        "shapes": shapes,
    }


def sentences(summary: dict[str, Any]) -> list[str]:
    """Return the summary as readable lines."""
    lines = [f"{summary['converged']} of {summary['lanes']} lanes converged ({summary['converged_when']})"]
    for shape, outcome in summary["shapes"].items():
        ended = ", ".join(f"{count} {code}" for code, count in outcome["ended"].items() if count)
        lines.append(f"{shape}: {outcome['lanes']} lanes, {ended}")
        for name, unit in (
            ("final_abs_y", "m"),
            ("final_abs_y_c", "m"),
            ("final_abs_heading", "deg"),
            ("max_abs_y", "m"),
            ("max_abs_theta_p", "deg"),
            ("lost_after", "m"),
        ):
            values = outcome[f"{name}_{unit}"]
            if values is not None:
                figures = ", ".join(f"{key} {value:.4g}" for key, value in values.items())
                lines.append(f"  {name.replace('_', ' ')}: {figures} {unit}")
    return lines


def _outcome(study: Study, chosen: list[int], rows: Sequence[Row], states: Floats) -> dict[str, Any]:
    codes = [end.name.lower() for end in LaneEnd]
    done = [i for i in chosen if rows[i]["code"] == "ok"]
    lost = [i for i in chosen if rows[i]["code"] in ("edge", "pull")]
    y = [abs(float(rows[i]["y"])) for i in done]
    y_c = [abs(contact_y(study.cases[i], rows[i])) for i in done]
    heading = [abs(_heading_deg(states[i])) for i in done]
    return {
        "lanes": len(chosen),
        "ended": {code: sum(rows[i]["code"] == code for i in chosen) for code in codes},
        "converged": sum(
            a < CONVERGED_M and b < CONVERGED_M and h < CONVERGED_HEADING_DEG
            for a, b, h in zip(y, y_c, heading, strict=True)
        ),
        "final_abs_y_m": spread(y),
        "final_abs_y_c_m": spread(y_c),
        "final_abs_heading_deg": spread(heading),
        "max_abs_y_m": spread([float(rows[i]["max_abs_y"]) for i in done]),
        "max_abs_theta_p_deg": spread([math.degrees(float(rows[i]["max_abs_theta_p"])) for i in done]),
        "lost_after_m": spread(
            [int(rows[i]["steps"]) * study.timing.dt_s * study.cases[i].speed_m_per_s for i in lost]
        ),
    }


def contact_y(case: Case, row: Row) -> float:
    """Return the lateral position of the contact at a lane's end (m)."""
    y, phi, s = float(row["y"]), float(row["phi"]), float(row["s"])
    if case.shape == "circle":
        return y - case.radius_m * math.sin(phi - s / case.radius_m)
    return y - case.length_m / 2 * math.sin(phi) + s * math.cos(phi)


def _heading_deg(states: Floats) -> float:
    """Return the direction of the centre's last recorded move (0 if only one state was recorded)."""
    if len(states) < 2:
        return 0.0
    dx, dy = (states[-1] - states[-2])[:2].tolist()
    return math.degrees(math.atan2(dy, dx))


def spread(values: Sequence[float]) -> dict[str, float] | None:
    """Return median, 90th percentile and maximum of some values, None if there are none."""
    if not values:
        return None
    ordered = sorted(values)
    return {"median": median(ordered), "p90": ordered[math.ceil(0.9 * len(ordered)) - 1], "max": ordered[-1]}
