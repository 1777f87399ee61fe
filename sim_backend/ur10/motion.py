"""How the emulated arm moves: the world's joints, plus drift, plus the motion commanded by a program.

Not modelled: joint dynamics, Cartesian motion (moveL, speedL), collisions. A servo target is followed with
first-order lag, a joint move runs at constant speed along the straight line in joint space.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from robot_io.messages import Joints
from sim_backend.world.plant import ArmTruth

SERVO_LAG_S = 0.03
STEADY_RAD_PER_S = 0.001


class ArmMotion:
    """Joint angles (rad) after each controller cycle; `offset` is the arm's deviation from the world's joints.

    range_rad: how far each joint turns either way.
    """

    def __init__(self, range_rad: Joints) -> None:
        self._range_rad = range_rad
        self.offset = [0.0] * 6
        self.drift_rate = [0.0] * 6
        """Drift of each joint (rad/s), for fault injection."""
        self.actual: Joints = (0.0,) * 6
        self.velocity: Joints = (0.0,) * 6
        self.target: Joints = (0.0,) * 6
        self.moving = False
        """Whether a joint move is in progress."""
        self._advance: Callable[[Joints, float], Sequence[float]] | None = None

    @property
    def steady(self) -> bool:
        """Return whether every joint is at rest."""
        return all(abs(v) < STEADY_RAD_PER_S for v in self.velocity)

    def hold(self) -> None:
        """Hold the current position."""
        self._advance = None
        self.moving = False

    def servo(self, target: Joints) -> None:
        """Follow `target` until the next command."""
        target = self._within_range(target)

        def follow(base: Joints, dt_s: float) -> Sequence[float]:
            share = 1.0 - math.exp(-dt_s / SERVO_LAG_S)
            return [(target[i] - base[i] - self.offset[i]) * share for i in range(6)]

        self.moving = False
        self._advance = follow

    def speed(self, rates: Joints) -> None:
        """Turn each joint at the given rate (rad/s) until the next command."""
        self.moving = False
        self._advance = lambda _base, dt_s: [rate * dt_s for rate in rates]

    def move(self, target: Joints, speed_rad_per_s: float) -> None:
        """Go to `target` with the leading joint at `speed_rad_per_s`; `moving` until arrived."""
        target = self._within_range(target)

        def straight(base: Joints, dt_s: float) -> Sequence[float]:
            left = [target[i] - base[i] - self.offset[i] for i in range(6)]
            longest = max(abs(x) for x in left)
            step = max(0.01, speed_rad_per_s) * dt_s  # 0.01 for NaN as well
            if longest <= step:
                self.hold()
                return left
            return [x * step / longest for x in left]

        self.moving = True
        self._advance = straight

    def step(self, base: ArmTruth, dt_s: float) -> None:
        """Advance by one controller cycle."""
        commanded = self._advance(base.position, dt_s) if self._advance is not None else (0.0,) * 6
        rates = []
        for i in range(6):
            change = commanded[i] + self.drift_rate[i] * dt_s
            wanted = base.position[i] + self.offset[i] + change
            if (reached := _in_range(wanted, self._range_rad[i])) != wanted:
                change = reached - base.position[i] - self.offset[i]
            self.offset[i] += change
            rates.append(base.velocity[i] + change / dt_s)
        self.velocity = _joints(rates)
        self.actual = self.target = _joints([base.position[i] + self.offset[i] for i in range(6)])

    def _within_range(self, target: Joints) -> Joints:
        return _joints([_in_range(q, limit) for q, limit in zip(target, self._range_rad, strict=True)])


def _in_range(q: float, limit: float) -> float:
    """Return `q` (rad), or the end of the joint's range when it lies beyond; clients command infinity and NaN too."""
    if math.isfinite(q) and abs(q) <= limit:
        return q
    return math.copysign(min(limit, 2.0 * math.pi), q)


def _joints(values: Sequence[float]) -> Joints:
    a, b, c, d, e, f = values
    return (a, b, c, d, e, f)
