"""What each figure of a run shows, in words and numbers: for readers who cannot see it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robot_io.tick import Mode, Phase
from tools.report.bounded_series import Floats
from tools.report.drawing.plan_view import RunInPlan
from tools.report.run_data import RunData

MOST_FAULTS = 5


def alt_texts(run: RunData) -> dict[str, str]:
    """Return a text for each figure, by its name."""
    if not len(run.ticks["t_s"]):
        return dict.fromkeys(("trajectory", "force", "speed", "tracking", "timing", "safety"), "This log has no ticks.")
    pushing = run.ticks["phase"] == Phase.PUSH
    return {
        "trajectory": _trajectory(run, pushing),
        "force": _force(run, pushing),
        "speed": _speed(run, pushing),
        "tracking": _tracking(run, pushing),
        "timing": _timing(run),
        "safety": _safety(run),
    }


def _trajectory(run: RunData, pushing: NDArray[np.bool_]) -> str:
    place = RunInPlan(run)
    marks = place.marks()
    if not marks:
        return "From above: the object was not touched."
    start, end = marks[0], marks[-1]
    text = (
        f"From above: the contact point goes from {place.y[start]:+.3f} m beside the path to {place.y[end]:+.3f} m "
        f"after {place.x[end] - place.x[start]:.2f} m, "
        f"{_span(run.ticks['lateral_m'][pushing], 'm', '+.3f')} while pushing"
    )
    _, _, left, yaw = place.slider()
    seen = np.flatnonzero(np.isfinite(left) & np.isfinite(yaw))
    if not len(seen):
        return f"{text}; the object was not seen."
    turned = math.degrees(float(yaw[seen[-1]] - yaw[seen[0]]))
    return f"{text}; the object's centre ends at {left[seen[-1]]:+.3f} m, turned by {turned:+.0f} degrees."


def _force(run: RunData, pushing: NDArray[np.bool_]) -> str:
    size = np.hypot(run.ticks["force_x"], run.ticks["force_y"])[pushing]
    return (
        f"Force on the object: {_span(size, 'N', '.1f')} while pushing, median {_median(size):.1f} N; the greatest raw "
        f"reading is {_greatest(run.ticks['force_raw']):.1f} N, the limit {run.rig.limits.max_force_N:g} N."
    )


def _speed(run: RunData, pushing: NDArray[np.bool_]) -> str:
    wanted = run.rig.control.push_speed_m_per_s
    measured = _median(run.ticks["speed_measured"][pushing])
    return f"Speed of the base: median {measured:.3f} m/s while pushing, {wanted:g} m/s are set."


def _tracking(run: RunData, pushing: NDArray[np.bool_]) -> str:
    force, push = (np.degrees(run.ticks[name][pushing]) for name in ("theta_f", "theta_p"))
    heading = np.degrees(run.ticks["heading_error"])
    return (
        f"While pushing the contact point is {_span(run.ticks['lateral_m'][pushing], 'm', '+.3f')} left of the path, "
        f"the force {_span(force, 'degrees', '+.0f')} and the push {_span(push, 'degrees', '+.0f')} from it; the "
        f"base's heading is off by at most {_greatest(np.abs(heading)):.2f} degrees."
    )


def _timing(run: RunData) -> str:
    late = run.late
    if not late.total or late.worst_ms == 0.0:
        return "No tick was late: this run used a virtual clock."
    return (
        f"Lateness of {late.total} ticks: median {late.percentile_ms(50):.2f} ms, 99 % below "
        f"{late.percentile_ms(99):.2f} ms, worst {late.worst_ms:.2f} ms; {run.skipped} ticks were skipped."
    )


def _safety(run: RunData) -> str:
    known = {str(int(mode)): mode.name for mode in Mode}
    modes = dict.fromkeys(known[span.name] for span in run.modes if span.name in known)
    names = list(dict.fromkeys(span.name for span in run.faults))
    shown = [f"{name} at {next(s.begin_s for s in run.faults if s.name == name):.1f} s" for name in names[:MOST_FAULTS]]
    more = f" and {len(names) - MOST_FAULTS} more" if len(names) > MOST_FAULTS else ""
    faults = f"faults: {', '.join(shown)}{more}" if shown else "no fault"
    return f"Modes: {', '.join(modes).lower() or 'none'}; {faults}."


def _span(values: Floats, unit: str, form: str) -> str:
    finite = values[np.isfinite(values)]
    return f"{finite.min():{form}} to {finite.max():{form}} {unit}" if len(finite) else "unknown"


def _median(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else math.nan


def _greatest(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else math.nan
