"""What must hold of every output of core and gate, whatever went in; the numbers are those of docs/safety.md."""

from __future__ import annotations

import math

from robot_io.messages import BodyTwist
from robot_io.tick import Mode, Phase, TickOutput, TickState
from safety.envelope import EnvelopeLimits
from safety.faults import FAULTS

ROUNDING = 1.0 + 1e-9
GATE_MARGIN = 1.0011
"""The gate allows the ball a thousandth for rounding."""
CLEAN_NS = 1_000_000_000
ZERO = BodyTwist()
AT_WORK = frozenset(Phase) - {Phase.SETTLE, Phase.TARE, Phase.DONE, Phase.FAILED}


def inside(limits: EnvelopeLimits, twist: BodyTwist, margin: float = ROUNDING) -> bool:
    """Return whether a command is finite, and base and contact ball keep the envelope."""
    ball = math.hypot(twist.vx - twist.omega * limits.contact_y, twist.vy + twist.omega * limits.contact_x)
    return (  # false for NaN
        math.hypot(twist.vx, twist.vy) <= limits.speed * margin
        and abs(twist.omega) <= limits.turn_rate * margin
        and ball <= limits.speed * margin
    )


class Rules:
    """Checks one tick after the other."""

    def __init__(self, limits: EnvelopeLimits, state: TickState, mode: int, now_ns: int) -> None:
        self._limits = limits
        self._latched = frozenset(state.safety.latched)
        self._last = state.envelope.last
        self._mode = mode
        self._at_work = state.control.phase in AT_WORK
        self._asked_ns = now_ns if mode > Mode.PUSHING else -CLEAN_NS
        """When a fault last asked for SLOW or more."""

    def check(self, state: TickState, output: TickOutput, now_ns: int) -> None:
        """Raise AssertionError where this tick breaks a rule."""
        command, mode = output.command_body, Mode(output.mode)
        assert inside(self._limits, command), command
        assert set(output.faults) <= set(FAULTS)
        self._check_mode(state, output, now_ns)
        if mode in (Mode.SILENT, Mode.READY, Mode.STOP, Mode.DEAD):
            assert command == ZERO, (mode, command)
        held = mode == Mode.HOLD
        if held:
            assert math.hypot(command.vx, command.vy) <= math.hypot(self._last.vx, self._last.vy) * ROUNDING
            assert abs(command.omega) <= abs(self._last.omega) * ROUNDING
        self._last = command

    def _check_mode(self, state: TickState, output: TickOutput, now_ns: int) -> None:
        mode, latched = Mode(output.mode), frozenset(state.safety.latched)
        assert latched >= self._latched, "a latched fault was forgotten"
        assert latched <= set(output.faults)
        asked = max((FAULTS[row].mode for row in output.faults), default=Mode.SILENT)
        at_work = state.control.phase in AT_WORK
        if at_work or asked >= Mode.STOP:
            assert mode >= asked, (mode, output.faults)
        if self._mode >= Mode.STOP:
            assert mode >= self._mode, "a stop was let go"
        if asked > Mode.PUSHING:
            self._asked_ns = now_ns
        if at_work and self._at_work and self._mode > Mode.PUSHING and mode < self._mode:
            assert mode == self._mode - 1, "let go by more than one mode in a tick"
            assert now_ns - self._asked_ns >= CLEAN_NS, f"let go after {now_ns - self._asked_ns} ns"
        self._mode, self._latched, self._at_work = mode, latched, at_work
