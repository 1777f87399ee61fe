"""How a push ran beside its path and how often it lost the object: what the verdict needs of all its ticks."""

from __future__ import annotations

import math

from robot_io.tick import Phase

FROM_CONTACT = (Phase.PUSH, Phase.LOST, Phase.LOST_HOLD, Phase.REST)
"""From first contact until the base has come to rest: the retreat is not part of the push."""
WITHOUT_CONTACT = (Phase.LOST, Phase.LOST_HOLD)


class PushCourse:
    """Follows a push tick by tick; lengths in m, offsets in the PATH frame.

    start_lateral_m: offset of the contact ball at first contact, NaN before it. worst_lateral_m: the largest offset
    since, with its sign. lost_times: how often contact was lost.
    """

    def __init__(self) -> None:
        self.start_lateral_m = math.nan
        self.worst_lateral_m = math.nan
        self.lost_times = 0
        self._regained_m = 0.0
        self._lost_from_m = math.nan
        self._lost_now_m = 0.0

    @property
    def lost_m(self) -> float:
        """Way along the path without contact. Each loss counts from end to end, so that a noisy pose adds nothing."""
        return self._regained_m + self._lost_now_m

    def note(self, phase: int, progress_m: float, lateral_m: float) -> None:
        """Follow one tick: the phase after it, progress along the path since first contact, and lateral offset."""
        if phase not in FROM_CONTACT or not (math.isfinite(progress_m) and math.isfinite(lateral_m)):
            return
        if phase == Phase.PUSH and math.isnan(self.start_lateral_m):
            self.start_lateral_m = self.worst_lateral_m = lateral_m
        if abs(lateral_m) > abs(self.worst_lateral_m):
            self.worst_lateral_m = lateral_m
        if phase in WITHOUT_CONTACT and math.isfinite(self.start_lateral_m):
            if math.isnan(self._lost_from_m):
                self._lost_from_m = progress_m
                self.lost_times += 1
            self._lost_now_m = max(0.0, progress_m - self._lost_from_m)
        elif math.isfinite(self._lost_from_m):
            self._regained_m += self._lost_now_m
            self._lost_from_m, self._lost_now_m = math.nan, 0.0

    def figures(self) -> dict[str, object]:
        """Return what was found, None where there was no contact."""
        seen = math.isfinite(self.start_lateral_m)
        return {
            "start_lateral_m": self.start_lateral_m if seen else None,
            "worst_lateral_m": self.worst_lateral_m if seen else None,
            "lost_m": self.lost_m,
            "lost_times": self.lost_times,
        }
