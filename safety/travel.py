"""How far the base has travelled, as sent and as measured, and how long it has moved since its first motion; pure.

A pose is not asked: this is the end of every push that no pose can take away. Noise of odometry at rest does not
count, since its speed is smoothed first and only speeds above MOVING_M_PER_S count.
"""

from __future__ import annotations

import math

import msgspec
from msgspec.structs import replace

from robot_io.messages import BodyTwist

MOVING_M_PER_S = 0.01
SMOOTHING_S = 0.2
"""Time constant for the measured speed: 10 mm/s of white noise at 50 Hz become 2 mm/s."""


class Travel(msgspec.Struct, frozen=True, gc=False):
    """Distances in m, the smoothed measured speed in m/s (BODY frame), times in ns (CLOCK_MONOTONIC)."""

    began: bool = False
    """Whether motion has been sent yet: what a joystick did before is not ours."""
    at_ns: int = 0
    sent_m: float = 0.0
    measured_m: float = 0.0
    moving_ns: int = 0
    vx: float = 0.0
    vy: float = 0.0
    measured_ns: int = 0

    @property
    def distance_m(self) -> float:
        """The longer of both ways."""
        return max(self.sent_m, self.measured_m)

    def on_speed(self, twist: BodyTwist, received_ns: int) -> Travel:
        """Take in a measured speed; one that is not finite is left out (it is a fault of its own, F35)."""
        if not (math.isfinite(twist.vx) and math.isfinite(twist.vy)):
            return self
        share = min(max(received_ns - self.measured_ns, 0) * 1e-9 / SMOOTHING_S, 1.0)
        vx, vy = self.vx + share * (twist.vx - self.vx), self.vy + share * (twist.vy - self.vy)
        return replace(self, vx=vx, vy=vy, measured_ns=received_ns)

    def on_time(self, now_ns: int, sent: BodyTwist) -> Travel:
        """Count the time up to `now_ns`, through which `sent` was the command in effect."""
        if not self.began:
            return replace(self, began=sent != BodyTwist(), at_ns=now_ns)
        time_ns = max(now_ns - self.at_ns, 0)
        sent_speed, speed = math.hypot(sent.vx, sent.vy), math.hypot(self.vx, self.vy)
        sending, moving = sent_speed > MOVING_M_PER_S, speed > MOVING_M_PER_S
        return replace(
            self,
            at_ns=now_ns,
            sent_m=self.sent_m + (sent_speed * time_ns * 1e-9 if sending else 0.0),
            measured_m=self.measured_m + (speed * time_ns * 1e-9 if moving else 0.0),
            moving_ns=self.moving_ns + (time_ns if sending or moving else 0),
        )
