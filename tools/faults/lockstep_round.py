"""A scenario in lockstep: exact to the tick, with the whole world, core and gate of level sim."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

from robot_io.messages import BodyTwist
from robot_io.rig.config import RigConfig
from robot_io.tick import Phase, TickInput, TickOutput, TickState
from safety.gate import LATCH_FAULT
from tools.faults.scenario import Moment, Scenario, at
from tools.places.saved_tare import SavedTare
from tools.rig import resolve_rig, with_faults
from tools.run.lockstep import START_NS, Lockstep
from tools.run.tick_core import TickCore

SETTINGS = ("control.distance_m=1.0", "ft.tare_s=1.0")
LATER = {Moment.APPROACH: 50, Moment.PUSH: 50, Moment.RETREAT: 40, Moment.END: 0}
"""A fault begins so many ticks after the phase has its full speed, or has begun."""
PERIOD_NS = 10_000_000
NOT_ENDED = -1
"""In place of an exit code."""
MOST_TICKS = 6000
"""A scenario that has not ended by then does not end by itself."""


class Seen(NamedTuple):
    """What one tick came to."""

    phase: int
    speed: float
    """Of the command that left: control's envelope, or the gate where control is silent."""
    mode: int
    faults: tuple[str, ...]
    base_y: float
    """Of the base's newest pose, m, WORLD frame."""
    begun: bool
    """Whether the evidence that a row waits for is there."""


class LockstepRound(NamedTuple):
    """A whole run under a scenario: what each tick came to, at which tick the bad input could first be seen."""

    ticks: list[Seen]
    first_bad: int | None
    exit_code: int


class _FaultyCore:
    """The core with the scenario's facts of the host, and its defects, from a tick on."""

    def __init__(self, core: TickCore, scenario: Scenario, from_tick: int) -> None:
        self._core = core
        self._defective = core if scenario.core is None else scenario.core(core)
        self._alter = scenario.alter
        self._from = from_tick

    def fold(self, state: TickState, inp: TickInput) -> tuple[TickState, TickOutput]:
        """Fold one tick."""
        if inp.tick < self._from:
            return self._core.fold(state, inp)
        if self._alter is not None:
            inp = self._alter(inp, state, inp.tick - self._from)
        return self._defective.fold(state, inp)


class FaultyLockstep(Lockstep):
    """A lockstep run under a scenario."""

    def __init__(self, rig: RigConfig, seed: int, scenario: Scenario, from_tick: int) -> None:
        super().__init__(rig, seed, None, saved=usual_tare(seed) if scenario.in_contact else None)
        self.safety = self._core.safety
        self._core = _FaultyCore(self._core, scenario, from_tick)  # type: ignore[assignment]
        self._scenario = scenario
        self._from = from_tick
        self.ticks: list[Seen] = []

    def _finish_tick(self, inp: TickInput, after: TickState, output: TickOutput) -> None:
        super()._finish_tick(inp, after, output)
        command = self._gate.record.sent if self._scenario.by_gate and inp.tick >= self._from else output.command_body
        begun = self._scenario.begins is None or self._scenario.begins(inp, after)
        faults = output.faults
        if self._scenario.silent or self._scenario.dead:  # nobody but the gate is left to name it
            faults = (LATCH_FAULT.get(self._gate.told, ""),)
        self.ticks.append(Seen(after.control.phase, size(command), output.mode, faults, inp.base.pose.y, begun))
        if len(self.ticks) > MOST_TICKS:
            raise _TooLong

    def _take_base(self, now_ns: int) -> None:
        super()._take_base(now_ns)
        if self._scenario.gate is not None and now_ns == START_NS + self._from * PERIOD_NS:
            self._gate = self._scenario.gate(self._gate)

    def _send(self, tick: int, now_ns: int, output: TickOutput) -> None:
        if tick < self._from or not (self._scenario.silent or self._scenario.dead):
            super()._send(tick, now_ns, output)
            return
        if self._scenario.dead and not self._gate.zeros_since_ns:
            self._gate = self._gate.on_control_gone(now_ns)
        self._turn_gate(now_ns)


def run_lockstep(scenario: Scenario, seed: int = 0) -> LockstepRound:
    """Run a scenario to its end."""
    settings = SETTINGS + scenario.settings
    from_tick = moment_tick(scenario.moment, settings, seed)
    if scenario.edge_beside_m is not None:
        left = reference(settings, seed)[from_tick].base_y + _rig(settings).base.outline_m[1] / 2
        y_max = left + scenario.edge_beside_m
        settings += ("workspace.x_m=[-50.0, 50.0]", f"workspace.y_m=[-50.0, {y_max!r}]")
    rig = with_faults(_rig(settings), at(scenario.words, from_tick * PERIOD_NS * 1e-9))
    one = FaultyLockstep(rig, seed, scenario, from_tick)
    code = NOT_ENDED
    try:
        code = one.run(lambda *_: None)["exit_code"]
    except _TooLong:
        pass
    except _Defect:
        code = 1
    first_ns = one.first_injected_ns
    bad = from_tick if not scenario.words else None if first_ns is None else -(-(first_ns - START_NS) // PERIOD_NS)
    return LockstepRound(one.ticks, bad, code)


class _TooLong(Exception):
    pass


class _Defect(ArithmeticError):
    """Raised by a scenario's defect in control."""


def raise_defect() -> None:
    """Fail as a defect in control does."""
    raise _Defect("planted by a scenario")


@cache
def _rig(settings: tuple[str, ...]) -> RigConfig:
    return resolve_rig("sim", settings)


@cache
def reference(settings: tuple[str, ...], seed: int) -> tuple[Seen, ...]:
    """Return the ticks of a run without a fault."""
    ticks: list[Seen] = []

    def on_tick(inp: TickInput, state: TickState, output: TickOutput) -> None:
        ticks.append(
            Seen(state.control.phase, size(output.command_body), output.mode, output.faults, inp.base.pose.y, True)
        )

    Lockstep(_rig(settings), seed, None).run(on_tick)
    return tuple(ticks)


@cache
def usual_tare(seed: int) -> SavedTare:
    """Return the tare of a run without a fault."""
    found = Lockstep(_rig(SETTINGS), seed, None).run(lambda *_: None)
    return SavedTare((*found["bias_force_N"], *found["bias_torque_Nm"]), tuple(found["held_joints_rad"]), "", 0.0)


def moment_tick(moment: Moment, settings: tuple[str, ...], seed: int) -> int:
    """Return the tick at which a scenario's fault begins, from a run without it."""
    if moment == Moment.START:
        return 0
    ticks, rig = reference(settings, seed), _rig(settings)
    full = {
        Moment.APPROACH: (Phase.APPROACH, rig.control.approach_speed_m_per_s),
        Moment.PUSH: (Phase.PUSH, rig.control.push_speed_m_per_s),
        Moment.RETREAT: (Phase.RETREAT, 0.0),
        Moment.END: (Phase.REST, 0.0),
    }
    phase, speed = full[moment]
    found = next(i for i, seen in enumerate(ticks) if seen.phase == phase and seen.speed >= speed - 1e-6)
    return found + LATER[moment]


def size(twist: BodyTwist) -> float:
    """Return the speed of a velocity, m/s."""
    return math.hypot(twist.vx, twist.vy)
