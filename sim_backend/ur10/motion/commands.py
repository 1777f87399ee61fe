"""What an arm can be told to do, each a command that gives the next joints from the present ones. Pure.

Not modelled: blends (a path rests at each of its points) and the joints' inertia (a stop is at once).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol

from robot_io.messages import Joints
from sim_backend.ur10.models import UrModel
from sim_backend.ur10.motion.kinematics import joints_at, tool_pose
from sim_backend.ur10.motion.profile import Profile
from sim_backend.ur10.motion.transforms import (
    Pose6,
    frame_of,
    matrix_of,
    pose_of,
    rotation_vector,
    times,
    transposed,
)

SERVO_LAG_S = 0.03
SERVO_LAG_LIMIT_S = 0.2
"""The range of servoj's `lookahead_time`."""


class OutOfReach(Exception):
    """The arm cannot bring its tool where a command wants it."""


class Command(Protocol):
    """What the arm follows until the next command."""

    moving: bool
    """Whether it is on a way with an end that is not reached yet."""

    def step(self, q: Joints, dt_s: float) -> Joints:
        """Return the joints (rad) a time later. Raises OutOfReach."""
        ...


class ServoCommand:
    """Follow a joint target with first-order lag, `lookahead_s` within servoj's range."""

    moving = False

    def __init__(self, target: Joints, lookahead_s: float = SERVO_LAG_S) -> None:
        self._target = target
        lag_s = lookahead_s if lookahead_s > SERVO_LAG_S else SERVO_LAG_S  # NaN as well
        self._lag_s = min(lag_s, SERVO_LAG_LIMIT_S)

    def step(self, q: Joints, dt_s: float) -> Joints:
        """See `Command.step`."""
        share = 1.0 - math.exp(-dt_s / self._lag_s)
        return joints([at + (to - at) * share for at, to in zip(q, self._target, strict=True)])


class SpeedCommand:
    """Turn each joint at a rate (rad/s), for `time_s` or, if 0, until the next command."""

    def __init__(self, rates: Joints, time_s: float = 0.0) -> None:
        self._rates = rates
        self._left_s = time_s if time_s > 0.0 else math.inf
        self.moving = time_s > 0.0

    def step(self, q: Joints, dt_s: float) -> Joints:
        """See `Command.step`."""
        if self._left_s <= 0.0:
            self.moving = False
            return q
        self._left_s -= dt_s
        return joints([at + rate * dt_s for at, rate in zip(q, self._rates, strict=True)])


class ToolSpeedCommand:
    """Move the tool at a velocity in the base frame: m/s, and rad/s about its axes; for `time_s` as `SpeedCommand`."""

    def __init__(self, velocity: Pose6, model: UrModel, tcp: Pose6, time_s: float = 0.0) -> None:
        self.velocity = velocity
        self._model = model
        self._tcp = tcp
        self._left_s = time_s if time_s > 0.0 else math.inf
        self.moving = time_s > 0.0
        self._pose: Pose6 | None = None

    def step(self, q: Joints, dt_s: float) -> Joints:
        """See `Command.step`."""
        if self._left_s <= 0.0:
            self.moving = False
            return q
        self._left_s -= dt_s
        x, y, z, *_ = pose = self._pose or tool_pose(q, self._model, self._tcp)
        vx, vy, vz, wx, wy, wz = self.velocity
        turned = times(matrix_of((wx * dt_s, wy * dt_s, wz * dt_s)), frame_of(pose)[0])
        self._pose = pose_of((turned, (x + vx * dt_s, y + vy * dt_s, z + vz * dt_s)))
        return _reached(self._pose, q, self._model, self._tcp)


class MoveCommand:
    """Go along one leg after the other, each with a profile of its own."""

    def __init__(self, legs: Sequence[Callable[[Joints], Leg]]) -> None:
        self._legs = list(legs)
        self._leg: Leg | None = None
        self._t_s = 0.0
        self.moving = bool(legs)
        self.done_legs = 0

    def step(self, q: Joints, dt_s: float) -> Joints:
        """See `Command.step`."""
        if self._leg is None:
            if not self._legs:
                return q
            self._leg = self._legs.pop(0)(q)
            self._t_s = 0.0
        self._t_s += dt_s
        profile = self._leg.profile
        q = self._leg.joints(profile.at(self._t_s) / profile.length if profile.length > 0.0 else 1.0, q)
        if self._t_s >= profile.time_s:
            self._leg = None
            self.done_legs += 1
            self.moving = bool(self._legs)
        return q


class Leg(Protocol):
    """One way from here to there."""

    profile: Profile

    def joints(self, share: float, q: Joints) -> Joints:
        """Return the joints at a share of the way (0..1), coming from `q`. Raises OutOfReach."""
        ...


class JointLeg:
    """Straight in joint space; speed and acceleration (rad/s, rad/s2) are those of the joint that goes furthest."""

    def __init__(self, start: Joints, end: Joints, speed: float, acceleration: float, time_s: float = 0.0) -> None:
        self._start, self._end = start, end
        furthest = max(abs(b - a) for a, b in zip(start, end, strict=True))
        self.profile = Profile(furthest, speed, acceleration, time_s)

    def joints(self, share: float, q: Joints) -> Joints:
        """See `Leg.joints`."""
        if share >= 1.0:
            return self._end
        return joints([a + (b - a) * share for a, b in zip(self._start, self._end, strict=True)])


class ToolLeg:
    """Straight for the tool's centre point, turning about one axis; m/s and m/s2, or rad where it only turns."""

    def __init__(self, start: Pose6, end: Pose6, model: UrModel, tcp: Pose6, way: tuple[float, float, float]) -> None:
        speed, acceleration, time_s = way
        self._start, self._end = start, end
        self._model, self._tcp = model, tcp
        self._from = frame_of(start)[0]
        self._turn = rotation_vector(times(frame_of(end)[0], transposed(self._from)))
        length = math.dist(start[:3], end[:3])
        self.profile = Profile(length if length > 1e-6 else math.hypot(*self._turn), speed, acceleration, time_s)

    def joints(self, share: float, q: Joints) -> Joints:
        """See `Leg.joints`."""
        if share >= 1.0:
            return _reached(self._end, q, self._model, self._tcp)
        rx, ry, rz = (angle * share for angle in self._turn)
        x, y, z = (a + (b - a) * share for a, b in zip(self._start[:3], self._end[:3], strict=True))
        return _reached(pose_of((times(matrix_of((rx, ry, rz)), self._from), (x, y, z))), q, self._model, self._tcp)


def joints(values: Sequence[float]) -> Joints:
    """Return six values as joints."""
    a, b, c, d, e, f = values
    return (a, b, c, d, e, f)


def _reached(pose: Pose6, near: Joints, model: UrModel, tcp: Pose6) -> Joints:
    q = joints_at(pose, near, model, tcp)
    if q is None:
        raise OutOfReach
    return q
