"""The checks of a plausible force at their limits: numbers from docs/safety.md, one reading or one tick at a time."""

from __future__ import annotations

import math

import pytest
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import ControlState, ForceState, Mode, Phase, SafetyState
from safety.checks import (
    force_checks,
    stuck_checks,
)
from safety.settings import SafetySettings
from tests.safety.fold_bench import FoldBench, pushing
from tests.safety.test_check_boundaries import GOOD, NOW
from tests.safety.test_check_boundaries import SETTINGS as OF_THE_RIG
from tools.rig import resolve_rig

MS = 1_000_000
UPRIGHT = ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
"""The sensor's z ahead, its x straight up, its y to the right: as on the shipped rig, but for 15 degrees of turn."""
SETTINGS = replace(OF_THE_RIG, base_from_sensor=UPRIGHT)
PUSHING = ControlState(
    phase=int(Phase.PUSH), tared=True, speed=0.1, progress_m=0.01, force_valid=True, force_world=(15.0, 0.0, 0.0)
)
ALONG_Z = BodyTwist(0.1, 0.0, 0.0)
"""The shipped sensor's -z points along the motion: a force of -15 N on it is 15 N on the object, ahead."""


def readings(*forces, torque=(0.001, 0.002, 0.003)):
    one = GOOD.ft.readings[0]
    return tuple(
        replace(one, seq=n, force=force, torque=tuple(t + 0.01 * n for t in torque)) for n, force in enumerate(forces)
    )


def sensed(*forces, state=None, control=PUSHING, **ft):
    inp = replace(GOOD, ft=replace(GOOD.ft, readings=readings(*forces), **ft), base=replace(GOOD.base, sent=ALONG_Z))
    return force_checks.check(SETTINGS, state or SafetyState(), inp, control)


# --- F04: damaged packets ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("damaged", "found"), [(4, []), (5, ["F04"])])
def test_five_damaged_packets_of_twenty_are_a_bad_line(damaged, found):
    after, faults = sensed(crc_fail=damaged)
    assert faults == found
    assert after.force.crc_fail == damaged


@pytest.mark.parametrize(("age_ms", "found"), [(199, ["F04"]), (200, [])])
def test_damaged_packets_count_for_a_fifth_of_a_second(age_ms, found):
    before = ForceState(crc_fail=4, damaged_ns=(NOW - age_ms * MS,), damaged=(4,))
    assert sensed(crc_fail=5, state=SafetyState(force=before))[1] == found


def test_a_counter_that_starts_anew_is_no_damage():
    after, faults = sensed(crc_fail=0, state=SafetyState(force=ForceState(crc_fail=9)))
    assert (after.force.crc_fail, faults) == (0, [])


@pytest.mark.parametrize(("rate_hz", "packets"), [(100.0, 5), (1000.0, 50), (62.5, 4)])
def test_the_burst_is_a_quarter_of_what_the_sensor_declares(rate_hz, packets):
    rig = resolve_rig("sim", ())
    rig = replace(rig, ft=replace(rig.ft, declared=replace(rig.ft.declared, rate_hz=rate_hz)))
    assert SafetySettings.of(rig).damaged_packets == packets


def test_what_was_damaged_before_the_run_does_not_count():
    dirty = lambda inp, _: replace(inp, ft=replace(inp.ft, crc_fail=500))  # noqa: E731
    bench = FoldBench()
    bench.run_until(lambda b: b.state.control.phase == Phase.APPROACH, dirty)
    assert bench.output.faults == ()


# --- F12: rate -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("packets", "found"), [(50, []), (49, ["F12-low"]), (36, ["F12-low"]), (35, ["F12-hold"]), (0, ["F12-hold"])]
)
def test_the_rate_is_judged_over_the_last_second(packets, found):
    """0.9 s: 55 Hz are 49.5 packets, 40 Hz are 36."""
    times = tuple(NOW - (9 - k) * 100 * MS for k in range(10))
    before = ForceState(counted_ns=times, counted=(0,) * 10)
    after, faults = sensed(packets_ok=packets, state=SafetyState(force=before))
    assert faults == found
    assert after.force.counted_ns == times


def test_no_rate_before_there_was_a_second():
    times = tuple(NOW - (8 - k) * 100 * MS for k in range(9))
    assert sensed(packets_ok=0, state=SafetyState(force=ForceState(counted_ns=times, counted=(0,) * 9)))[1] == []


# --- F08: a single wild packet -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "wild", "after", "found"),
    [
        (0.0, 80.0, 0.0, []),
        (0.0, 80.1, 0.0, ["F08"]),
        (0.0, -80.1, -0.0, ["F08"]),
        (0.0, 90.0, 90.0, []),
        (0.0, 90.0, 10.0, []),
        (0.0, 90.1, 10.0, ["F08"]),
        (0.0, 100.0, 200.0, []),
    ],
)
def test_one_packet_far_from_both_its_neighbours_is_a_spike(before, wild, after, found):
    state = SafetyState(last_ft_force=(0.0, 0.0, wild), force=ForceState(before_last=(0.0, 0.0, before)))
    assert sensed((0.0, 0.0, after), state=state)[1] == found


# --- F06: one frozen axis ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize(("run", "speed", "found"), [(29, 0.1, True), (28, 0.1, False), (99, 0.0, False)])
def test_one_axis_that_repeats_itself_is_frozen_while_the_base_moves(axis, run, speed, found):
    one = readings((1.0, 2.0, 3.0))[0]
    last = [value + 1.0 for value in (*one.force, *one.torque)]
    last[axis] = (*one.force, *one.torque)[axis]
    runs = tuple(run if i == axis else 0 for i in range(6))
    state = SafetyState(last_ft_force=tuple(last[:3]), last_ft_torque=tuple(last[3:]), force=ForceState(axis_runs=runs))
    after, faults = sensed((1.0, 2.0, 3.0), state=state, control=replace(PUSHING, tared=False, speed=speed))
    assert faults == (["F06"] if found else [])
    assert after.force.axis_runs[axis] == run + 1
    assert after.frozen_run == 0, "the other five go on"


@pytest.mark.parametrize(("moved", "run"), [(0.0049, 100), (0.0051, 0)])
def test_equal_is_what_the_resolution_cannot_tell_apart(moved, run):
    state = SafetyState(last_ft_force=(moved, 0.0, 0.0), force=ForceState(axis_runs=(99, 0, 0, 0, 0, 0)))
    assert sensed((0.0, 0.0, 0.0), state=state)[0].force.axis_runs[0] == run


def test_only_simulated_axes_without_noise_are_exempt():
    def scatters(*overrides):
        return SafetySettings.of(resolve_rig("emulated", overrides)).scatters

    quiet = ("world.sensor.noise_force_N=0", "world.sensor.noise_torque_Nm=0")
    assert scatters() == (True,) * 6
    assert scatters(quiet[0]) == (False, False, False, True, True, True)
    assert scatters(*quiet) == (False,) * 6
    assert scatters("ft.noise_force_N=0", "ft.noise_torque_Nm=0") == (True,) * 6
    assert scatters(*quiet, 'ft.level="hardware"', 'ft.port="/dev/ttyUSB0"') == (True,) * 6


# --- F11: sign and axes --------------------------------------------------------------------------------------------


def wrong_run(force, run=19, **changes):
    state = SafetyState(force=ForceState(wrong_run=run))
    return sensed(force, state=state, control=replace(PUSHING, **changes))


@pytest.mark.parametrize(
    ("force", "wrong"),
    [
        ((0.0, 0.0, -15.0), False),
        ((0.0, 0.0, 15.0), True),
        ((7.5, 0.0, -15.0), False),
        ((7.51, 0.0, -15.0), True),
        ((-7.51, 0.0, -15.0), True),
        ((0.0, 15.0, -0.1), False),
        ((0.0, 15.0, 0.1), True),
        ((0.0, -15.0, 0.1), True),
        ((0.0, 0.0, 0.0), True),
    ],
)
def test_a_force_that_points_back_or_too_much_up_or_down_is_wrong(force, wrong):
    assert wrong_run(force)[1] == (["F11"] if wrong else [])
    assert wrong_run(force, run=18)[1] == []
    assert wrong_run(force)[0].force.wrong_run == (20 if wrong else 0)


@pytest.mark.parametrize(
    ("changes", "judged"),
    [
        ({"progress_m": 0.05}, True),
        ({"progress_m": 0.0501}, False),
        ({"progress_m": 0.0}, True),
        ({"progress_m": -0.001}, False),
        ({"phase": int(Phase.APPROACH)}, False),
        ({"phase": int(Phase.RETREAT)}, False),
        ({"tared": False}, False),
    ],
)
def test_the_direction_is_judged_in_the_first_five_centimetres_of_the_push(changes, judged):
    assert wrong_run((0.0, 0.0, 15.0), **changes)[1] == (["F11"] if judged else [])


def test_a_loss_of_contact_neither_counts_nor_forgets():
    assert wrong_run((0.0, 0.0, 15.0), phase=int(Phase.LOST))[0].force.wrong_run == 19


def test_the_bias_is_taken_off_before_the_direction_is_judged():
    assert wrong_run((0.0, 0.0, 5.0), bias_force=(0.0, 0.0, 20.0))[1] == []
    assert wrong_run((0.0, 0.0, -5.0), bias_force=(0.0, 0.0, -20.0))[1] == ["F11"]


# --- before the contact --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("newton", "found"), [(3.0, []), (3.01, ["F09-before"]), (math.nan, [])])
def test_a_force_before_the_contact_is_told(newton, found):
    assert sensed(control=replace(PUSHING, force_before_contact_N=newton))[1] == found


def test_an_early_contact_is_told():
    assert sensed(control=replace(PUSHING, early_contact=True))[1] == ["F53-early"]


# --- F54: stuck, and too high for too long ---------------------------------------------------------------------------


def watched(*, newton=60.0, sent_m=0.05, gone_m=0.0, since_ms=500, **changes):
    """Judge one tick of a push that has sent the base `sent_m` along x and seen it go `gone_m`."""
    force = ForceState(stuck_since_ns=NOW - since_ms * MS, sent_x=sent_m - 0.001, from_x=GOOD.base.pose.x - gone_m)
    state = SafetyState(mode=int(changes.pop("mode", Mode.PUSHING)), force=force)
    control = replace(PUSHING, force_world=(newton, 0.0, 0.0), **changes)
    inp = replace(GOOD, base=replace(GOOD.base, sent=BodyTwist(0.1, 0.0, 0.0)))
    return stuck_checks.check(SETTINGS, state, inp, control)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({}, True),
        ({"gone_m": 0.0124}, True),
        ({"gone_m": 0.0126}, False),
        ({"gone_m": -0.05}, True),
        ({"newton": 50.0}, False),
        ({"newton": 50.1}, True),
        ({"sent_m": 0.0199}, False),
        ({"sent_m": 0.0201}, True),
        ({"since_ms": 399}, False),
        ({"since_ms": 400}, True),
        ({"mode": Mode.SLOW}, True),
        ({"mode": Mode.HOLD}, False),
        ({"phase": int(Phase.LOST)}, False),
        ({"force_valid": False}, False),
    ],
)
def test_stuck_is_a_large_force_for_less_than_a_quarter_of_the_commanded_way(changes, found):
    after, faults = watched(**changes)
    assert faults == (["F54-stop"] if found else [])
    if changes.get("newton") == 50.0 or changes.get("mode") == Mode.HOLD:
        assert after.force.stuck_since_ns == 0


def test_the_way_is_measured_along_the_command_whatever_the_heading():
    """Sent sideways by 0.05 m, gone ahead by as much: nothing of the commanded way."""
    force = ForceState(stuck_since_ns=NOW - 500 * MS, sent_y=0.05, from_x=GOOD.base.pose.x - 0.05)
    control = replace(PUSHING, force_world=(60.0, 0.0, 0.0))
    inp = replace(GOOD, base=replace(GOOD.base, sent=BodyTwist()))
    assert stuck_checks.check(SETTINGS, SafetyState(force=force), inp, control)[1] == ["F54-stop"]


def high(newton, usual=15, samples=30, high_s=9.99, **changes):
    histogram = tuple(samples if k == usual else 0 for k in range(35)) if samples else ()
    state = SafetyState(force=ForceState(high_ns=round(high_s * 1e9), histogram=histogram))
    return stuck_checks.check(SETTINGS, state, GOOD, replace(PUSHING, force_world=(newton, 0.0, 0.0), **changes))


@pytest.mark.parametrize(
    ("newton", "usual", "found"),
    [
        (100.1, 34, True),
        (100.0, 34, False),
        (50.1, 15, True),
        (50.0, 15, False),
        (54.1, 17, True),
        (54.0, 17, False),
        (62.0, 30, False),
    ],
)
def test_too_high_is_above_the_slow_limit_or_three_times_the_usual_force(newton, usual, found):
    after, faults = high(newton, usual)
    assert faults == (["F54-hold"] if found else [])
    assert after.force.high_ns == (10_000_000_000 if found else 9_990_000_000)


def test_ten_seconds_in_all_and_only_of_the_push():
    assert high(110.0, high_s=9.98)[1] == []
    assert high(110.0, phase=int(Phase.LOST))[1] == []
    assert high(15.0, high_s=10.0)[1] == ["F54-hold"], "they are not taken back"
    assert high(60.0, samples=0)[1] == [], "nothing is usual yet"


def test_the_usual_force_is_that_of_the_whole_push_and_no_longer_follows_what_is_too_high():
    sampled = pushing()
    for _ in range(400):
        sampled.fold()
    histogram = sampled.state.safety.force.histogram
    assert len(histogram) == 35
    assert sum(histogram[14:16]) >= sum(histogram) - 1 >= 40, "but for the rise at the first touch"
    at = replace(GOOD, tick=10)
    state = SafetyState(force=ForceState(histogram=histogram))
    for newton, more in ((15.2, 1), (60.0, 0)):
        after, _ = stuck_checks.check(SETTINGS, state, at, replace(PUSHING, force_world=(newton, 0.0, 0.0)))
        assert sum(after.force.histogram) == sum(histogram) + more
