"""Facts of the host, the operator and the task that no device can bring about, for the scenarios."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from msgspec.structs import replace

from robot_io.rig.config import RigConfig
from robot_io.tick import Operator, Phase, TickInput, TickState
from safety.gate_shell import GateShell
from tools.faults.lockstep_round import PERIOD_NS, raise_defect
from tools.faults.scenario import Alter
from tools.rig import resolve_rig
from tools.run.tick_core import TickCore


@cache
def shipped() -> RigConfig:
    """Return the rig that the scenarios run with."""
    return resolve_rig("sim")


def host(**changes: bool | int) -> Alter:
    """Return the alteration of facts of the host."""
    return lambda inp, _state, _n: replace(inp, host=replace(inp.host, **changes))


def host_once(ticks: int, **changes: bool | int) -> Alter:
    """Return the alteration of facts of the host for the first so many ticks."""
    return lambda inp, state, n: host(**changes)(inp, state, n) if n < ticks else inp


def silent(key: str) -> Alter:
    """Return the alteration in which a process gives no sign of life, by the name of the fact."""
    return lambda inp, state, n: host(**{key: n * PERIOD_NS})(inp, state, n)


def operator_stop(after_ticks: int = 0) -> Alter:
    """Return the alteration in which the stop key is pressed once."""
    return lambda inp, _state, n: replace(inp, operator=int(Operator.STOP)) if n == after_ticks else inp


def lagging(ms: float) -> Alter:
    """Return the alteration of a bridge whose messages have become older on their way."""
    return lambda inp, _state, _n: replace(inp, base=replace(inp.base, lag_ns=round(ms * 1e6)))


def no_gate_record(inp: TickInput, _state: TickState, n: int) -> TickInput:
    """Show the gate's record as it was just before the moment."""
    return replace(inp, base=replace(inp.base, published_ns=inp.now_ns - (n + 1) * PERIOD_NS))


def gate_latched(inp: TickInput, _state: TickState, _n: int) -> TickInput:
    """Show a gate that has latched because control was silent."""
    return replace(inp, base=replace(inp.base, latched=True, latch_cause=1))


def no_contact(inp: TickInput, state: TickState, _n: int) -> TickInput:
    """Let the sensor feel its bias only, with a little noise."""
    return _felt(inp, state, (0.0, 0.0, 0.0))


def lost_and_resumed(inp: TickInput, state: TickState, n: int) -> TickInput:
    """Feel nothing, and resume whenever the base holds because of that."""
    held = state.control.phase == Phase.LOST_HOLD
    return replace(no_contact(inp, state, n), operator=int(Operator.RESUME if held else Operator.NONE))


def pushed_aside(degrees: float, newton: float) -> Alter:
    """Return the alteration in which the object of rig `sim` pushes back from `degrees` off the path."""
    angle, rows = math.radians(degrees), shipped().frames.base_from_sensor
    reaction = (-newton * math.cos(angle), -newton * math.sin(angle), 0.0)
    force = tuple(sum(rows[r][c] * reaction[r] for r in range(3)) for c in range(3))
    return lambda inp, state, _n: _felt(inp, state, (force[0], force[1], force[2]))


def _felt(inp: TickInput, state: TickState, force: tuple[float, float, float]) -> TickInput:
    bias, torque = state.control.bias_force, state.control.bias_torque
    scatter = (inp.tick * 7 % 11 - 5) * 0.01
    readings = tuple(
        replace(
            reading,
            force=(bias[0] + force[0] + scatter, bias[1] + force[1] + scatter, bias[2] + force[2] + scatter),
            torque=(torque[0] + scatter / 10, torque[1] + scatter / 10, torque[2] + scatter / 10),
        )
        for reading in inp.ft.readings
    )
    return replace(inp, ft=replace(inp.ft, readings=readings))


def no_way_left(gate: GateShell) -> GateShell:
    """Return a gate for which the base has travelled as far as it may."""
    return replace(gate, bounds=replace(gate.bounds, distance_m=gate.travel.distance_m))


def no_time_left(gate: GateShell) -> GateShell:
    """Return a gate for which the base has moved for as long as it may."""
    return replace(gate, bounds=replace(gate.bounds, moving_s=gate.travel.moving_ns * 1e-9))


def bounded(**bounds: float) -> Callable[[TickCore], TickCore]:
    """Return what gives a core other bounds on the way and time of its phases."""
    return lambda core: replace(core, safety=replace(core.safety, phases=replace(core.safety.phases, **bounds)))


def too_fast(core: TickCore) -> TickCore:
    """Return a core whose approach is faster than the envelope, as by a defect."""
    control = replace(core.control.control, approach_speed_m_per_s=0.2)
    return replace(core, control=replace(core.control, control=control))


class Failing(TickCore, frozen=True):
    """A core that fails with an exception."""

    def fold(self, state, inp):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
        """Fail, but not in the fold that ends the run."""
        if not inp.host.loop_error:
            raise_defect()
        return super().fold(state, inp)


def failing(core: TickCore) -> TickCore:
    """Return a core that fails with an exception."""
    return Failing(core.control, core.safety)
