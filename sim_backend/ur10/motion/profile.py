"""How far along its way a move is: up to speed, along at speed, and down to rest. Pure."""

from __future__ import annotations

import math


class Profile:
    """A way of `length` covered with a speed and an acceleration, both in units of the way; or in `time_s` if given.

    Speeds and accelerations that are no positive number are taken as the smallest that moves.
    """

    def __init__(self, length: float, speed: float, acceleration: float, time_s: float = 0.0) -> None:
        self.length = length
        if time_s > 0.0 and math.isfinite(time_s):  # a third of the time to speed up and as much to slow down
            speed, acceleration = 1.5 * length / time_s, 4.5 * length / time_s**2
        acceleration = _usable(acceleration)
        speed = min(_usable(speed), math.sqrt(length * acceleration))
        self._acceleration = acceleration
        self._speed = speed
        self._ramp_s = speed / acceleration
        self.time_s = length / speed + self._ramp_s if length > 0.0 else 0.0

    def at(self, t_s: float) -> float:
        """Return the way covered after a time, 0..length."""
        if t_s >= self.time_s:
            return self.length
        if t_s < self._ramp_s:
            return 0.5 * self._acceleration * t_s * t_s
        left_s = self.time_s - t_s
        if left_s < self._ramp_s:
            return self.length - 0.5 * self._acceleration * left_s * left_s
        return self._speed * (t_s - 0.5 * self._ramp_s)


def _usable(value: float) -> float:
    return value if value > 0.01 and math.isfinite(value) else 0.01
