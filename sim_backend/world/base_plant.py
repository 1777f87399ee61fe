"""The Ridgeback's wheels, deterministic: how the wheel controller executes the commands it receives.

Two clocks on one time axis, both fixed at the start: a 1 ms grid on which the pose is integrated, and the
controller's own tick of 25 Hz (times one plus `rate_error`, shifted by `tick_phase` of a period), which acts at
the first grid time that is not before it. At a tick the newest command that arrived by then is clamped to the
speed limits, or replaced by zero when it is older than 0.25 s, and approached within the acceleration limits, each
axis on its own. Between ticks the wheels hold that velocity: the real ones reach it within a tick, which is
negligible for the contact. The pose is integrated with the heading in the middle of each step; of the wheels' way over
the floor a share `slip` is lost, turning loses nothing.

A tick takes effect when the plant leaves its grid time, so a command that arrives at exactly that time still counts,
and the result does not depend on how the calls divide the time.
Figures: ridgeback_control (control.yaml, mecanum_drive_controller, melodic-devel).
"""

from __future__ import annotations

import math
from collections import deque

from robot_io.clock import NS_PER_MS, NS_PER_S
from robot_io.geometry import wrap_angle
from robot_io.messages import BodyTwist, Pose2D

GRID_NS = NS_PER_MS
TICK_RATE_HZ = 25.0
MAX_SPEED_M_PER_S = 1.1
MAX_TURN_RATE_RAD_PER_S = 2.0
MAX_SPEED_STEP_M_PER_S = 0.1
"""2.5 m/s^2 over a tick of 40 ms."""
MAX_TURN_RATE_STEP_RAD_PER_S = 0.04
"""1.0 rad/s^2 over a tick of 40 ms."""
COMMAND_TIMEOUT_NS = 250 * NS_PER_MS

_GRID_S = GRID_NS / NS_PER_S


def clamp(value: float, low: float, high: float) -> float:
    """Clamp as the controller does, min(max(low, x), high): NaN becomes `low`, which is full speed backwards."""
    raised = value if value > low else low
    return high if high < raised else raised


class BasePlant:
    """A Ridgeback that rolls over the floor: commands in, pose and velocity out.

    `start`: pose in the WORLD frame. `start_ns`: origin of both clocks. `tick_phase`: first tick after this fraction
    of a period, in [0, 1). `rate_error`: relative error of the controller's clock (0.0001: 25.0025 Hz).
    `slip`: share of the wheels' way that is lost, in [0, 1).
    """

    def __init__(
        self, start: Pose2D, start_ns: int, *, tick_phase: float = 0.0, rate_error: float = 0.0, slip: float = 0.0
    ) -> None:
        period_ns = NS_PER_S / (TICK_RATE_HZ * (1.0 + rate_error))
        self._tick_period_ns = period_ns
        self._tick_phase = tick_phase
        self._start_ns = start_ns
        self._tick = 0
        self._tick_due_ns = self._grid_time_of_tick(0)
        self._now_ns = start_ns
        self._start = start
        self.grip = 1.0 - slip
        """Share of the wheels' way that is not lost."""
        self._x, self._y, self._yaw = start.x, start.y, start.yaw
        self._velocity = BodyTwist()
        self._drivers_active = True
        self._target = BodyTwist()
        self._target_ns: int | None = None
        self._commands: deque[tuple[int, BodyTwist]] = deque()
        self._switches: deque[tuple[int, bool]] = deque()

    @property
    def now_ns(self) -> int:
        """The grid time up to which the plant has been stepped."""
        return self._now_ns

    @property
    def pose(self) -> Pose2D:
        """Pose in the WORLD frame."""
        return Pose2D(self._x, self._y, wrap_angle(self._yaw))

    @property
    def place(self) -> tuple[float, float, float]:
        """The pose as plain numbers: x, y in m, yaw in rad (not wrapped)."""
        return self._x, self._y, self._yaw

    @property
    def rolled(self) -> Pose2D:
        """The pose had the wheels not slipped, which is what they count."""
        start, grip = self._start, self.grip
        return Pose2D(start.x + (self._x - start.x) / grip, start.y + (self._y - start.y) / grip, wrap_angle(self._yaw))

    @property
    def velocity(self) -> BodyTwist:
        """Velocity of the wheels in the BODY frame."""
        return self._velocity

    @property
    def drivers_active(self) -> bool:
        """Return whether the motors are driven."""
        return self._drivers_active

    def command(self, twist: BodyTwist, arrival_ns: int) -> int:
        """Accept a command (BODY frame, NaN allowed); return the arrival time that counts.

        It acts at the first tick that is not before its arrival. An arrival in the past counts as now, because
        the past is not recomputed; arrival times must not decrease (ValueError).
        """
        arrival_ns = max(arrival_ns, self._now_ns)
        if self._commands and arrival_ns < self._commands[-1][0]:
            raise ValueError(f"command arrived before the previous one: {arrival_ns} < {self._commands[-1][0]}")
        self._commands.append((arrival_ns, twist))
        return arrival_ns

    def set_drivers(self, active: bool, at_ns: int) -> int:
        """Switch the motors at the first tick not before `at_ns`; return the time that counts.

        Without drivers the wheels are locked: they are at rest from that tick on, and start from rest afterwards.
        """
        at_ns = max(at_ns, self._now_ns)
        if self._switches and at_ns < self._switches[-1][0]:
            raise ValueError(f"drivers switched before the previous switch: {at_ns}")
        self._switches.append((at_ns, active))
        return at_ns

    def step_to(self, t_ns: int) -> None:
        """Step to the last grid time that is not after `t_ns`; an earlier time changes nothing."""
        while self._now_ns + GRID_NS <= t_ns:
            self.leave()
            self._integrate()
            self._now_ns += GRID_NS

    def leave(self) -> None:
        """Leave the present grid time: the controller's tick takes effect if it is due."""
        if self._now_ns >= self._tick_due_ns:
            self._control_tick()

    @property
    def steps_at_this_velocity(self) -> int:
        """How many grid steps from now on the wheels keep their velocity; to be asked on leaving a grid time."""
        return max(-((self._now_ns - self._tick_due_ns) // GRID_NS), 0)

    def roll_to(self, place: tuple[float, float, float], steps: int) -> None:
        """Accept where so many steps at the present velocity have brought the base, worked out elsewhere."""
        self._x, self._y, self._yaw = place
        self._now_ns += steps * GRID_NS

    def _grid_time_of_tick(self, tick: int) -> int:
        return self._start_ns + GRID_NS * math.ceil((tick + self._tick_phase) * self._tick_period_ns / GRID_NS)

    def _control_tick(self) -> None:
        tick_ns = self._tick_due_ns
        self._tick += 1
        self._tick_due_ns = self._grid_time_of_tick(self._tick)
        while self._commands and self._commands[0][0] <= tick_ns:
            self._target_ns, self._target = self._commands.popleft()
        while self._switches and self._switches[0][0] <= tick_ns:
            self._drivers_active = self._switches.popleft()[1]
        if not self._drivers_active:
            self._velocity = BodyTwist()
            return
        fresh = self._target_ns is not None and tick_ns - self._target_ns <= COMMAND_TIMEOUT_NS
        target = self._target if fresh else BodyTwist()
        before = self._velocity
        self._velocity = BodyTwist(
            _approach(target.vx, before.vx, MAX_SPEED_M_PER_S, MAX_SPEED_STEP_M_PER_S),
            _approach(target.vy, before.vy, MAX_SPEED_M_PER_S, MAX_SPEED_STEP_M_PER_S),
            _approach(target.omega, before.omega, MAX_TURN_RATE_RAD_PER_S, MAX_TURN_RATE_STEP_RAD_PER_S),
        )

    def _integrate(self) -> None:
        v = self._velocity
        if v.vx == 0.0 and v.vy == 0.0 and v.omega == 0.0:
            return
        turn = v.omega * _GRID_S
        cosine, sine = math.cos(self._yaw + 0.5 * turn), math.sin(self._yaw + 0.5 * turn)
        way_s = _GRID_S * self.grip
        self._x += (v.vx * cosine - v.vy * sine) * way_s
        self._y += (v.vx * sine + v.vy * cosine) * way_s
        self._yaw += turn


def _approach(target: float, before: float, limit: float, step: float) -> float:
    """Move from `before` towards the clamped target by at most `step`."""
    wanted = clamp(target, -limit, limit)
    change = wanted - before
    if -step <= change <= step:
        return wanted  # not before + change, which would miss the target by a rounding error
    return before + clamp(change, -step, step)
