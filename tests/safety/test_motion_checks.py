"""Way and time of each phase, and the direction at their start: the limits of docs/safety.md for the shipped rig."""

import math

import pytest
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import ControlState, MotionState, Operator, Phase, SafetyState
from safety.checks import (
    motion_checks,
    task_checks,
)
from safety.motion_bounds import in_words, phase_bounds
from tests.safety.fold_bench import FoldBench, without_contact
from tools.rig import resolve_rig

SETTINGS = FoldBench().core.safety
GOOD = FoldBench().good_input()
STANDS = replace(GOOD, base=replace(GOOD.base, odometry=BodyTwist(), odometry_received_ns=1))
PHASES = {1: Phase.APPROACH, 2: Phase.PUSH, 3: Phase.RETREAT}


def judged(group, pose=(0.0, 0.0), **motion):
    state = SafetyState(pose_seq=1, pose_x=pose[0], pose_y=pose[1], motion=MotionState(group=group, at_ns=1, **motion))
    return motion_checks.check(SETTINGS, state, STANDS, ControlState(phase=int(PHASES[group])))[1]


def beyond(value):
    return math.nextafter(value, math.inf)


@pytest.mark.parametrize(("group", "row", "limit"), [(1, "F45-approach", 0.655), (2, "F45-push", 3.13),
                                                     (3, "F45-retreat", 0.105)])  # fmt: skip
def test_the_way_of_each_phase(group, row, limit):
    for way in ("sent_m", "measured_m"):
        assert judged(group, **{way: limit - 1e-9}) == []
        found = judged(group, **{way: limit + 1e-9})
        assert found == [row]
        assert found[0].value == pytest.approx(limit)


@pytest.mark.parametrize(("group", "row", "limit_s"), [(1, "F46-approach", 28.2), (2, "F46-push", 74.6),
                                                       (3, "F46-retreat", 6.2)])  # fmt: skip
def test_the_time_in_motion_of_each_phase(group, row, limit_s):
    assert judged(group, moving_ns=round(limit_s * 1e9) - 1000) == []
    assert judged(group, moving_ns=round(limit_s * 1e9) + 1000) == [row]


def test_the_bounds_follow_from_the_rig():
    """1.1 (0.05 + 0.5) + 0.05 m; 1.1 x 1.25 x 2 + 1.1 x 0.3 + 0.05 m; 1.1 x 0.05 + 0.05 m; twice the time."""
    bounds = phase_bounds(resolve_rig("sim", ()))
    assert (bounds.approach_m, bounds.push_m, bounds.retreat_m) == pytest.approx((0.655, 3.13, 0.105))
    assert bounds.approach_s == pytest.approx(2 * (0.655 / 0.05 + 1.0))
    assert bounds.push_s == pytest.approx(2 * (3.13 / 0.1 + 2.0) + 2 * (3.0 + 1.0))
    assert (bounds.lost_m, bounds.lost_s) == pytest.approx((0.33, 8.0))
    assert "0.66 m or 28 s of approach, 3.13 m or 75 s of push" in in_words(bounds)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_direction_at_the_start_of_a_phase(sign):
    """Judged between 2 and 5 cm of sent way, from 15 degrees on, and only where the pose has moved 5 mm."""

    def way(degrees, length=0.03):
        angle = sign * math.radians(degrees)
        return length * math.cos(angle), length * math.sin(angle)

    lead = {"lead_x": 0.03, "sent_m": 0.03, "aside_run": 2}
    for group in (1, 2):
        assert judged(group, way(14.9), **lead) == []
        assert judged(group, way(15.1), **lead) == ["F59"]
        assert judged(group, way(179.0), **lead) == ["F59"]
        assert judged(group, way(15.1), **lead | {"aside_run": 1}) == []
        assert judged(group, way(15.1), **lead | {"sent_m": 0.0199}) == []
        assert judged(group, way(15.1), **lead | {"sent_m": 0.0501}) == []
        assert judged(group, way(90.0, 0.0049), **lead) == []
    assert judged(3, way(90.0), **lead) == []


def test_a_place_outside_any_room_is_refused():
    state = SafetyState(pose_seq=1, pose_x=1000.0, pose_y=-1000.0)
    taring = ControlState(phase=int(Phase.TARE))
    assert motion_checks.check(SETTINGS, state, STANDS, taring)[1] == []
    for place in ({"pose_x": beyond(1000.0)}, {"pose_y": -beyond(1000.0)}):
        assert motion_checks.check(SETTINGS, replace(state, **place), STANDS, taring)[1] == ["R07"]


def test_way_and_time_count_while_sent_or_measured_speed_is_above_a_centimetre_a_second():
    bench = FoldBench().at_full_speed()
    for _ in range(200):
        bench.fold()
    before = bench.state.safety.motion
    for _ in range(100):
        bench.fold()
    after = bench.state.safety.motion
    assert after.sent_m - before.sent_m == pytest.approx(0.1, abs=1e-6)
    assert after.measured_m - before.measured_m == pytest.approx(0.1, abs=1e-4)
    assert after.moving_ns - before.moving_ns == 1_000_000_000
    still = replace(
        STANDS, base=replace(STANDS.base, sent=BodyTwist(0.01, 0.0, 0.0), odometry=BodyTwist(0.0, 0.01, 0.0))
    )
    rest = SafetyState(pose_seq=1, motion=MotionState(group=2, at_ns=GOOD.now_ns - 10_000_000))
    motion = motion_checks.check(SETTINGS, rest, still, ControlState(phase=int(Phase.PUSH)))[0].motion
    assert (motion.sent_m, motion.measured_m, motion.moving_ns) == (0.0, 0.0, 0)


def resume(inp, _=0):
    return replace(without_contact(inp), operator=int(Operator.RESUME))


def test_a_search_may_be_resumed_three_times_and_has_its_whole_way_each_time():
    bench, ways = FoldBench(), []
    for _ in range(3):
        bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, without_contact)
        ways.append(bench.state.safety.motion.sent_m)
        bench.fold(resume)
        assert bench.state.control.phase == Phase.APPROACH
        assert bench.state.safety.motion.sent_m < 0.001
    assert ways == pytest.approx([0.55] * 3, abs=0.01)
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, without_contact)
    bench.fold(resume)
    assert bench.state.control.phase == Phase.LOST_HOLD
    assert "F52-refused" in bench.output.faults
    bench.run_until(lambda b: b.output.finished, without_contact)
    assert bench.output.exit_code == 6


def test_a_resumed_push_may_lose_the_contact_once_more():
    state = SafetyState(pose_seq=1, motion=MotionState(
        group=2, at_ns=GOOD.now_ns, sent_m=1.0, measured_m=0.2, moving_ns=20_000_000_000))  # fmt: skip
    lost = ControlState(phase=int(Phase.LOST), resumes=1)
    motion = motion_checks.check(SETTINGS, state, STANDS, lost)[0].motion
    assert (motion.sent_m, motion.measured_m, motion.moving_ns) == (pytest.approx(0.67), 0.0, 12_000_000_000)
    assert motion.resumes == 1


def test_a_resume_that_was_refused_is_said():
    refused = ControlState(phase=int(Phase.LOST_HOLD), resumes=3, resume_refused=True, rest_since_ns=1)
    assert "F52-refused" in task_checks.check(GOOD, refused, BodyTwist(), GOOD.now_ns)
