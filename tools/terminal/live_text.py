"""The text of the live line: what matters most comes first, and what does not fit is left out whole; pure."""

from __future__ import annotations

import math
from typing import Any

from robot_io.rig.config import RigConfig

USUAL_MODES = ("SILENT", "READY", "PUSHING")
"""Modes that say nothing beyond the phase."""
DROPPED_FIRST = ("theta_p", "speed", "offset")


def key_words(status: dict[str, Any]) -> str:
    """Return what the operator's keys do just now."""
    if status["paused"]:
        return "space goes on, other keys stop"
    if status["phase"] == "LOST_HOLD":
        return "r resumes, space pauses, others stop"
    return "space pauses, other keys stop"


def live_text(rig: RigConfig, status: dict[str, Any], *, keys: bool, silent_s: float, room: int | None) -> str:
    """Return the line for a status of control.

    keys: whether the operator's keys are heard. silent_s: how long ago control sent it, 0 where that is no matter.
    room: the most characters, None for all.
    """
    parts = _parts(rig, status)
    if silent_s:
        parts["head"] += f"  OLD: no news for {silent_s:.0f} s"
    if keys:
        parts["keys"] = key_words(status)
    order = ("head", "progress", "offset", "force", "keys", "speed", "theta_p")
    parts = {name: parts[name] for name in order if name in parts}
    for name in DROPPED_FIRST:
        if room is not None and len("  ".join(parts.values())) > room:
            del parts[name]
    return "  ".join(parts.values())[:room]


def _parts(rig: RigConfig, status: dict[str, Any]) -> dict[str, str]:
    # JSON has no NaN: a figure that is not known yet (no pose so far), or no number, is sent as null.
    status = {key: math.nan if value is None else value for key, value in status.items()}
    fx, fy, _ = (math.nan if value is None else value for value in status["force_N"])
    mode = "PAUSED" if status["paused"] else status["mode"]
    old = {name: " (old)" if name in status["old"] else "" for name in ("force", "pose")}
    return {
        "head": status["phase"] if mode in USUAL_MODES else f"{status['phase']} {mode}",
        "progress": f"{status['progress_m']:.2f}/{rig.control.distance_m:.2f} m{old['pose']}",
        "offset": f"off {status['lateral_m']:+.3f} m{old['pose']}",
        "force": f"{math.hypot(fx, fy):.1f}/{rig.limits.max_force_N:.0f} N{old['force']}",
        "speed": f"v {status['speed']:.2f} m/s",
        "theta_p": f"theta_p {math.degrees(status['theta_p']):+.1f} deg",
    }
