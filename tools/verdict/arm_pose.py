"""Where the arm was when it was refused: which joint is off the rig's held pose, by how much, and by how many turns."""

from __future__ import annotations

import math
from typing import Any

from robot_io.rig.config import RigConfig

NOT_AT_ITS_POSE = "R04"
JOINTS = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")


def arm_pose_notes(rig: RigConfig, figures: dict[str, Any]) -> list[str]:
    """Return a sentence for each joint that a run was refused for (R04), none for any other end."""
    if NOT_AT_ITS_POSE not in figures["faults"]:
        return []
    held, tolerance = rig.arm.held_pose_rad, rig.arm.held_pose_tolerance_rad
    return [
        f"arm joint {number} ({JOINTS[number - 1]}) is at {at:.4f} rad, the rig's held pose has {wanted:.4f} rad: "
        f"{_apart(at - wanted, tolerance)}"
        for number, (at, wanted) in enumerate(zip(figures["joints_rad"], held, strict=True), 1)
        if at is not None and abs(at - wanted) > tolerance
    ]


def whole_turns(off_rad: float) -> int:
    """Return by how many whole turns a joint is off, to the nearest."""
    return round(off_rad / math.tau)


def _apart(off: float, tolerance: float) -> str:
    turns = whole_turns(off)
    if turns and abs(off - turns * math.tau) <= tolerance:
        whole = "one whole turn" if abs(turns) == 1 else f"{abs(turns)} whole turns"
        return f"{whole} away, so it looks right; turn it back at the teach pendant (its cable is wound up)"
    return f"{off:+.4f} rad away, {tolerance:g} rad are allowed"
