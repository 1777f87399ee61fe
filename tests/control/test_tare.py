"""The tare inside the sequence: what counts, what does not, and that it waits until nothing moves."""

import math

import pytest
from msgspec.structs import replace

from control.sensing import counted
from control.tare import Refusal
from robot_io.messages import BodyTwist
from robot_io.tick import Phase
from tests.safety.fold_bench import BIAS, ran_to


def test_tare_finds_the_bias_with_the_tool_in_it_then_approaches():
    bench = ran_to(Phase.APPROACH)
    state = bench.state.control
    assert state.tared
    assert state.bias_force == pytest.approx(BIAS[:3], abs=0.02)
    assert state.bias_torque == pytest.approx(BIAS[3:], abs=0.002)
    assert state.tare == (), "the sums are needed no more"


@pytest.mark.parametrize(("seconds", "readings"), [(0.2, 20), (1.0, 100), (2.5, 250)])
def test_the_tare_lasts_as_long_as_the_rig_says(seconds, readings):
    bench = ran_to(Phase.TARE, (f"ft.tare_s={seconds}",))
    assert bench.run_until(lambda b: b.state.control.phase == Phase.APPROACH) == readings - 1


def test_readings_from_before_the_tare_do_not_count():
    bench = ran_to(Phase.TARE)

    def old(inp, _):
        readings = tuple(replace(r, received_ns=bench.state.control.phase_since_ns) for r in inp.ft.readings)
        return replace(inp, ft=replace(inp.ft, readings=readings))

    for n in range(4):
        bench.fold(old, n)
    assert counted(bench.state.control) == 0
    bench.fold()
    assert counted(bench.state.control) == 1


def test_the_tare_takes_no_more_than_it_asked_for():
    bench = ran_to(Phase.TARE)

    def flood(inp, _):
        one = inp.ft.readings[0]
        many = tuple(replace(one, received_ns=one.received_ns + i, seq=one.seq + i) for i in range(64))
        return replace(inp, ft=replace(inp.ft, readings=many))

    bench.run_until(lambda b: counted(b.state.control) >= 100, flood)
    assert counted(bench.state.control) == 100


def test_a_base_that_still_moves_is_not_tared_on():
    """Somebody drives the robot by hand while it should be at rest: only the readings after that count."""
    bench = ran_to(Phase.TARE)

    def driven(inp, _):
        return replace(inp, base=replace(inp.base, odometry=BodyTwist(0.05, 0.0, 0.0)))

    for n in range(150):
        bench.fold(driven, n)
    assert bench.state.control.phase == Phase.TARE
    assert counted(bench.state.control) == 0
    rest = bench.run_until(lambda b: b.state.control.phase == Phase.APPROACH)
    assert rest == 99  # a hundred readings from the first tick at rest


def altered(force=None, torque=None):
    def alter(inp, n):
        one = inp.ft.readings[0]
        changed = replace(one, force=force(one.force, n) if force else one.force, torque=torque or one.torque)
        return replace(inp, ft=replace(inp.ft, readings=(changed,)))

    return alter


@pytest.mark.parametrize(
    ("alter", "refusal", "fault"),
    [
        (altered(lambda f, n: (f[0] + 5.0 * (-1) ** n, f[1], f[2])), Refusal.UNSETTLED, "R02"),
        (altered(lambda f, n: (f[0], f[1] + 0.03 * n, f[2])), Refusal.UNSETTLED, "R02"),
        (altered(lambda f, n: (f[0], f[1], f[2] - 110.0)), Refusal.SATURATED, "R03"),
        (altered(torque=(0.0, 16.0, 0.0)), Refusal.SATURATED, "R03"),
    ],
    ids=["shaking", "drifting", "too much force", "too much torque"],
)
def test_a_refused_tare_stays_refused_and_ends_the_run(alter, refusal, fault):
    bench = ran_to(Phase.TARE)
    bench.run_until(lambda b: b.state.control.refusal != 0, alter)
    assert bench.state.control.refusal == refusal
    assert fault in bench.output.faults
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 4
    assert not bench.state.control.tared
    assert bench.state.control.phase == Phase.TARE


def test_a_reading_that_is_no_number_stops_the_tare():
    bench = ran_to(Phase.TARE)
    bench.fold(altered(lambda f, n: (math.nan, f[1], f[2])), 0)
    assert "F10" in bench.output.faults
