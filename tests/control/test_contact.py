"""What counts as contact and as its loss, for heavy and for light objects, and what a run remembers of both."""

from __future__ import annotations

import math

import pytest
from msgspec.structs import replace

from control import contact_threshold
from control.wrench import median_of_three
from robot_io.messages import BodyTwist, Pose2D
from robot_io.tick import ContactState, ControlState, Phase, TickState
from tests.safety.fold_bench import BIAS, GAP_M, FoldBench, pushing, ran_to, with_force
from tests.safety.fold_bench import without_contact as no_force
from tools.run.tick_core import TickCore

NAN = math.nan
AHEAD = (1.0, 0.0)
MS = 1_000_000


# --- the median ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("three", "middle"),
    [
        ((1.0, 2.0, 3.0), 2.0),
        ((3.0, 2.0, 1.0), 2.0),
        ((1.0, 99.0, 2.0), 2.0),
        ((99.0, 1.0, 2.0), 2.0),
        ((1.0, 2.0, -99.0), 1.0),
        ((2.0, 2.0, 2.0), 2.0),
    ],
)
def test_the_median_is_the_middle_one_of_each_axis(three, middle):
    a, b, c = three
    assert median_of_three((a, 0.0, -a), (b, 0.0, -b), (c, 0.0, -c)) == (middle, 0.0, -middle)


@pytest.mark.parametrize("bad", [NAN, math.inf])
@pytest.mark.parametrize("place", range(3))
def test_where_one_is_no_number_the_newest_counts(bad, place):
    three = [(1.0,) * 3, (2.0,) * 3, (3.0,) * 3]
    three[place] = (bad,) * 3
    found = median_of_three(*three)
    assert found[0] == three[2][0] or math.isnan(found[0]) == math.isnan(three[2][0])


def test_one_wild_packet_never_reaches_the_law():
    bench, same = pushing(), pushing()
    bench.fold(lambda inp, _: with_force(inp, (BIAS[0] + 90.0, BIAS[1] - 90.0, BIAS[2])))
    same.fold()
    for _ in range(5):
        bench.fold()
        same.fold()
        assert bench.state.control.force_world == pytest.approx(same.state.control.force_world, abs=0.1)
        assert bench.state.control.theta_p == pytest.approx(same.state.control.theta_p, abs=0.005)


# --- finding it ----------------------------------------------------------------------------------------------


def window(*newtons, state=None):
    """Return a window with one reading each 10 ms for 0.1 s of every given force along x, and one more."""
    state, at = state or ContactState(), 1_000 * MS
    for newton in newtons:
        for _ in range(10):
            state = contact_threshold.add(state, (newton, 0.0, 0.0), at)
            at += 10 * MS
    return contact_threshold.add(state, (0.0, 0.0, 0.0), at)


@pytest.mark.parametrize(("newton", "found"), [(2.49, False), (2.5, True), (-9.0, False)])
def test_a_mean_of_two_and_a_half_newton_over_half_a_second_is_contact(newton, found):
    assert contact_threshold.found_by_mean(window(*[newton] * 5), AHEAD, rising=True) is found


def test_four_tenths_of_a_second_are_not_enough():
    assert not contact_threshold.found_by_mean(window(*[9.0] * 4), AHEAD, rising=True)


def test_only_the_part_along_the_motion_counts():
    assert not contact_threshold.found_by_mean(window(*[9.0] * 5), (0.0, 1.0), rising=True)
    assert contact_threshold.found_by_mean(window(*[4.0] * 5), (0.8, 0.6), rising=True)


@pytest.mark.parametrize(("before", "found"), [(0.0, True), (1.5, True), (1.51, False), (3.0, False)])
def test_a_first_contact_rises_and_a_drift_does_not(before, found):
    state = window(*[before] * 5, *[3.0] * 5)
    assert contact_threshold.found_by_mean(state, AHEAD, rising=True) is found
    assert contact_threshold.found_by_mean(state, AHEAD, rising=False)


def test_the_window_holds_one_second():
    state = window(*[9.0] * 5, *[1.0] * 10)
    assert len(state.means) == 30
    assert contact_threshold.felt(state, AHEAD) == pytest.approx(1.0)
    assert contact_threshold.start_window(state) == ContactState()


def test_a_new_search_begins_with_an_empty_window():
    """Also where only a part of a tenth of a second was felt."""
    begun = contact_threshold.add(ContactState(lost_below_N=3.0), (9.0, 1.0, 2.0), 5 * MS)
    assert begun.bucket_count == 1
    assert contact_threshold.start_window(begun) == ContactState(lost_below_N=3.0)


def test_the_mean_is_over_half_a_second_or_over_what_there_is():
    state, at = ContactState(), 1_000 * MS
    assert contact_threshold.mean_force(state) is None
    assert contact_threshold.along(None, AHEAD) == 0.0
    for n in range(8):  # a reading each 0.1 s: (0, 1, 2), (10, 11, 12), ...
        state = contact_threshold.add(state, (10.0 * n, 10.0 * n + 1, 10.0 * n + 2), at + 100 * n * MS)
        if n == 1:
            assert contact_threshold.mean_force(state) == (0.0, 1.0, 2.0)
            assert contact_threshold.mean_force(state, 1) is None
            assert contact_threshold.felt(state, AHEAD) == 0.0, "not yet half a second"
        if n == 3:
            assert contact_threshold.mean_force(state) == (10.0, 11.0, 12.0)
    assert contact_threshold.mean_force(state) == (40.0, 41.0, 42.0)
    assert contact_threshold.mean_force(state, 1) == (30.0, 31.0, 32.0)
    assert contact_threshold.felt(state, (0.6, 0.8)) == pytest.approx(0.6 * 40 + 0.8 * 41)


def test_the_mean_of_a_tenth_of_a_second_is_of_all_three_parts():
    state = ContactState()
    for force, ms in (((1.0, 2.0, 3.0), 0), ((4.0, 8.0, 16.0), 50), ((0.0, 0.0, 0.0), 100)):
        state = contact_threshold.add(state, force, ms * MS)
    assert contact_threshold.mean_force(state) == (2.5, 5.0, 9.5)


def test_the_force_before_a_contact_is_that_before_its_own_half_second():
    """3, 4, 0 N, half a second each: 3 N before a contact found by the mean of the 4 N, 3.2 N just before the last."""
    state = window(*[3.0] * 5, *[4.0] * 5)
    assert contact_threshold.force_before(state, by_mean=True) == pytest.approx(3.0)
    assert contact_threshold.force_before(window(*[3.0] * 5, 4.0, 9.0), by_mean=False) == pytest.approx(3.2)
    assert math.isnan(contact_threshold.force_before(window(4.0), by_mean=True))


def light(newton):
    """Return a bench on the approach to an object that pushes back with so much."""
    bench = ran_to(Phase.APPROACH)
    bench.force_path = (newton, 0.0)
    return bench


def test_an_object_of_four_newton_is_found_pushed_and_not_lost():
    bench = light(4.4)
    bench.run_until(lambda b: b.state.control.phase == Phase.PUSH)
    # 0.5 s and at most 0.1 s more, at 0.05 m/s
    assert GAP_M + 0.01 <= bench.state.control.contact_from_m <= GAP_M + 0.03
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0
    assert bench.state.control.lost_count == 0
    assert bench.state.control.contact.lost_below_N == pytest.approx(2.2, abs=0.05)


def test_an_object_too_light_to_be_felt_is_named_with_its_force():
    bench = light(2.0)
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD)
    assert "F53" in bench.output.faults
    value = bench.output.fault_values[bench.output.faults.index("F53")]
    assert value == pytest.approx(2.0, abs=0.1)


# --- losing it -----------------------------------------------------------------------------------------------


def learned(*forces, force_min=5.0):
    """Return what is known of an object after one force at each centimetre."""
    state = ContactState()
    for n, force in enumerate(forces):
        state = contact_threshold.learn(state, force, n * 0.01, force_min)
    return contact_threshold.lost_below(state, force_min)


def test_the_contact_is_lost_below_half_the_median_between_two_newton_and_force_min():
    assert learned(15.0, 15.0, 15.0) == 5.0
    assert learned(5.3, 5.3, 5.3) == pytest.approx(2.65)
    assert learned(3.0, 3.0, 3.0) == 2.0
    assert learned(8.0, 6.0, 99.0) == 4.0
    assert learned(9.0, 99.0, 8.0, 6.0, 4.2) == 4.0
    assert learned(15.0, 15.0) == 2.0, "nothing is known yet"
    assert learned(force_min=1.0) == 1.0


def test_the_threshold_falls_only():
    falling = learned(*[10.0] * 3, *[6.0] * 7)
    assert falling == 3.0
    assert learned(*[6.0] * 5, *[10.0] * 20) == 3.0


def test_a_sample_is_taken_each_centimetre():
    state = ContactState()
    for millimetres in range(1, 102):
        state = contact_threshold.learn(state, 8.0, millimetres / 1000, 5.0)
    assert len(state.samples) == 11


def test_only_the_first_half_metre_counts():
    state = ContactState()
    for n in range(51):
        state = contact_threshold.learn(state, 8.0, n * 0.01, 5.0)
    assert len(state.samples) == 51
    later = contact_threshold.learn(state, 4.0, 0.501, 5.0)
    assert later.samples == ()
    assert later.lost_below_N == 4.0
    assert contact_threshold.learn(later, 4.0, 0.1, 5.0) == later, "nor when it comes back over it"


def test_loss_is_counted_in_times_way_and_time():
    bench = pushing()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST, no_force)
    assert (bench.state.control.lost_count, bench.state.control.lost_ns) == (1, 0)
    for n in range(100):
        bench.fold(no_force, n)
    assert bench.state.control.lost_ns == 1_000_000_000
    assert bench.state.control.lost_m == pytest.approx(0.1, abs=0.001)
    bench.run_until(lambda b: b.state.control.phase == Phase.PUSH)
    before = bench.state.control
    for _ in range(50):
        bench.fold()
    assert (bench.state.control.lost_m, bench.state.control.lost_ns) == (before.lost_m, before.lost_ns)
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST, no_force)
    assert bench.state.control.lost_count == 2


def test_skipped_ticks_count_as_loss_and_a_speed_that_is_no_number_as_no_way():
    bench = pushing()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST, no_force)
    bench.fold(no_force)

    def altered(twist):
        return lambda inp, _: replace(
            no_force(inp), host=replace(inp.host, skipped=2), base=replace(inp.base, odometry=twist)
        )

    before = bench.state.control
    bench.fold(altered(BodyTwist(0.06, 0.08, 0.0)))
    assert bench.state.control.lost_ns - before.lost_ns == 30 * MS
    assert bench.state.control.lost_m - before.lost_m == pytest.approx(0.003)
    before = bench.state.control
    bench.fold(altered(BodyTwist(NAN, 0.1, 0.0)))
    assert bench.state.control.lost_m == before.lost_m


def test_a_base_that_is_held_while_the_contact_is_lost_loses_nothing():
    bench = pushing()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST, no_force)

    def held(inp, _):
        at = inp.now_ns - 70 * MS
        return replace(no_force(inp), arm=replace(inp.arm, published_ns=at, changed_ns=at))

    for n in range(50):
        bench.fold(held, n)
    assert bench.state.control.lost_ns <= 20 * MS


# --- the first contact ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("travelled", "expected", "early"),
    [
        (0.0, 0.3, False),
        (0.0, 0.31, True),
        (0.4, 0.8, False),
        (0.39, 0.7, False),
        (0.34, 0.7, True),
        (0.36, 0.7, False),
        (0.55, 1.2, True),
        (0.65, 1.2, False),
        (0.8, 0.5, False),
    ],
)
def test_early_is_more_than_30_cm_and_half_of_the_way(travelled, expected, early):
    assert contact_threshold.came_early(travelled, expected) is early


def test_a_contact_where_it_is_expected_is_not_early_and_follows_no_force():
    state = pushing().state.control
    assert not state.early_contact
    assert state.force_before_contact_N < 0.5


@pytest.mark.parametrize("expected", [0.3, 0.6])
def test_a_contact_after_five_centimetres_is_early_where_it_is_expected_after_sixty(expected):
    bench = ran_to(Phase.PUSH, (f"path.expected_contact_m={expected}",))
    assert bench.state.control.early_contact == (expected == 0.6)


def test_after_the_expected_place_no_contact_is_early():
    bench = ran_to(Phase.APPROACH, ("path.expected_contact_m=0.6",))
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    bench.fold(lambda inp, _: replace(no_force(inp), operator=2))
    bench.run_to(Phase.PUSH)
    assert not bench.state.control.early_contact


def test_a_sensor_that_drifts_in_free_air_makes_a_contact_that_says_so():
    """0.25 N/s along the push: contact at 5 N after 20 s, of which the half second before it has 4.9 N."""
    bench = ran_to(Phase.APPROACH, ("path.expected_contact_m=1.2",))

    def drifting(inp, n):
        return with_force(no_force(inp), (BIAS[0], BIAS[1] + 0.001 * (n % 7), BIAS[2] - 0.0025 * n))

    bench.run_until(lambda b: b.state.control.phase == Phase.PUSH, drifting)
    assert bench.state.control.force_before_contact_N == pytest.approx(4.85, abs=0.15)
    assert "F09-before" in bench.output.faults


# --- a start in contact --------------------------------------------------------------------------------------


def in_contact(newton):
    bench = FoldBench()
    bench.core = TickCore.of(bench.rig, in_contact=True)
    bench.pose = Pose2D(-1.0 + GAP_M, 0.0, 0.0)
    bench.force_path = (newton, 0.0)
    joints = bench.rig.arm.held_pose_rad
    bench.state = TickState(ControlState(tared=True, bias_force=BIAS[:3], bias_torque=BIAS[3:], held_joints=joints))
    return bench


@pytest.mark.parametrize("newton", [0.0, 4.4, 15.0, 60.0])
def test_a_force_ahead_or_none_is_plausible_and_the_saved_tare_stays(newton):
    bench = in_contact(newton).run_to(Phase.APPROACH)
    assert bench.output.faults == ()
    assert bench.state.control.bias_force == BIAS[:3]
    assert math.isnan(bench.state.control.force_before_contact_N)


@pytest.mark.parametrize(
    ("force", "refused"),
    [
        ((0.0, 0.0, 2.9), False),
        ((0.0, 0.0, 3.1), True),
        ((0.0, 0.0, -8.0), False),
        ((3.3, 0.0, 0.0), True),
        ((4.5, 0.0, -10.0), False),
        ((5.5, 0.0, -10.0), True),
    ],
)
def test_a_saved_tare_that_is_wrong_is_seen_at_rest(force, refused):
    """SENSOR frame: z is ahead and x within 15 degrees of up; what is measured is the reaction on the tool."""
    bench = in_contact(0.0)

    def offset(inp, _):
        one = inp.ft.readings[0]
        return with_force(inp, tuple(a + b for a, b in zip(one.force, force, strict=True)))

    bench.run_until(lambda b: b.state.control.refusal or b.state.control.phase == Phase.APPROACH, offset)
    assert bench.state.control.refusal == (4 if refused else 0)
    assert ("R02-contact" in bench.output.faults) is refused
    assert bench.output.command_body.vx == 0.0 or not refused


def test_a_base_that_is_moved_at_a_start_in_contact_waits_until_it_rests():
    bench = in_contact(15.0)
    driven = lambda inp, _: replace(inp, base=replace(inp.base, odometry=replace(inp.base.odometry, vx=0.05)))  # noqa: E731
    for n in range(530):
        bench.fold(driven, n)
    assert bench.state.control.phase == Phase.TARE
    assert "R05" in bench.output.faults
