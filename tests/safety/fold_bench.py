"""The real core folded over inputs made by hand: good ones, and whatever a test makes of them.

The synthetic base does at once what it is told, the synthetic object pushes back with 15 N straight against the
ball, and every number of the sensor scatters a little. No world, no noise, no time but the tick's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from msgspec.structs import replace

from robot_io.messages import ArmRecord, BaseRecord, BaseStatus, BodyTwist, JointState, Pose2D
from robot_io.tick import FtInput, FtReading, HostInput, Phase, TickInput, TickOutput, TickState
from tools.rig import resolve_rig
from tools.run.tick_core import TickCore

PERIOD_NS = 10_000_000
START_NS = 5_000_000_000
LINK_UP = 2
BIAS = (-20.68, 21.95, -48.70, -0.097, 1.172, -0.321)
GAP_M = 0.05
"""The object begins this far along the path."""

FAST_TARE = "ft.tare_s=1"
"""The rigs' own 5 s would be 400 more ticks of each test."""
Alter = Callable[[TickInput, int], TickInput]
"""(good input, ticks since the alteration began) -> the input the core sees."""


class FoldBench:
    """Folds tick by tick. `state` and `output` are those after the newest tick, `inp` is what it saw."""

    def __init__(self, overrides: tuple[str, ...] = ()) -> None:
        self.core = _core(overrides)
        self.rig = _rig(overrides)
        self.state = TickState()
        self.output: TickOutput | None = None
        self.inp: TickInput | None = None
        self.tick = 0
        self.now_ns = START_NS
        self.pose = Pose2D(-1.0, 0.0, 0.0)
        self.sent = BodyTwist()
        self.odometry = BodyTwist()
        self.odometry_seq = 0
        self.odometry_ns = 0
        self.force_path = (15.0, 0.0)
        """Force on the object once it is touched, N."""

    def copy(self) -> FoldBench:
        """Return another bench that stands where this one does."""
        other = FoldBench.__new__(FoldBench)
        other.__dict__.update(self.__dict__)  # all of its values are frozen
        return other

    def good_input(self) -> TickInput:
        """Return what the core sees when all is well."""
        count = self.tick + 1
        servo = self.rig.arm.hold == "servo"
        joints = JointState(self.rig.arm.held_pose_rad, (0.0,) * 6, 1, 0, self.tick * 0.01)
        return TickInput(
            self.tick,
            self.now_ns,
            0,
            HostInput(0, 0, True, True, True, False, 0),
            FtInput((self._reading(),), LINK_UP, count, 0, 0),
            ArmRecord(joints, count, self.now_ns, self.now_ns, LINK_UP, 0, servo),
            BaseRecord(
                pose=self.pose,
                pose_valid=True,
                pose_received_ns=self.now_ns,
                pose_seq=count,
                odometry=self.odometry,
                odometry_received_ns=self.odometry_ns,
                odometry_seq=self.odometry_seq,
                status=BaseStatus(False, True, 26.0),
                status_received_ns=self.now_ns,
                newest_inbound_ns=self.now_ns,
                sent=self.sent,
                published_ns=self.now_ns,
            ),
        )

    def fold(self, alter: Alter | None = None, since: int = 0) -> TickOutput:
        """Run one tick; `alter` changes its input, told how many ticks ago the alteration began."""
        if self.tick % 2 == 0:
            self.odometry, self.odometry_seq, self.odometry_ns = self.sent, self.odometry_seq + 1, self.now_ns
        inp = self.good_input()
        if alter is not None:
            inp = alter(inp, since)
        self.inp = inp
        self.state, self.output = self.core.fold(self.state, inp)
        self._move(self.output.command_body)
        self.tick += 1
        self.now_ns += PERIOD_NS
        return self.output

    def skip(self, periods: int) -> None:
        """Let whole periods pass without a tick; the base rolls on."""
        for _ in range(periods):
            self._move(self.sent)
            self.tick += 1
            self.now_ns += PERIOD_NS

    def run_until(self, done: Callable[[FoldBench], bool], alter: Alter | None = None, most: int = 3000) -> int:
        """Fold until `done`; return how many ticks before this one were folded (the first tick is number 0)."""
        for n in range(most):
            self.fold(alter, n)
            if done(self):
                return n
        raise AssertionError(f"nothing happened in {most} ticks: {self.output}")

    def run_to(self, phase: Phase) -> FoldBench:
        """Fold good inputs until `phase` is reached."""
        self.run_until(lambda b: b.state.control.phase == phase)
        return self

    def at_full_speed(self) -> FoldBench:
        """Fold good inputs until the push has its full speed."""
        full = self.rig.control.push_speed_m_per_s
        self.run_until(lambda b: b.state.control.phase == Phase.PUSH and b.state.control.speed >= full)
        for _ in range(5):
            self.fold()
        assert self.output.faults == ()
        assert self.output.mode == 2
        return self

    def _move(self, command: BodyTwist) -> None:
        cos, sin, dt = math.cos(self.pose.yaw), math.sin(self.pose.yaw), PERIOD_NS * 1e-9
        self.pose = Pose2D(
            self.pose.x + (cos * command.vx - sin * command.vy) * dt,
            self.pose.y + (sin * command.vx + cos * command.vy) * dt,
            self.pose.yaw + command.omega * dt,
        )
        self.sent = command

    def _reading(self) -> FtReading:
        touching = self.pose.x + self.rig.frames.contact_in_base_m[0] >= GAP_M
        fx, fy = self.force_path if touching and self.state.control.phase < Phase.RETREAT else (0.0, 0.0)
        rows = self.rig.frames.base_from_sensor
        reaction = (-fx, -fy, 0.0)
        scatter = (self.tick * 7 % 11 - 5) * 0.01
        force = tuple(round(sum(rows[r][c] * reaction[r] for r in range(3)) + BIAS[c] + scatter, 2) for c in range(3))
        return FtReading(self.now_ns, self.tick + 1, force, tuple(b + scatter * 0.1 for b in BIAS[3:]))


def without_contact(inp: TickInput, _since: int = 0) -> TickInput:
    """Return the input with a sensor that feels nothing but its bias."""
    scatter = (inp.tick * 7 % 11 - 5) * 0.01
    return with_force(inp, tuple(b + scatter for b in BIAS[:3]))


def with_force(inp: TickInput, force: tuple[float, float, float]) -> TickInput:
    """Return the input with the force of every reading replaced (N, SENSOR frame, bias still in it)."""
    readings = tuple(replace(r, force=force) for r in inp.ft.readings)
    return replace(inp, ft=replace(inp.ft, readings=readings))


@cache
def _rig(overrides: tuple[str, ...]):
    return resolve_rig("sim", (FAST_TARE, *overrides))


@cache
def _core(overrides: tuple[str, ...]) -> TickCore:
    return TickCore.of(_rig(overrides))


@cache
def _pushing(overrides: tuple[str, ...]) -> FoldBench:
    return FoldBench(overrides).at_full_speed()


@cache
def _ran_to(phase: Phase, overrides: tuple[str, ...]) -> FoldBench:
    return FoldBench(overrides).run_to(phase)


def pushing(overrides: tuple[str, ...] = ()) -> FoldBench:
    """Return a fresh bench that pushes at full speed without a fault."""
    return _pushing(overrides).copy()


def ran_to(phase: Phase, overrides: tuple[str, ...] = ()) -> FoldBench:
    """Return a fresh bench that came to `phase` with good inputs."""
    return _ran_to(phase, overrides).copy()
