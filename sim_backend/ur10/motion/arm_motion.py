"""How the emulated arm moves: the world's joints, plus drift, plus the motion commanded by a program.

What a command would do beyond the limits of the safety settings is not done: the arm holds, and `tripped` says why.
Not modelled: joint dynamics and collisions.
"""

from __future__ import annotations

import math
from collections import deque

from robot_io.messages import Joints
from sim_backend.ur10.models import UrModel
from sim_backend.ur10.motion.commands import Command, OutOfReach, joints
from sim_backend.ur10.motion.limits import speed_limits, too_fast
from sim_backend.ur10.reports import ErrorCode
from sim_backend.world.plant import ArmTruth

STEADY_RAD_PER_S = 0.001
HISTORY_CYCLES = 1000
_JOINT_NAMES = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")
_WARNING = 2


class ArmMotion:
    """Joint angles (rad) after each controller cycle; `offset` is the arm's deviation from the world's joints."""

    def __init__(self, model: UrModel) -> None:
        self.offset = [0.0] * 6
        self.drift_rate = [0.0] * 6
        """Drift of each joint (rad/s), for fault injection."""
        self.actual: Joints = (0.0,) * 6
        self.velocity: Joints = (0.0,) * 6
        self.target: Joints = (0.0,) * 6
        self.history: deque[Joints] = deque(maxlen=HISTORY_CYCLES)
        """Where the arm was in the cycles before, the newest last."""
        self.tripped: ErrorCode | None = None
        """The limit that the last command met; the controller stops for it and takes it away."""
        self._ends = model.range_rad
        self._limits = speed_limits(model)
        self._command: Command | None = None

    @property
    def steady(self) -> bool:
        """Return whether every joint is at rest."""
        return all(abs(v) < STEADY_RAD_PER_S for v in self.velocity)

    @property
    def moving(self) -> bool:
        """Return whether a move is in progress."""
        return self._command is not None and self._command.moving

    @property
    def command(self) -> Command | None:
        """Return what the arm follows."""
        return self._command

    def hold(self) -> None:
        """Hold the current position."""
        self._command = None

    def follow(self, command: Command) -> None:
        """Do `command` until the next one."""
        self._command = command

    def step(self, base: ArmTruth, dt_s: float, scaling: float = 1.0) -> None:
        """Advance by one controller cycle; commands run at a share of their speed (0..1)."""
        now = joints([base.position[i] + self.offset[i] for i in range(6)])
        commanded = self._commanded(now, dt_s, dt_s * scaling)
        rates = []
        for i in range(6):
            wanted = commanded[i] + self.drift_rate[i] * dt_s
            change = self._in_range(i, wanted) - now[i]
            self.offset[i] += change
            rates.append(base.velocity[i] + change / dt_s)
        self.velocity = joints(rates)
        self.actual = self.target = joints([base.position[i] + self.offset[i] for i in range(6)])
        self.history.append(self.actual)

    def _commanded(self, now: Joints, dt_s: float, scaled_s: float) -> Joints:
        if self._command is None:
            return now
        try:
            q = self._command.step(now, scaled_s)
        except OutOfReach:
            return self._trip(now, ErrorCode(204, 2, _WARNING, "Path sanity check: inverse kinematics has no solution"))
        fast = too_fast([(to - at) / dt_s for at, to in zip(now, q, strict=True)], self._limits)
        if fast is not None:
            text = f"Path sanity check: sudden change in target position of {_JOINT_NAMES[fast]}"
            return self._trip(now, ErrorCode(204, 1, _WARNING, text))
        return q

    def _trip(self, now: Joints, why: ErrorCode) -> Joints:
        self._command = None
        self.tripped = why
        return now

    def _in_range(self, joint: int, q: float) -> float:
        """Return `q` (rad), or the end of the joint's range when it lies beyond."""
        return q if abs(q) <= self._ends[joint] else math.copysign(self._ends[joint], q)
