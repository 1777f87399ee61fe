"""A machine that was suspended: every age looks fresh, so control and gate each latch before anything moves again.

CLOCK_BOOTTIME goes on meanwhile and CLOCK_MONOTONIC does not: more than 20 ms between two ticks is a suspend.
"""

import time

import pytest
from msgspec.structs import replace

from robot_io import clock
from robot_io.messages import BodyTwist
from robot_io.tick import ClockState, Mode, SafetyState
from safety.checks import (
    clock_checks,
)
from safety.envelope import EnvelopeLimits
from safety.gate import Latch
from safety.gate_shell import GateShell
from safety.motion_bounds import TravelLimits
from tests.safety.fold_bench import FoldBench, pushing

MS = 1_000_000
DAYS = 86_400_000 * MS
ZERO, SLOW = BodyTwist(), BodyTwist(0.005, 0.0, 0.0)


def checked(state: SafetyState, asleep_ns: int):
    inp = FoldBench().good_input()
    return clock_checks.check(state, replace(inp, host=replace(inp.host, asleep_ns=asleep_ns)))


@pytest.mark.parametrize(
    ("jump_ns", "found"), [(0, []), (20 * MS, []), (20 * MS + 1, ["F61"]), (-20 * MS, []), (-20 * MS - 1, ["F61"])]
)
def test_a_jump_of_more_than_20_ms(jump_ns, found):
    state, faults = checked(SafetyState(clock=ClockState(3 * DAYS, True)), 3 * DAYS + jump_ns)
    assert faults == found
    assert [fault.value for fault in faults] == [jump_ns / MS] * len(found)
    assert state.clock == ClockState(3 * DAYS + jump_ns, True)


def test_what_was_slept_before_the_run_is_no_jump():
    state, faults = checked(SafetyState(), 3 * DAYS)
    assert (state.clock, faults) == (ClockState(3 * DAYS, True), [])
    assert checked(state, 3 * DAYS)[0] == state


def test_the_tick_that_wakes_up_sends_zero():
    bench = pushing()
    bench.fold(lambda inp, _: replace(inp, host=replace(inp.host, asleep_ns=2_000 * MS)))
    assert bench.output.mode == Mode.STOP
    assert bench.output.command_body == ZERO
    assert bench.output.faults == ("F61",)
    assert bench.output.fault_values == (2_000.0,)


def rolling() -> GateShell:
    limits = EnvelopeLimits(0.15, 0.25, 0.5, 1.0, 10 * MS, 0.0, 0.0)
    return GateShell(limits, TravelLimits(2.0, 30.0), 0).on_sent(SLOW, SLOW, 0)


def test_the_gate_latches_by_itself():
    shell = rolling().on_asleep(3 * DAYS).on_asleep(3 * DAYS + 20 * MS)
    assert shell.gate.latch == Latch.NONE
    woken, latching = shell.on_asleep(3 * DAYS + 41 * MS).on_leaving(MS)
    assert latching is not None
    assert (latching.latch, latching.fault) == (Latch.SUSPENDED, "F61")
    assert latching.text == "this machine was suspended, or its clock stood still"
    assert woken.due(MS) == ZERO
    assert shell.on_asleep(0).gate.latch == Latch.SUSPENDED


def test_a_reading_that_took_too_long_is_looked_at_again():
    shell = rolling().on_asleep(0).on_asleep(None)
    assert shell.gate.latch == Latch.NONE
    assert shell.on_asleep(500 * MS).gate.latch == Latch.SUSPENDED


# --- the reading itself ------------------------------------------------------------------------------------------


class Clocks:
    """Stands in for the machine's clocks: `reads` gives each read of CLOCK_MONOTONIC its time."""

    def __init__(self, *reads: int, asleep: int) -> None:
        self.CLOCK_BOOTTIME = 7
        self._reads, self._asleep, self._now = iter(reads), asleep, 0

    def monotonic_ns(self) -> int:
        self._now = next(self._reads)
        return self._now

    def clock_gettime_ns(self, which: int) -> int:
        assert which == 7
        return self._now + self._asleep


@pytest.mark.parametrize(
    ("reads", "found"),
    [
        ((0, 1_000), 5 * MS - 500),
        ((0, MS), 5 * MS - MS // 2),
        ((0, MS + 1, 2 * MS, 2 * MS), 5 * MS),  # the first took too long
        ((0, 2 * MS) * 5, None),
    ],
)
def test_a_bracket_of_more_than_1_ms_is_discarded(monkeypatch, reads, found):
    monkeypatch.setattr(clock, "time", Clocks(*reads, asleep=5 * MS))
    assert clock.asleep_ns() == found


def test_it_stands_still_while_this_machine_is_awake():
    first = clock.asleep_ns()
    end = time.monotonic() + 0.1
    while time.monotonic() < end:
        now = clock.asleep_ns()
        if first is not None and now is not None:
            assert abs(now - first) < 2 * MS
