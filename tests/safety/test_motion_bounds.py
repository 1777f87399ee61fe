"""The gate's own end of every push: what a run can need, from the rig, and what counts as travelled.

Shipped rig: contact is expected after 0.05 m and an approach goes 0.5 m beyond, at 0.05 m/s; 2 m of push at 0.1 m/s,
0.3 m or 3 s without contact, three resumes, 0.05 m of retreat, ramps of 1 s.
"""

import pytest
from msgspec.structs import replace

from robot_io.messages import BaseOdometry, BodyTwist, Stamped
from safety import gate
from safety.envelope import EnvelopeLimits
from safety.gate import GateState, Latch
from safety.gate_shell import GateShell
from safety.motion_bounds import TravelLimits, phase_bounds, total_bounds
from safety.travel import Travel
from tools.rig import resolve_rig

MS = 1_000_000
S = 1_000 * MS
ZERO, PUSH = BodyTwist(), BodyTwist(0.06, 0.08, 0.0)  # 0.1 m/s
LIMITS = EnvelopeLimits(0.15, 0.25, 1.0, 0.5, 10 * MS, 0.0, 0.0)
BOUNDS = TravelLimits(2.0, 30.0)


def test_what_the_shipped_rig_can_need():
    bounds = total_bounds(resolve_rig("sim"))
    # approach 0.55, push 1.25 x 2, lost 0.3, resumes 3 x 0.55, retreat 0.05; a tenth more for slip
    assert bounds.distance_m == pytest.approx(1.1 * (0.55 + 2.5 + 0.3 + 3 * 0.55 + 0.05))
    # approach 11 + 1, push 25 + 2, lost 3 + 1, resumes 3 x 12, retreat 1 + 1 s; twice for SLOW, a tenth for slip
    assert bounds.moving_s == pytest.approx(1.1 * 2 * (12 + 27 + 4 + 3 * 12 + 2))


@pytest.mark.parametrize(
    ("settings", "lost_m", "ramp_s"),
    [
        (("control.ramp_s=1.5",), 0.3, 1.5),
        (("control.ramp_s=1.5", "control.lost_time_s=4"), 0.4, 1.5),  # 4 s at 0.1 m/s
        (("control.ramp_s=1.5", "control.lost_distance_m=0.5"), 0.5, 1.5),
        (("limits.max_acceleration_m_per_s2=0.05",), 0.3, 2.0),  # 0.1 m/s at 0.05 m/s^2
    ],
)
def test_what_each_phase_can_need(settings, lost_m, ramp_s):
    """5 cm more each; twice the time for SLOW; one loss of contact within the push."""
    found = phase_bounds(resolve_rig("sim", settings))
    lost_time_s = 4 if "control.lost_time_s=4" in settings else 3
    approach_m, retreat_m = 1.1 * 0.55 + 0.05, 1.1 * 0.05 + 0.05
    push_m = 1.1 * 1.25 * 2 + 1.1 * lost_m + 0.05
    lost_s = 2 * (lost_time_s + ramp_s)
    assert (found.approach_m, found.push_m, found.retreat_m) == pytest.approx((approach_m, push_m, retreat_m))
    assert (found.lost_m, found.lost_s) == pytest.approx((1.1 * lost_m, lost_s))
    assert found.approach_s == pytest.approx(2 * (approach_m / 0.05 + ramp_s))
    assert found.push_s == pytest.approx(2 * (push_m / 0.1 + 2 * ramp_s) + lost_s)
    assert found.retreat_s == pytest.approx(2 * (retreat_m / 0.05 + ramp_s))


@pytest.mark.parametrize(
    ("setting", "more_m", "more_s"),
    [
        ("control.distance_m=4", 1.1 * 1.25 * 2, 2.2 * 25),
        ("path.expected_contact_m=0.1", 1.1 * 4 * 0.05, 2.2 * 4 * 1),
        ("control.retreat_m=0.1", 1.1 * 0.05, 2.2 * 1),
        ("control.lost_distance_m=0.4", 1.1 * 0.1, 0),
        ("control.lost_time_s=4", 1.1 * 0.1, 2.2 * 1),  # 0.1 m/s for 4 s
        ("control.ramp_s=2", 0, 2.2 * 8),  # approach, push twice, lost, three resumes, retreat
    ],
)
def test_what_each_setting_adds(setting, more_m, more_s):
    plain, changed = total_bounds(resolve_rig("sim")), total_bounds(resolve_rig("sim", (setting,)))
    assert changed.distance_m - plain.distance_m == pytest.approx(more_m)
    assert changed.moving_s - plain.moving_s == pytest.approx(more_s)


def test_a_gentle_rig_ramps_longer():
    plain = total_bounds(resolve_rig("sim"))
    gentle = total_bounds(resolve_rig("sim", ("limits.max_acceleration_m_per_s2=0.05",)))  # 2 s to 0.1 m/s
    assert gentle.moving_s - plain.moving_s == pytest.approx(2.2 * 8)


def test_what_was_sent_counts_by_its_time():
    travel = Travel().on_time(5 * S, PUSH)
    assert (travel.began, travel.distance_m) == (True, 0.0)
    for ms in range(2, 1001, 2):
        travel = travel.on_time(5 * S + ms * MS, PUSH)
    assert travel.sent_m == pytest.approx(0.1)
    assert travel.moving_ns == S
    rested = travel.on_time(9 * S, ZERO)
    assert (rested.sent_m, rested.moving_ns) == (travel.sent_m, S)  # a pause counts neither


@pytest.mark.parametrize(("speed", "counts"), [(0.01, False), (0.0101, True)])
def test_what_is_slower_than_a_centimetre_a_second_does_not_count(speed, counts):
    travel = Travel().on_time(0, BodyTwist(speed)).on_time(S, BodyTwist(speed))
    assert (travel.sent_m > 0.0) == (travel.moving_ns > 0) == counts


def test_what_odometry_measured_counts_although_nothing_is_sent():
    travel = Travel().on_time(0, PUSH)
    for ms in range(20, 3001, 20):
        travel = travel.on_speed(PUSH, ms * MS).on_time(ms * MS, ZERO)
    assert travel.sent_m == 0.0
    assert travel.measured_m == travel.distance_m == pytest.approx(0.3, abs=0.02)  # smoothed over 0.2 s
    assert travel.moving_ns == pytest.approx(3 * S, abs=0.2 * S)


def test_the_longer_way_counts():
    travel = Travel(began=True, sent_m=0.3, measured_m=0.2)
    assert travel.distance_m == 0.3
    assert replace(travel, measured_m=0.4).distance_m == 0.4


def test_a_joystick_before_the_first_motion_does_not_count():
    travel = Travel()
    for ms in range(20, 3001, 20):
        travel = travel.on_speed(PUSH, ms * MS).on_time(ms * MS, ZERO)
    assert (travel.began, travel.distance_m, travel.moving_ns) == (False, 0.0, 0)


def test_noise_of_odometry_at_rest_does_not_count():
    """10 mm/s of white noise on each axis, as the world has it; one minute."""
    import random

    noise = random.Random(1)
    travel = Travel().on_time(0, PUSH)
    for ms in range(20, 60_001, 20):
        travel = travel.on_speed(BodyTwist(noise.gauss(0, 0.01), noise.gauss(0, 0.01), 0.0), ms * MS)
        travel = travel.on_time(ms * MS, ZERO)
    assert travel.measured_m < 0.01


@pytest.mark.parametrize("bad", [BodyTwist(float("nan"), 0.1, 0.0), BodyTwist(0.1, float("inf"), 0.0)])
def test_a_speed_that_is_no_number_is_left_out(bad):
    travel = Travel().on_speed(PUSH, S)
    assert travel.on_speed(bad, 2 * S) == travel


def test_a_measured_speed_is_smoothed_over_a_fifth_of_a_second():
    """20 ms are a tenth of it; after as long as it, or longer, only the newest sample counts."""
    travel = replace(Travel(), measured_ns=S).on_speed(BodyTwist(0.1, -0.2, 0.0), S + 20 * MS)
    assert (travel.vx, travel.vy, travel.measured_ns) == (pytest.approx(0.01), pytest.approx(-0.02), S + 20 * MS)
    for later_ns in (S + 220 * MS, 5 * S):
        assert travel.on_speed(BodyTwist(0.3, 0.1, 0.0), later_ns).vx == pytest.approx(0.3)


def test_a_run_begins_with_nothing_travelled():
    assert Travel() == Travel(
        began=False, at_ns=0, sent_m=0.0, measured_m=0.0, moving_ns=0, vx=0.0, vy=0.0, measured_ns=0
    )


def test_time_that_goes_back_counts_nothing():
    travel = Travel().on_time(S, PUSH).on_speed(PUSH, S)
    back = travel.on_time(0, PUSH)
    assert (back.sent_m, back.measured_m, back.moving_ns) == (0.0, 0.0, 0)
    assert travel.on_speed(ZERO, 0).vx == travel.vx


@pytest.mark.parametrize(
    ("travel", "latch"),
    [
        (Travel(sent_m=2.0, moving_ns=30 * S), Latch.NONE),
        (Travel(sent_m=2.001), Latch.TRAVEL),
        (Travel(measured_m=2.001), Latch.TRAVEL),
        (Travel(moving_ns=30 * S + MS), Latch.MOVING_TIME),
    ],
)
def test_beyond_the_bound_the_gate_latches(travel, latch):
    assert gate.on_travel(BOUNDS, GateState(), travel).latch == latch
    assert gate.on_travel(BOUNDS, GateState(latch=Latch.STEP), travel).latch == Latch.STEP


def rolling(at_ns: int) -> GateShell:
    return GateShell(LIMITS, BOUNDS, 0).on_sent(PUSH, PUSH, at_ns)


def test_the_gate_ends_a_push_that_nobody_else_ends():
    """0.1 m/s for ever: 2 m are over after 20 s, and the fault says by how much."""
    shell, latching, ms = rolling(0), None, 0
    while latching is None and ms < 60_000:
        ms += 2
        shell, latching = shell.on_leaving(ms * MS)
    assert 20_000 <= ms <= 20_004
    assert (latching.latch, latching.fault) == (Latch.TRAVEL, "F47")
    assert latching.text == "the base has travelled further than this push can need: 2.00 m, limit 2.00 m"
    assert shell.due(ms * MS) == ZERO
    record = shell.on_publish(ms * MS, newest_inbound_ns=0, newest_pong_ns=0).record
    assert record.travel_m == pytest.approx(2.0, abs=0.001)
    assert record.moving_s == pytest.approx(20.0, abs=0.01)


def test_and_one_that_only_creeps_on():
    shell = GateShell(LIMITS, BOUNDS, 0).on_sent(BodyTwist(0.02), BodyTwist(0.02), 0)
    latching, ms = None, 0
    while latching is None and ms < 60_000:
        ms += 10
        shell, latching = shell.on_leaving(ms * MS)
    assert 30_000 <= ms <= 30_020
    assert (latching.latch, latching.fault) == (Latch.MOVING_TIME, "F48")
    assert latching.text == "the base has moved for longer than this push can need: 30 s, limit 30 s"


def test_the_gate_measures_with_odometry_what_it_did_not_send():
    shell = rolling(0).on_leaving(MS)[0].on_sent(ZERO, ZERO, 2 * MS)
    latching, ms = None, 2
    while latching is None and ms < 60_000:
        ms += 20
        shell = shell.on_samples([Stamped(BaseOdometry(PUSH), 0, ms * MS)])
        shell, latching = shell.on_leaving(ms * MS)
    assert 20_000 <= ms <= 20_300
    assert latching.latch == Latch.TRAVEL
