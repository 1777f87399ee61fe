"""Each threshold of each check: the limit itself, and the next number beyond it."""

import math

import pytest
from msgspec.structs import replace

from robot_io.messages import BodyTwist, Pose2D
from robot_io.tick import ControlState, Mode, Phase, SafetyState
from safety.checks import (
    arm_checks,
    base_checks,
    host_checks,
    sensor_checks,
    task_checks,
)
from tests.safety.fold_bench import FoldBench

GOOD = FoldBench().good_input()
NOW = GOOD.now_ns
GOOD = replace(GOOD, base=replace(GOOD.base, odometry_received_ns=NOW, odometry_seq=1))
ZEROS = (0.0,) * 6
SETTINGS = replace(FoldBench().core.safety, held_pose=ZEROS)
TARED = ControlState(phase=int(Phase.PUSH), tared=True, speed=0.1)


def beyond(value):
    return math.nextafter(value, math.inf)


def below(value):
    return math.nextafter(value, -math.inf)


def with_base(**changes):
    return replace(GOOD, base=replace(GOOD.base, **changes))


def with_arm(**changes):
    joints = replace(GOOD.arm.joints, position=ZEROS)
    arm = replace(GOOD.arm, joints=joints)
    for key, value in changes.items():
        if hasattr(joints, key):
            arm = replace(arm, joints=replace(arm.joints, **{key: value}))
        else:
            arm = replace(arm, **{key: value})
    return replace(GOOD, arm=arm)


def first(value, axis=3):
    return tuple(value if i == axis else 0.0 for i in range(6))


# --- sensor ------------------------------------------------------------------------------------------------------


def sensor(force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), control=TARED):
    reading = replace(GOOD.ft.readings[0], force=force, torque=torque)
    inp = replace(GOOD, ft=replace(GOOD.ft, readings=(reading,)))
    return sensor_checks.check(SETTINGS, SafetyState(last_ft_force=(1.0, 0.0, 0.0)), inp, control)[1]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_saturation(sign):
    untared = ControlState(phase=int(Phase.TARE))
    assert sensor(force=(0.0, sign * 285.0, 0.0), control=untared) == ["F07"]
    assert sensor(force=(0.0, sign * below(285.0), 0.0), control=untared) == []
    assert sensor(torque=(0.0, 0.0, sign * 28.5), control=untared) == ["F07"]
    assert sensor(torque=(0.0, 0.0, sign * below(28.5)), control=untared) == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("axis", range(3))
def test_force_and_torque(sign, axis):
    def along(size):
        return tuple(sign * size if i == axis else 0.0 for i in range(3))

    assert sensor(along(100.0)) == []
    assert sensor(along(beyond(100.0))) == ["F50-slow"]
    assert sensor(along(150.0)) == ["F50-slow"]
    assert sensor(along(beyond(150.0))) == ["F50-stop"]
    assert sensor(torque=along(20.0)) == []
    assert sensor(torque=along(beyond(20.0))) == ["F51"]


def test_force_is_three_dimensional_and_without_its_bias():
    assert sensor((90.0, 90.0, 90.0)) == ["F50-stop"]  # 155.9 N, no axis of it above 100
    biased = replace(TARED, bias_force=(-60.0, 0.0, 30.0), bias_torque=(0.0, 15.0, 0.0))
    assert sensor((-60.0, 0.0, 30.0), (0.0, 15.0, 0.0), biased) == []
    assert sensor((45.0, 0.0, 30.0), (0.0, 15.0, 0.0), biased) == ["F50-slow"]  # 105 N away from the bias
    assert sensor((-60.0, 0.0, 30.0), (0.0, -5.1, 0.0), biased) == ["F51"]


def test_each_reading_of_a_tick_is_judged():
    spike = replace(GOOD.ft.readings[0], force=(151.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0))
    calm = replace(spike, force=(0.0, 0.0, 0.0))
    for readings in ((spike, calm, calm), (calm, spike, calm), (calm, calm, spike)):
        inp = replace(GOOD, ft=replace(GOOD.ft, readings=readings))
        assert sensor_checks.check(SETTINGS, SafetyState(), inp, TARED)[1] == ["F50-stop"]


@pytest.mark.parametrize(("age_ms", "row"), [(50, None), (80, "F01-slow"), (160, "F01-hold"), (10_000, "F01-stop")])
def test_age_of_the_sensor(age_ms, row):
    silent = replace(GOOD, ft=replace(GOOD.ft, readings=()))
    state = SafetyState(last_ft_ns=NOW - age_ms * 1_000_000)
    assert sensor_checks.check(SETTINGS, state, silent, TARED)[1] == ([row] if row else [])
    older = replace(state, last_ft_ns=state.last_ft_ns - 1)
    following = {None: "F01-slow", "F01-slow": "F01-hold", "F01-hold": "F01-stop"}.get(row, "F01-stop")
    assert sensor_checks.check(SETTINGS, older, silent, TARED)[1] == [following]


# --- arm ---------------------------------------------------------------------------------------------------------


def arm(state=None, settings=SETTINGS, **changes):
    if "state_" in changes:
        changes["state"] = changes.pop("state_")
    return arm_checks.check(settings, state or SafetyState(), with_arm(**changes), TARED)[1]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("axis", range(6))
def test_drift_of_each_joint(sign, axis):
    assert arm(position=first(sign * 0.005, axis)) == []
    assert arm(position=first(sign * beyond(0.005), axis)) == ["F20-hold"]
    assert arm(position=first(sign * 0.01, axis)) == ["F20-hold"]
    assert arm(position=first(sign * beyond(0.01), axis)) == ["F20-stop"]
    held_elsewhere = replace(SETTINGS, held_pose=first(sign * 0.05, axis))
    assert arm(settings=held_elsewhere) == []
    assert arm(settings=replace(SETTINGS, held_pose=first(sign * beyond(0.05), axis))) == ["R04"]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_moving_joint_counts_when_it_goes_on(sign):
    once = SafetyState(arm_velocity_run=1)
    assert arm(velocity=first(sign * beyond(0.02))) == []
    assert arm(once, velocity=first(sign * beyond(0.02))) == ["F21"]
    assert arm(once, velocity=first(sign * 0.02)) == []
    after, _ = arm_checks.check(SETTINGS, once, with_arm(velocity=first(sign * 0.02)), TARED)
    assert after.arm_velocity_run == 0


def test_a_joint_speed_counts_once_however_often_its_packet_is_read():
    """The arm speaks 125 times a second; a loop of 500 Hz sees each packet four times."""
    state, fast = SafetyState(), first(0.03)
    for _ in range(4):
        state, found = arm_checks.check(SETTINGS, state, with_arm(velocity=fast, packets=7), TARED)
        assert (state.arm_velocity_run, found) == (1, [])
    state, found = arm_checks.check(SETTINGS, state, with_arm(velocity=fast, packets=8), TARED)
    assert (state.arm_velocity_run, found) == (2, ["F21"])
    state, found = arm_checks.check(SETTINGS, state, with_arm(packets=8), TARED)
    assert found == ["F21"]  # not forgotten by the same packet, whatever it says
    assert arm_checks.check(SETTINGS, state, with_arm(packets=9), TARED)[1] == []


@pytest.mark.parametrize(
    ("key", "rows"), [("published_ns", ("F24-hold", "F24-stop")), ("changed_ns", ("F25-hold", "F25-stop"))]
)
def test_age_of_the_arm(key, rows):
    hold, stop = rows
    for age_ns, found in ((40_000_000, []), (40_000_001, [hold]), (100_000_000, [hold]), (100_000_001, [stop])):
        assert arm(**{key: NOW - age_ns}) == found


@pytest.mark.parametrize(
    ("state", "found"),
    [(0, ["F27"]), (1, []), (2, ["F27"]), (3, ["F22"]), (4, ["F23"]), (5, ["F27"]), (6, ["F28"]), (7, ["F27"])],
)
def test_states_of_the_arm(state, found):
    assert arm(state_=state) == found
    assert arm(settings=replace(SETTINGS, servo=True), state_=state, servo=True) == found


def test_an_arm_that_should_be_held_actively_and_is_not():
    servo = replace(SETTINGS, servo=True)
    assert arm(settings=servo, servo=True) == []
    assert arm(settings=servo, servo=False) == ["F20-stop"]


# --- base --------------------------------------------------------------------------------------------------------


def base(state=None, control=TARED, settings=SETTINGS, **changes):
    return base_checks.check(settings, state or SafetyState(), with_base(**changes), control)


@pytest.mark.parametrize(
    ("key", "steps"),
    [
        ("odometry_received_ns", [(100, "F31-hold"), (250, "F31-stop")]),
        ("pose_received_ns", [(50, "F40-slow"), (120, "F40-stop")]),
        ("published_ns", [(100, "F67-late")]),
    ],
)
def test_age_of_the_base(key, steps):
    current = []
    for age_ms, row in steps:
        assert base(**{key: NOW - age_ms * 1_000_000})[1] == current
        current = [row]
        assert base(**{key: NOW - age_ms * 1_000_000 - 1})[1] == current


def test_age_of_a_slow_localisation_counts_in_its_own_periods():
    """At 10 Hz: 3 and 6 periods, 300 and 600 ms."""
    slow = replace(SETTINGS, pose_period_ns=100_000_000)
    for age_ms, found in ((300, []), (301, ["F40-slow"]), (600, ["F40-slow"]), (601, ["F40-stop"])):
        assert base(settings=slow, pose_received_ns=NOW - age_ms * 1_000_000)[1] == found


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_heading_and_its_wrap(sign):
    limit = SETTINGS.max_heading_error
    assert base(pose=Pose2D(0.0, 0.0, sign * limit))[1] == []
    assert base(pose=Pose2D(0.0, 0.0, sign * beyond(limit)))[1] == ["F44"]
    across = replace(TARED, held_yaw=sign * 3.13)
    assert base(control=across, pose=Pose2D(0.0, 0.0, -sign * 3.13))[1] == []  # 1.3 degrees, across pi


def test_measured_speed():
    once = SafetyState(overspeed_run=1)
    limit, turn = 1.3 * SETTINGS.envelope.speed, 1.3 * 0.25
    for twist, fast in (
        (BodyTwist(limit), False), (BodyTwist(-beyond(limit)), True), (BodyTwist(0.0, beyond(limit)), True),
        (BodyTwist(0.0, 0.0, turn), False), (BodyTwist(0.0, 0.0, -beyond(turn)), True),
    ):  # fmt: skip
        assert ("F35" in base(once, odometry=twist, odometry_seq=9)[1]) == fast
        assert "F35" not in base(SafetyState(), odometry=twist, odometry_seq=9)[1]
    seen = SafetyState(overspeed_run=1, overspeed_seq=9)
    assert "F35" not in base(seen, odometry=BodyTwist(0.3), odometry_seq=9)[1]  # the same message again


def ignoring(twist, sent, mode=Mode.PUSHING):
    return base(SafetyState(mode=int(mode)), odometry=twist, sent=sent)[0].ignore_since_ns == NOW


def test_what_counts_as_ignoring_a_command():
    """Half of what was told, no less than 0.02 m/s."""
    told = BodyTwist(0.125, 0.0, 0.0)
    assert not ignoring(BodyTwist(0.0625, 0.0, 0.0), told)
    assert ignoring(BodyTwist(0.0625 - 1e-12, 0.0, 0.0), told)
    assert ignoring(BodyTwist(0.125, 0.0626, 0.0), told)
    assert not ignoring(BodyTwist(0.02, 0.0, 0.0), BodyTwist())
    assert ignoring(BodyTwist(0.0, beyond(0.02), 0.0), BodyTwist())
    for mode in Mode:
        assert ignoring(BodyTwist(), told, mode) == (mode in (Mode.PUSHING, Mode.SLOW, Mode.HOLD))


def test_ignoring_counts_from_its_beginning_and_is_forgotten():
    told, since = BodyTwist(0.1), NOW - 300_000_000
    late = SafetyState(mode=int(Mode.PUSHING), ignore_since_ns=since)
    assert base(late, odometry=BodyTwist(), sent=told)[1] == ["F33"]
    early = replace(late, ignore_since_ns=since + 1)
    assert base(early, odometry=BodyTwist(), sent=told)[1] == []
    assert base(late, odometry=told, sent=told)[0].ignore_since_ns == 0


def moving(zero_ms, speed=0.1, mode=Mode.STOP, odometry_age_ms=0, less_ns=0):
    state = SafetyState(mode=int(mode), zero_since_ns=NOW - zero_ms * 1_000_000 + less_ns)
    after, _ = base(state, odometry=BodyTwist(0.0, -speed, 0.0), odometry_received_ns=NOW - odometry_age_ms * 1_000_000)
    return after.moving_since_ns == NOW


def test_what_counts_as_moving_when_told_to_stand():
    """After 0.2 s and the braking time from 0.1 m/s at 2.5 m/s^2: 0.24 s."""
    assert moving(240)
    assert not moving(240, less_ns=1)
    assert not moving(240, speed=0.03)
    assert moving(240, speed=beyond(0.03))
    assert not moving(240, mode=Mode.HOLD)
    assert moving(240, mode=Mode.DEAD)
    assert moving(240, odometry_age_ms=100)
    assert not moving(240, odometry_age_ms=101)  # an old speed says nothing of now
    assert not base(SafetyState(mode=int(Mode.STOP)), odometry=BodyTwist(0.1))[0].moving_since_ns  # not told zero yet


def test_moving_counts_for_100_ms():
    state = SafetyState(mode=int(Mode.STOP), zero_since_ns=1, moving_since_ns=NOW - 100_000_000)
    rolling = BodyTwist(0.1)
    assert "F34" in base(state, odometry=rolling)[1]
    assert "F34" not in base(replace(state, moving_since_ns=NOW - 99_999_999), odometry=rolling)[1]
    assert base(state, odometry=BodyTwist())[0].moving_since_ns == 0


def test_what_counts_as_a_jump():
    """3 cm, or 0.05 rad, beyond what 1.3 times the envelope allows since the last good pose."""
    seen = SafetyState(pose_seq=5, pose_ns=NOW - 100_000_000)
    far, turned = 0.03 + 1.3 * 0.15 * 0.1, 0.05 + 1.3 * 0.25 * 0.1

    def jumps(pose):
        after, _ = base(seen, control=replace(TARED, held_yaw=pose.yaw), pose=pose, pose_seq=6, pose_received_ns=NOW)
        assert (after.pose_x, after.pose_yaw) == ((0.0, 0.0) if after.pose_jumps else (pose.x, pose.yaw))
        return after.pose_jumps

    assert jumps(Pose2D(far - 1e-9)) == jumps(Pose2D(0.0, 1e-9 - far)) == jumps(Pose2D(0.0, 0.0, turned - 1e-9)) == 0
    assert jumps(Pose2D(far + 1e-9)) == jumps(Pose2D(0.0, -far - 1e-9)) == jumps(Pose2D(0, 0, -turned - 1e-9)) == 1


def test_the_status_counts_only_when_there_is_one():
    pressed = replace(GOOD.base.status, stop_engaged=True)
    assert base(status=pressed)[1] == ["F38"]
    assert base(status=pressed, status_received_ns=0)[1] == []


# --- host and task -----------------------------------------------------------------------------------------------


def test_late_ticks():
    def host(skipped, run=0):
        inp = replace(GOOD, host=replace(GOOD.host, skipped=skipped))
        return host_checks.check(SETTINGS, SafetyState(late_run=run), inp)

    assert host(0, 9) == (SafetyState(), [])
    assert host(1)[1] == host(2, 1)[1] == ["F60-late"]
    assert host(1, 2)[1] == host(3)[1] == ["F60-late", "F60-slow"]


def test_a_recorder_that_is_back_is_forgotten():
    state = SafetyState(recorder_gone_ns=NOW - 999_000_000)
    assert host_checks.check(SETTINGS, state, GOOD)[0].recorder_gone_ns == 0


def test_thresholds_of_the_task():
    settling = ControlState(phase=int(Phase.SETTLE))
    assert task_checks.check(GOOD, settling, BodyTwist(), NOW - 5_000_000_000) == []
    assert task_checks.check(GOOD, settling, BodyTwist(), NOW - 5_000_000_001) == ["R01"]
    assert task_checks.check(GOOD, replace(TARED, backward_ticks=19), BodyTwist(), NOW) == []
    assert task_checks.check(GOOD, replace(TARED, backward_ticks=20), BodyTwist(), NOW) == ["F56"]
    assert task_checks.check(GOOD, replace(TARED, sideways_m=0.299), BodyTwist(), NOW) == []
    assert task_checks.check(GOOD, replace(TARED, sideways_m=0.3), BodyTwist(), NOW) == ["F56-way"]
    assert task_checks.check(GOOD, replace(TARED, residual_N=5.0), BodyTwist(), NOW) == []
    assert task_checks.check(GOOD, replace(TARED, residual_N=beyond(5.0)), BodyTwist(), NOW) == ["F09"]


@pytest.mark.parametrize("axis", range(3))
def test_the_bias_is_taken_off_each_axis(axis):
    force = tuple(60.0 if i == axis else 0.0 for i in range(3))
    torque = tuple(12.0 if i == axis else 0.0 for i in range(3))
    assert sensor(force, torque, replace(TARED, bias_force=force, bias_torque=torque)) == []


@pytest.mark.parametrize("y", [0.08, -0.08])
def test_a_base_that_goes_sideways_as_it_was_told_ignores_nothing(y):
    assert not ignoring(BodyTwist(0.06, y, 0.0), BodyTwist(0.06, y, 0.0))
    assert ignoring(BodyTwist(0.06, -y, 0.0), BodyTwist(0.06, y, 0.0))


@pytest.mark.parametrize("at", [Pose2D(3.0, -4.0, 2.0), Pose2D(-3.0, 4.0, -2.0)])
def test_a_base_that_stands_anywhere_has_not_jumped_nor_turned(at):
    seen = SafetyState(pose_seq=5, pose_ns=NOW, pose_x=at.x, pose_y=at.y, pose_yaw=at.yaw)
    after, found = base(seen, control=replace(TARED, held_yaw=at.yaw), pose=at, pose_seq=6)
    assert (after.pose_jumps, found) == (0, [])


@pytest.mark.parametrize("axis", range(3))
def test_force_and_torque_are_judged_without_the_bias_of_their_own_axis(axis):
    """150 N and 20 N*m beyond the bias of the axis they are on; the other axes have biases of their own."""
    bias, bias_torque = (1.0, -2.0, 4.0), (0.1, -0.2, 0.4)
    tared = replace(TARED, bias_force=bias, bias_torque=bias_torque)

    def plus(value, rest):
        return tuple(b + value if i == axis else b for i, b in enumerate(rest))

    assert sensor(bias, bias_torque, tared) == []
    for sign in (1.0, -1.0):
        assert sensor(plus(sign * 99.999, bias), bias_torque, tared) == []
        assert sensor(plus(sign * 149.999, bias), bias_torque, tared) == ["F50-slow"]
        assert sensor(plus(sign * 150.001, bias), bias_torque, tared) == ["F50-stop"]
        assert sensor(bias, plus(sign * 19.999, bias_torque), tared) == []
        assert sensor(bias, plus(sign * 20.001, bias_torque), tared) == ["F51"]


# --- the pose that control may use -------------------------------------------------------------------------------

KNOWN = SafetyState(pose_seq=5, pose_ns=NOW - 10_000_000, pose_x=1.0, pose_y=2.0, pose_yaw=0.1)
NEAR, FAR = Pose2D(1.001, 2.0, 0.1), Pose2D(3.0, 2.0, 0.1)


def used(state, pose, **changes):
    inp = with_base(pose=pose, pose_seq=6, pose_received_ns=NOW, **changes)
    return base_checks.trusted_pose(SETTINGS, state, inp)


def test_a_good_pose_is_used_and_else_the_last_good_one():
    last = Pose2D(1.0, 2.0, 0.1)
    assert used(KNOWN, NEAR) == NEAR
    assert used(KNOWN, FAR) == last
    assert used(KNOWN, NEAR, pose_valid=False) == last
    assert used(KNOWN, Pose2D(1.0, math.nan, 0.1)) == last


def test_before_the_first_good_pose_it_is_the_newest_whatever_it_is():
    assert used(SafetyState(), FAR) == FAR
    assert used(SafetyState(), FAR, pose_valid=False) == FAR
    first_of_all = used(replace(KNOWN, pose_seq=1), FAR)  # one good pose is one to fall back on
    assert first_of_all == Pose2D(1.0, 2.0, 0.1)


@pytest.mark.parametrize("bad", [math.inf, -math.inf, math.nan])
@pytest.mark.parametrize("place", ["x", "y", "yaw"])
def test_a_first_pose_that_is_no_number_is_a_fault_and_no_exception(bad, place):
    bench = FoldBench()

    def spoilt(inp, _since):
        return replace(inp, base=replace(inp.base, pose=replace(inp.base.pose, **{place: bad})))

    bench.run_until(lambda b: b.output.finished, spoilt, most=300)
    assert "F42" in bench.output.faults
    assert bench.output.command_body == BodyTwist()
