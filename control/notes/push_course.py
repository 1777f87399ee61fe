"""How a push ran beside its path: what the verdict needs of all its ticks."""

from __future__ import annotations

import math

from robot_io.tick import Phase

FROM_CONTACT = (Phase.PUSH, Phase.LOST, Phase.LOST_HOLD, Phase.REST)
"""From first contact until the base has come to rest: the retreat is not part of the push."""


class PushCourse:
    """Follows a push tick by tick; offsets of the contact ball from the path in m, left positive.

    start_lateral_m: the offset at first contact, NaN before it. worst_lateral_m: the largest since, with its sign.
    worst_force_N: the largest horizontal force on the object since then, as the law sees it; NaN before it.
    """

    def __init__(self) -> None:
        self.start_lateral_m = math.nan
        self.worst_lateral_m = self.worst_force_N = math.nan

    def note(self, phase: int, lateral_m: float, force_N: float = math.nan) -> None:
        """Follow one tick: the phase, the offset and the horizontal force after it."""
        if phase in FROM_CONTACT and math.isfinite(force_N):
            self.worst_force_N = force_N if math.isnan(self.worst_force_N) else max(self.worst_force_N, force_N)
        if phase not in FROM_CONTACT or not math.isfinite(lateral_m):
            return
        if phase == Phase.PUSH and math.isnan(self.start_lateral_m):
            self.start_lateral_m = self.worst_lateral_m = lateral_m
        if abs(lateral_m) > abs(self.worst_lateral_m):
            self.worst_lateral_m = lateral_m

    def figures(self) -> dict[str, object]:
        """Return what was found, None where there was no contact."""
        seen = math.isfinite(self.start_lateral_m)
        return {
            "start_lateral_m": self.start_lateral_m if seen else None,
            "worst_lateral_m": self.worst_lateral_m if seen else None,
            "worst_force_N": self.worst_force_N if seen and math.isfinite(self.worst_force_N) else None,
        }
