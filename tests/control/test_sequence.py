"""The sequence of a push through the real fold: settle, tare, approach, push, lose and find again, rest, check."""

import math
from itertools import pairwise

import pytest
from msgspec.structs import replace

from control.sensing import sense
from control.sequence import advance, all_devices_sent_data
from control.settings import Settings
from robot_io.messages import BodyTwist, Pose2D
from robot_io.tick import ControlState, Mode, Operator, Phase, TickState
from tests.how_many import mostly_long
from tests.safety.fold_bench import BIAS, GAP_M, FoldBench, pushing, ran_to
from tests.safety.fold_bench import without_contact as no_force
from tools.run.tick_core import TickCore


def resume(inp, _=0):
    return replace(no_force(inp), operator=int(Operator.RESUME))


def carried_to(bench, **place):
    """Put the base elsewhere as if it had gone there: safety knows the place, so that it is no jump."""
    bench.pose = replace(bench.pose, **place)
    moved = {f"pose_{key}": value for key, value in place.items()}
    bench.state = replace(bench.state, safety=replace(bench.state.safety, **moved))


def felt(bench, alter=None, packets=2):
    """Fold two ticks: of the median of three readings, what is new is felt with the second packet."""
    for n in range(packets):
        bench.fold(alter, n)


def velocity(bench):
    twist = bench.output.wanted_world
    return twist.vx, twist.vy


# --- start ---------------------------------------------------------------------------------------------------


def quiet_devices():
    """Name each way of a device not having spoken yet."""

    def of(name, **changes):
        return lambda inp: replace(inp, **{name: replace(getattr(inp, name), **changes)})

    def old(name, key, ms):
        return lambda inp: replace(inp, **{name: replace(getattr(inp, name), **{key: inp.now_ns - ms * 1_000_000})})

    return {
        "19 packets of the sensor": of("ft", packets_ok=19),
        "arm not up": of("arm", link=1),
        "19 packets of the arm": of("arm", packets=19),
        "old arm record": old("arm", "published_ns", 101),
        "no valid pose": of("base", pose_valid=False),
        "19 poses": of("base", pose_seq=19),
        "old pose": old("base", "pose_received_ns", 101),
        "no odometry": of("base", odometry_seq=0),
        "old odometry": old("base", "odometry_received_ns", 101),
    }


@pytest.mark.parametrize("name", quiet_devices())
def test_nothing_begins_before_every_device_has_spoken(name):
    silence = quiet_devices()[name]
    bench = FoldBench()
    for n in range(60):
        bench.fold(lambda inp, _: silence(inp), n)
    assert bench.state.control.phase == Phase.SETTLE
    assert (bench.output.mode, bench.output.faults) == (Mode.SILENT, ())
    bench.fold()
    assert bench.state.control.phase == Phase.TARE
    assert bench.output.mode == Mode.READY
    assert bench.state.control.held_joints == bench.rig.arm.held_pose_rad


def test_what_is_a_tenth_of_a_second_old_is_fresh_enough_to_begin():
    bench = FoldBench()
    for n in range(60):
        bench.fold(lambda inp, _: replace(inp, base=replace(inp.base, pose_seq=0)), n)
    settings, state, inp = Settings.of(bench.rig), bench.state.control, bench.inp
    at_ns = inp.now_ns - 100_000_000
    base = replace(inp.base, pose_seq=20, pose_received_ns=at_ns, odometry_received_ns=at_ns)
    old = replace(inp, base=base, arm=replace(inp.arm, published_ns=at_ns))
    assert all_devices_sent_data(settings, replace(state, last_reading_ns=at_ns), old)
    assert not all_devices_sent_data(settings, replace(state, last_reading_ns=at_ns - 1), old)


def test_nothing_moves_before_the_approach():
    bench = FoldBench()
    while bench.state.control.phase < Phase.APPROACH:
        assert bench.fold().command_body == BodyTwist() or bench.state.control.phase == Phase.APPROACH
    assert bench.tick == 20 + 100  # 20 packets of each device, then a second of tare


def test_a_saved_tare_is_kept_after_a_second_at_rest_and_so_are_its_own_joints():
    bench = FoldBench()
    bench.core = TickCore.of(bench.rig, in_contact=True)
    joints = tuple(q + 0.004 for q in bench.rig.arm.held_pose_rad)
    bench.state = TickState(ControlState(tared=True, bias_force=BIAS[:3], bias_torque=BIAS[3:], held_joints=joints))
    bench.run_to(Phase.APPROACH)
    assert bench.tick == 20 + 100
    assert bench.state.control.held_joints == joints
    bench.pose = Pose2D(-0.95, 0.0, 0.0)  # the ball at the object
    bench.run_to(Phase.PUSH)
    assert bench.state.control.bias_force == BIAS[:3]


# --- approach ------------------------------------------------------------------------------------------------


def test_the_approach_ramps_up_along_the_path_until_five_samples_of_force():
    bench = ran_to(Phase.APPROACH, ("control.force_filter_tau_s=0",))
    speeds = []
    while bench.state.control.phase == Phase.APPROACH:
        bench.fold()
        speeds.append(bench.state.control.speed)
        if bench.state.control.phase == Phase.APPROACH:
            assert velocity(bench) == pytest.approx((speeds[-1], 0.0), abs=1e-12)
    assert speeds[:3] == pytest.approx([0.0005, 0.001, 0.0015], abs=1e-12)
    assert max(speeds) == 0.05
    assert bench.state.control.contact_run == 5
    # 5 samples, a packet late, at 0.05 m/s and 100 Hz: the push begins 5 ticks of 0.5 mm behind the first touch.
    assert bench.state.control.contact_from_m == pytest.approx(GAP_M + 5 * 0.0005, abs=0.0006)
    assert bench.state.control.progress_m == 0.0


def test_no_progress_is_counted_before_the_first_contact():
    """In its first second the approach goes 2.5 cm along the path; none of that is a push."""
    bench = ran_to(Phase.APPROACH)
    for _ in range(100):
        bench.fold(no_force)
        assert bench.state.control.progress_m == 0.0
    assert bench.output.contact_x == pytest.approx(0.025, abs=0.001)


def test_four_samples_are_no_contact():
    bench = ran_to(Phase.APPROACH, ("control.force_filter_tau_s=0",))
    for n in range(40):
        bench.force_path = (15.0, 0.0)
        bench.fold(None if n % 5 else no_force)
        assert bench.state.control.contact_run <= 4
    assert bench.state.control.phase == Phase.APPROACH


@pytest.mark.parametrize("force", [(15.0, 0.0), (0.0, 15.0), (-15.0, 0.0)])
def test_contact_is_a_matter_of_size_not_of_direction(force):
    bench = ran_to(Phase.APPROACH)
    bench.force_path = force
    bench.run_to(Phase.PUSH)
    assert bench.state.control.contact_seen


def test_an_object_that_is_not_there_ends_the_run_at_rest_with_exit_6():
    bench = ran_to(Phase.APPROACH)
    from_x = bench.pose.x
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    # 0.5 m beyond the expected 0.05 m, then braked
    assert bench.pose.x - from_x == pytest.approx(0.55, abs=0.002)
    assert bench.output.mode == Mode.HOLD
    assert "F53" in bench.output.faults
    ticks = bench.run_until(lambda b: b.output.finished, no_force)
    assert 200 <= ticks <= 215
    assert bench.output.exit_code == 6
    assert bench.output.command_body == BodyTwist()
    assert bench.state.control.phase == Phase.FAILED


def test_the_operator_may_look_further():
    bench = ran_to(Phase.APPROACH)
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    bench.fold(resume)
    assert bench.state.control.phase == Phase.APPROACH
    from_x = bench.pose.x
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert bench.pose.x - from_x == pytest.approx(0.55, abs=0.01)


# --- push ----------------------------------------------------------------------------------------------------


def test_the_push_ramps_from_the_speed_of_the_approach_in_a_second():
    bench = ran_to(Phase.PUSH)
    began = bench.tick
    speeds = []
    while bench.tick < began + 120:
        bench.fold()
        speeds.append(bench.state.control.speed)
    assert speeds[0] == pytest.approx(0.05 + 0.05 * 0.01, abs=1e-9)
    assert speeds[49] == pytest.approx(0.075, abs=1e-9)
    assert speeds[99:] == [0.1] * 21


def test_the_law_steers_in_the_world():
    """Force 0.2 rad to the left, 0.1 m right of the path, k_f 0.3, k_y 0.2: 1.3 x 0.2 - 0.2 x 0.1 = 0.24 rad."""
    bench = pushing(("control.force_filter_tau_s=0",))
    carried_to(bench, y=-0.1)
    bench.force_path = (15.0 * math.cos(0.2), 15.0 * math.sin(0.2))
    felt(bench)
    carried_to(bench, y=-0.1)
    bench.fold()
    assert bench.state.control.lateral_m == pytest.approx(-0.1, abs=1e-12)
    assert bench.state.control.theta_f == pytest.approx(0.2, abs=4e-3)  # the bench's scatter of 0.05 N
    assert bench.state.control.theta_p == pytest.approx(0.24, abs=5e-3)
    theta_p = bench.state.control.theta_p
    assert velocity(bench) == pytest.approx((0.1 * math.cos(theta_p), 0.1 * math.sin(theta_p)), abs=1e-12)


def test_the_world_velocity_is_turned_by_the_measured_heading_and_the_heading_held():
    bench = pushing()
    carried_to(bench, yaw=0.04)
    bench.fold()
    wanted = bench.output.wanted_body
    theta_p = bench.state.control.theta_p
    assert (wanted.vx, wanted.vy) == pytest.approx(
        (0.1 * math.cos(theta_p - 0.04), 0.1 * math.sin(theta_p - 0.04)), abs=1e-12
    )
    assert wanted.omega == pytest.approx(-0.04, abs=1e-12)
    carried_to(bench, yaw=-0.08)
    bench.fold()
    assert bench.output.wanted_body.omega == pytest.approx(0.08, abs=1e-12)


def test_the_open_loop_baseline_goes_straight_whatever_it_feels():
    bench = pushing(('control.law="open-loop"', "control.force_filter_tau_s=0"))
    bench.force_path = (10.0, 10.0)
    bench.pose = replace(bench.pose, y=0.02)
    felt(bench)
    assert bench.state.control.theta_f == pytest.approx(math.pi / 4, abs=0.01)
    assert bench.state.control.theta_p == 0.0
    assert velocity(bench) == pytest.approx((0.1, 0.0), abs=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_push_angle_beyond_90_degrees_pushes_sideways_and_after_0_3_m_it_is_a_fault(side):
    """Force at 75 degrees, k_f 0.3: 97.5 degrees wanted. The ball goes sideways, never backward, for 3 s at 0.1 m/s."""
    bench = pushing(("control.force_filter_tau_s=0", "control.k_y_rad_per_m=0", "control.distance_m=3"))
    angle = side * math.radians(75.0)
    bench.force_path = (15.0 * math.cos(angle), 15.0 * math.sin(angle))
    bench.fold()
    assert bench.state.control.sideways_m == 0.0, "the median of three has it with the second packet"
    for n in range(1, 300):
        bench.fold()
        assert bench.output.faults == (), n
        assert bench.state.control.theta_p == pytest.approx(side * math.pi / 2)
        assert bench.state.control.theta_f == pytest.approx(angle, abs=0.01)
        assert bench.state.control.sideways_m == pytest.approx(0.001 * n)
    bench.fold()
    bench.fold()
    assert bench.output.faults == ("F56-way",)
    assert bench.output.mode == Mode.STOP
    assert bench.output.command_body == BodyTwist()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_force_that_points_backward_is_a_fault_and_not_followed(side):
    """Force at 110 degrees: 143 wanted. The direction stays as it was until the fault stops it after 20 ticks."""
    bench = pushing(("control.force_filter_tau_s=0", "control.k_y_rad_per_m=0"))
    for _ in range(100):  # beyond where F11 compares force and motion
        bench.fold()
    angle = side * math.radians(110.0)
    bench.force_path = (15.0 * math.cos(angle), 15.0 * math.sin(angle))
    bench.fold()
    before = bench.state.control.theta_p
    for n in range(19):
        bench.fold()
        assert bench.state.control.backward_ticks == n + 1
        assert bench.output.faults == ()
        assert bench.state.control.theta_p == before
    bench.fold()
    assert bench.output.faults == ("F56",)
    assert bench.output.mode == Mode.STOP
    assert bench.output.command_body == BodyTwist()


def test_a_moment_beyond_90_degrees_is_forgiven():
    bench = pushing(("control.force_filter_tau_s=0", "control.k_y_rad_per_m=0", "control.distance_m=3"))
    for _ in range(3):
        bench.force_path = (15.0 * math.cos(1.4), 15.0 * math.sin(1.4))
        for _ in range(290):
            bench.fold()
        bench.force_path = (15.0, 0.0)
        felt(bench)
        assert bench.state.control.sideways_m == 0.0
    assert bench.output.faults == ()


def test_a_lost_force_begins_the_way_sideways_anew():
    bench = pushing(("control.force_filter_tau_s=0", "control.k_y_rad_per_m=0", "control.distance_m=3"))
    for _ in range(2):
        bench.force_path = (15.0 * math.cos(1.4), 15.0 * math.sin(1.4))
        for _ in range(290):
            bench.fold()
        felt(bench, no_force)
        assert bench.state.control.phase == Phase.LOST
        assert bench.state.control.sideways_m == 0.0
    assert bench.output.faults == ("F52",)


def test_just_below_90_degrees_is_pushed():
    bench = pushing(("control.force_filter_tau_s=0", "control.k_y_rad_per_m=0"))
    angle = math.radians(69.0)  # 1.3 x 69 = 89.7
    bench.force_path = (15.0 * math.cos(angle), 15.0 * math.sin(angle))
    for _ in range(30):
        bench.fold()
    assert bench.state.control.theta_p == pytest.approx(1.3 * angle, abs=0.01)
    assert bench.output.faults == ()


# --- the force is lost ---------------------------------------------------------------------------------------


def lost(lateral=0.0, overrides=("control.force_filter_tau_s=0",)):
    """Return a bench in its first tick of LOST, `lateral` m left of the path."""
    bench = pushing(overrides)
    if lateral:
        bench.pose = replace(bench.pose, y=lateral)
        bench.force_path = (15.0 * math.cos(0.1), 15.0 * math.sin(0.1))
        bench.fold()
    felt(bench, no_force)
    assert bench.state.control.phase == Phase.LOST
    return bench


def test_without_force_the_law_is_not_evaluated_and_the_pusher_turns_back():
    """2 cm left, k_y 0.2: the way back is -0.004 rad; turning there at 0.2 rad/s is 0.002 rad a tick."""
    bench = FoldBench(("control.force_filter_tau_s=0",))
    bench.pose = replace(bench.pose, y=0.02)
    bench.at_full_speed()
    for n in range(6):
        bench.pose = replace(bench.pose, y=0.02)
        bench.force_path = (15.0 * math.cos(0.05), 15.0 * math.sin(0.05))
        bench.fold(no_force if n == 5 else None)  # felt with the next packet only
    theta_f, theta_p = bench.state.control.theta_f, bench.state.control.theta_p
    assert theta_p == pytest.approx(1.3 * 0.05 + 0.2 * 0.02, abs=0.005)
    for n in range(1, 46):
        bench.fold(no_force)
        wanted = -0.2 * bench.state.control.lateral_m
        assert bench.state.control.theta_f == theta_f
        assert bench.state.control.theta_p == pytest.approx(max(theta_p - 0.002 * n, wanted), abs=1e-9)
        assert bench.output.faults == ("F52",)
        assert bench.output.mode == Mode.PUSHING
    assert bench.state.control.theta_p == pytest.approx(-0.2 * bench.state.control.lateral_m, abs=1e-9)


@pytest.mark.parametrize("lateral", [0.02, -0.02])
def test_the_open_loop_baseline_searches_straight_ahead(lateral):
    """It knows no k_y: 2 cm beside the path it goes on along the path, touching or not."""
    bench = pushing(("control.force_filter_tau_s=0", "control.law=open-loop"))
    carried_to(bench, y=lateral)
    bench.fold(no_force)
    for n in range(45):
        bench.fold(no_force, n)
        assert bench.state.control.phase == Phase.LOST
        assert bench.state.control.lateral_m == pytest.approx(lateral, abs=1e-6)
        assert bench.state.control.theta_p == 0.0
        assert velocity(bench)[1] == pytest.approx(0.0, abs=1e-9)


def test_a_push_that_lost_its_object_is_not_done_by_distance():
    """Two metres are pushed, not driven: beyond them without force it goes on searching."""
    bench = pushing(("control.force_filter_tau_s=0",))
    bench.run_until(lambda b: b.state.control.progress_m > 1.995)
    for n in range(200):
        bench.fold(no_force, n)
        if bench.state.control.progress_m > 2.0:
            break
    bench.fold(no_force)
    assert bench.state.control.progress_m > 2.0
    assert bench.state.control.phase == Phase.LOST
    felt(bench)
    assert bench.state.control.phase == Phase.REST


def test_a_push_ends_right_on_its_distance():
    """Reached is reached: at 2 m and not a step beyond, here to the last bit (the contact began at 0)."""
    bench = pushing(("control.force_filter_tau_s=0",))
    contact_x = 2.0 + bench.state.control.contact_from_m
    carried_to(bench, x=contact_x - bench.rig.frames.contact_in_base_m[0])
    control = replace(bench.state.control, contact_from_m=bench.pose.x + bench.rig.frames.contact_in_base_m[0] - 2.0)
    bench.state = replace(bench.state, control=control)
    bench.fold()
    assert bench.state.control.progress_m == 2.0
    assert bench.state.control.phase == Phase.REST


def test_the_search_ends_after_three_seconds():
    bench = lost(overrides=("control.force_filter_tau_s=0", "control.lost_distance_m=2"))
    ticks = bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert ticks == 300  # more than 3 s after the first tick of LOST


def test_the_search_ends_after_thirty_centimetres():
    bench = lost(overrides=("control.force_filter_tau_s=0", "control.lost_time_s=10"))
    x = bench.state.control.anchor_x
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert bench.output.contact_x - x == pytest.approx(0.3, abs=0.0011)


def test_at_the_default_speed_both_bounds_hold():
    bench = lost()
    ticks = bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert ticks in (299, 300)
    assert bench.output.contact_x - bench.state.control.anchor_x <= 0.3011


def test_then_it_holds_and_after_two_seconds_at_rest_the_push_has_failed():
    bench = lost()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert "F52-hold" in bench.output.faults
    assert bench.output.mode == Mode.HOLD
    rest = bench.run_until(lambda b: b.output.command_body == BodyTwist(), no_force)
    assert rest <= 10  # 0.1 m/s at 1 m/s^2
    ticks = bench.run_until(lambda b: b.output.finished, no_force)
    assert 195 <= ticks <= 205
    assert bench.output.exit_code == 6
    assert bench.state.control.phase == Phase.FAILED
    assert bench.state.control.end_progress_m == bench.state.control.progress_m > 0.2


def test_a_force_that_comes_back_in_the_search_goes_on_pushing():
    bench = lost()
    for n in range(50):
        bench.fold(no_force, n)
    felt(bench)
    assert bench.state.control.phase == Phase.PUSH
    assert bench.output.faults == ()
    felt(bench, no_force)  # lost again: a new search with all its time
    ticks = bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert ticks >= 299


def test_the_operator_resumes_the_search_and_the_push_goes_on():
    bench = lost()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    for n in range(100):
        bench.fold(no_force, n)
    bench.fold(resume)
    assert bench.state.control.phase == Phase.LOST
    bench.run_until(lambda b: b.output.command_body != BodyTwist(), no_force)
    bench.run_until(lambda b: b.state.control.phase == Phase.PUSH)
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0
    assert bench.state.control.end_progress_m == pytest.approx(2.0, abs=0.005)


def test_an_operator_who_resumes_while_nothing_is_lost_changes_nothing():
    bench, same = pushing(), pushing()
    bench.fold(lambda inp, _: replace(inp, operator=int(Operator.RESUME)))
    same.fold()
    assert bench.state == same.state


def test_an_old_force_is_no_force():
    """With no packet for 100 ms the force is not valid, whatever it was."""
    bench = pushing()
    silent = lambda inp, _: replace(inp, ft=replace(inp.ft, readings=()))  # noqa: E731
    ticks = bench.run_until(lambda b: not b.state.control.force_valid, silent)
    assert ticks == 10
    assert bench.output.mode == Mode.HOLD  # after 80 ms without a packet; the sequence waits meanwhile
    assert bench.state.control.phase == Phase.PUSH
    assert bench.state.control.force_world[0] > 14.0


def test_a_force_that_is_no_number_is_no_force_and_the_next_good_one_starts_afresh():
    bench = pushing()
    bad = lambda inp, _: replace(  # noqa: E731
        inp, ft=replace(inp.ft, readings=(replace(inp.ft.readings[0], force=(math.nan, 0.0, 0.0)),))
    )
    bench.fold(bad)
    assert not bench.state.control.force_valid
    assert bench.state.control.contact_run == 0
    bench.fold()
    assert bench.state.control.force_valid
    assert bench.state.control.force_world == pytest.approx((15.0, 0.0, 0.0), abs=0.1)


# --- the filter ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("split", [1, 2, 5])
def test_the_filter_takes_each_packet_with_its_own_time(split):
    """A step filtered over 50 ms (tau 0.05 s) has gone 1 - 1/e of its way, however many packets told of it."""
    bench = pushing()
    bench.force_path = (15.0, 0.0)

    def burst(inp, _):
        one = inp.ft.readings[0]
        step = 10_000_000 // split
        readings = tuple(
            replace(one, received_ns=inp.now_ns - (split - 1 - i) * step, force=(BIAS[0], BIAS[1], BIAS[2] - 25.0))
            for i in range(split)
        )
        return replace(inp, ft=replace(inp.ft, readings=readings))

    # The first packet of the step is felt with the next one, which counts from there on.
    bench.fold(burst)
    start = bench.state.control.force_world[0]
    for n in range(5):
        bench.fold(burst, n)
    assert bench.state.control.force_world[0] == pytest.approx(25.0 + (start - 25.0) * math.exp(-1.0), abs=0.05)


def filtered(force_world, gap_ms, tau_s=0.1):
    """Return the force after one packet of 10 N along x that came `gap_ms` after the last one."""
    bench = pushing((f"control.force_filter_tau_s={tau_s}",))
    settings = bench.core.control
    now_ns = 10_000_000_000
    reading = replace(bench.good_input().ft.readings[0], received_ns=now_ns, force=(BIAS[0], BIAS[1], BIAS[2] - 10.0))
    last_ns = now_ns - gap_ms * 1_000_000
    same = replace(bench.state.control.contact, before_last=reading.force, last=reading.force)
    state = replace(bench.state.control, last_reading_ns=last_ns, bias_force=BIAS[:3], contact=same)
    before = replace(state, force_world=force_world)
    return sense(settings, before, (reading,), 0.0, now_ns)


@pytest.mark.parametrize(("gap_ms", "counted_s"), [(10, 0.01), (99, 0.099), (100, 0.1), (101, 0.1), (5000, 0.1)])
def test_a_gap_between_packets_counts_as_a_tenth_of_a_second_at_most(gap_ms, counted_s):
    """However long nothing came, what was felt before is not forgotten at once: of a step to 10 N, 1 - 1/e."""
    assert filtered((0.0, 0.0, 0.0), gap_ms).force_world[0] == pytest.approx(10.0 * (1.0 - math.exp(-counted_s / 0.1)))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_filtered_force_that_is_no_number_on_one_axis_is_no_force(axis, bad):
    assert filtered((1.0, 2.0, 3.0), 10).force_valid
    assert not filtered(tuple(bad if i == axis else 1.0 for i in range(3)), 10).force_valid


@pytest.mark.parametrize(("age_ns", "valid"), [(99_999_999, True), (100_000_000, True), (100_000_001, False)])
@pytest.mark.parametrize("came", ["in this tick", "before"])
def test_a_force_is_valid_for_100_ms(age_ns, valid, came):
    bench = pushing()
    now_ns = 10_000_000_000
    reading = replace(bench.good_input().ft.readings[0], received_ns=now_ns - age_ns)
    state = replace(bench.state.control, last_reading_ns=now_ns - age_ns)
    readings = (reading,) if came == "in this tick" else ()
    assert state.force_valid
    assert sense(bench.core.control, state, readings, 0.0, now_ns).force_valid is valid


# --- the end -------------------------------------------------------------------------------------------------


def test_the_push_ends_on_its_distance_rests_retreats_and_checks_the_sensor():
    bench = pushing()
    phases, last_speeds = [], []
    while not (bench.output and bench.output.finished):
        bench.fold()
        phase = Phase(bench.state.control.phase)
        if phase == Phase.PUSH and bench.state.control.progress_m > 1.94:
            last_speeds.append(bench.state.control.speed)
        if not phases or phases[-1] != phase:
            phases.append(phase)
    assert phases == [Phase.PUSH, Phase.REST, Phase.RETREAT, Phase.CHECK, Phase.DONE]
    assert last_speeds == sorted(last_speeds, reverse=True)  # the ramp down
    assert last_speeds[-1] < 0.015
    state = bench.state.control
    assert 2.0 <= state.end_progress_m < 2.002
    assert state.end_lateral_m == pytest.approx(0.0, abs=1e-3)
    assert state.progress_m == pytest.approx(state.end_progress_m - 0.05, abs=0.002)
    assert state.residual_N < 0.2
    assert (bench.output.exit_code, bench.output.faults) == (0, ())


def test_the_push_ends_on_its_distance_where_the_acceleration_limit_is_below_the_ramp():
    """0.3 m/s in 0.1 s is 3 m/s^2 and the rig allows 0.2: from there the base needs 22 cm to stand."""
    short = ("control.push_speed_m_per_s=0.3", "control.ramp_s=0.1", "limits.max_acceleration_m_per_s2=0.2")
    bench = FoldBench((*short, "control.distance_m=1"))
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0
    assert 1.0 <= bench.state.control.end_progress_m < 1.01


def test_the_retreat_ramps_up_backwards():
    """0.05 m/s within a second, as the approach, and the other way."""
    bench = pushing()
    bench.run_to(Phase.RETREAT)
    speeds = []
    for _ in range(105):
        bench.fold()
        assert bench.state.control.phase == Phase.RETREAT
        speeds.append(velocity(bench)[0])
    assert speeds[:3] == pytest.approx([-0.0005, -0.001, -0.0015], abs=1e-9)
    assert speeds[49] == pytest.approx(-0.025, abs=1e-9)
    assert speeds[99:] == pytest.approx([-0.05] * 6, abs=1e-9)


@pytest.mark.parametrize(
    ("twist", "rests"),
    [
        (BodyTwist(0.0099, 0.0, 0.0), True),
        (BodyTwist(0.0, -0.0099, 0.0), True),
        (BodyTwist(0.01, 0.0, 0.0), False),
        (BodyTwist(0.0101, 0.0, 0.0), False),
        (BodyTwist(0.0, 0.0101, 0.0), False),
        (BodyTwist(0.008, 0.008, 0.0), False),  # 0.0113 m/s in all
    ],
)
def test_rest_is_less_than_a_centimetre_a_second_for_300_ms(twist, rests):
    bench = pushing().run_to(Phase.REST)
    since_ns = bench.now_ns - 10_000_000
    for n in range(40):
        bench.fold(lambda inp, _: replace(inp, base=replace(inp.base, odometry=twist)), n)
        if bench.state.control.phase != Phase.REST:
            break
    if rests:
        assert 300 <= (bench.now_ns - 10_000_000 - since_ns) / 1e6 <= 310
        assert bench.state.control.phase == Phase.RETREAT
    else:
        assert bench.state.control.phase == Phase.REST


def test_a_base_that_is_to_move_does_not_rest_though_it_stands():
    """Blocked wheels read zero; nothing that waits for rest may count from there."""
    bench = pushing()
    for n in range(10):
        bench.fold(lambda inp, _: replace(inp, base=replace(inp.base, odometry=BodyTwist())), n)
        assert bench.state.control.speed > 0.0
        assert bench.state.control.rest_since_ns == 0


@pytest.mark.parametrize("phase", [Phase.REST, Phase.CHECK])
def test_at_rest_the_heading_is_left_alone(phase):
    """Nothing may move while it rests, in contact or out of it: a heading that is off is held only on the way."""
    bench = pushing()
    bench.run_until(lambda b: b.state.control.phase == phase)
    carried_to(bench, yaw=0.04)
    bench.fold()
    assert bench.state.control.phase == phase
    assert bench.output.wanted_body == BodyTwist()


def test_a_rig_may_do_without_the_retreat():
    bench = pushing(("control.retreat_m=0",))
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0
    assert bench.state.control.progress_m == pytest.approx(bench.state.control.end_progress_m, abs=1e-9)
    assert math.isnan(bench.state.control.residual_N)


def test_a_sensor_that_does_not_read_zero_afterwards_is_told():
    bench = pushing()
    bench.run_until(lambda b: b.state.control.phase == Phase.RETREAT)

    def drifted(inp, _):
        one = inp.ft.readings[0]
        return replace(
            inp, ft=replace(inp.ft, readings=(replace(one, force=(one.force[0] + 5.5, one.force[1], one.force[2])),))
        )

    bench.run_until(lambda b: b.output.finished, drifted)
    assert bench.state.control.residual_N == pytest.approx(5.5, abs=0.2)
    assert bench.output.faults == ("F09",)
    assert bench.output.exit_code == 0


def test_a_finished_push_wants_no_speed():
    bench = pushing()
    bench.fold()
    done = replace(bench.state.control, phase=int(Phase.DONE), speed=0.1)
    assert advance(Settings.of(bench.rig), done, bench.inp, (0.0, 0.0), False).speed == 0.0


def test_a_place_that_is_no_number_is_no_progress():
    bench = pushing()
    bench.fold()
    begun = replace(bench.state.control, contact_from_m=-1.7e308, progress_m=0.25, lateral_m=0.5)
    after = advance(Settings.of(bench.rig), begun, bench.inp, (1.7e308, 0.0), True)
    assert (after.progress_m, after.lateral_m) == (0.25, 0.5)


def test_a_finished_push_stays_finished():
    for bench in (pushing(), lost()):
        bench.run_until(lambda b: b.output.finished, None if bench.state.control.phase == Phase.PUSH else no_force)
        phase = bench.state.control.phase
        for _ in range(5):
            bench.fold()
            assert bench.state.control.phase == phase in (Phase.DONE, Phase.FAILED)
            assert bench.output.command_body == BodyTwist()


# --- held by safety ----------------------------------------------------------------------------------------------


def old_arm(inp, _=0):
    """Return the input with an arm record of 70 ms ago: HOLD, and it clears by itself."""
    at = inp.now_ns - 70_000_000
    return replace(inp, arm=replace(inp.arm, published_ns=at, changed_ns=at))


def test_a_hold_ramps_down_and_the_push_ramps_up_again_from_rest():
    bench = pushing()
    for n in range(30):
        bench.fold(old_arm, n)
    assert bench.output.command_body == BodyTwist()
    bench.run_until(lambda b: b.output.mode == Mode.PUSHING)
    speeds = []
    for _ in range(120):
        bench.fold()
        speeds.append(bench.output.command_body.vx)
    assert speeds[0] < 0.005
    assert all(b - a < 0.0011 for a, b in pairwise(speeds))  # 0.1 m/s in 1 s
    assert speeds[-1] == pytest.approx(0.1, abs=1e-4)


def test_no_deadline_of_the_search_runs_while_the_base_is_held():
    """2 s of search, 5 s held, and the last second of the search is still there."""
    bench = lost(overrides=("control.force_filter_tau_s=0", "control.lost_distance_m=2"))
    for n in range(200):
        bench.fold(no_force, n)
    for n in range(500):
        bench.fold(lambda inp, n: old_arm(no_force(inp)), n)
        assert bench.state.control.phase == Phase.LOST
    held = bench.run_until(lambda b: b.output.mode < Mode.HOLD, no_force)
    ticks = bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, no_force)
    assert 99 <= held <= 101  # the clean second
    assert 95 <= ticks <= 101


def test_nor_while_the_loop_skips_ticks_as_it_is_held():
    """6 s held, in which two of three ticks are skipped, cost the 3 s of the search nothing."""
    bench = lost(overrides=("control.force_filter_tau_s=0", "control.lost_distance_m=2"))
    since_ns = bench.state.control.phase_since_ns
    began_ns = bench.now_ns - 10_000_000
    bench.fold(lambda inp, _: old_arm(no_force(inp)))  # not yet held: the supervisor finds it in this tick
    begun_ns = bench.now_ns
    for n in range(200):
        bench.skip(2)
        bench.fold(lambda inp, n: replace(old_arm(no_force(inp)), host=replace(inp.host, skipped=2)), n)
        assert bench.state.control.phase == Phase.LOST
    assert since_ns == began_ns
    held_ns = bench.now_ns - begun_ns
    assert held_ns == 6_000_000_000
    assert bench.state.control.phase_since_ns == since_ns + held_ns


def test_an_approach_that_was_held_ramps_up_again():
    bench = ran_to(Phase.APPROACH)
    for n in range(60):
        bench.fold(no_force, n)
    for n in range(30):
        bench.fold(lambda inp, n: old_arm(no_force(inp)), n)
    bench.run_until(lambda b: b.output.mode == Mode.PUSHING, no_force)
    speeds = []
    for _ in range(110):
        bench.fold(no_force)
        speeds.append(bench.output.command_body.vx)
    assert bench.state.control.phase == Phase.APPROACH
    assert speeds[0] < 0.003
    assert speeds[-1] == pytest.approx(0.05, abs=1e-9)


def test_the_fold_is_pure():
    """Same arguments, same result, and the arguments are left alone."""
    bench = pushing()
    inp, state = bench.good_input(), bench.state
    first, again = bench.core.fold(state, inp), bench.core.fold(state, inp)
    assert first == again
    assert state == bench.state


# --- a pose that jumps -------------------------------------------------------------------------------------------


def jumped(x=0.0, y=0.0, yaw=0.0):
    def alter(inp, _=0):
        pose = inp.base.pose
        return replace(inp, base=replace(inp.base, pose=Pose2D(pose.x + x, pose.y + y, pose.yaw + yaw)))

    return alter


@pytest.mark.parametrize("jump", [{"x": 3.0}, {"x": -3.0}, {"y": 3.0}, {"yaw": 0.07}])
@pytest.mark.parametrize("samples", mostly_long((1, 2), 2))
def test_a_pose_that_jumps_is_not_used(jump, samples):
    """Up to two samples in a row are left out (the third stops the run): nothing is steered or reached by them."""
    short = ("control.distance_m=0.5",)
    bench, same = pushing(short), pushing(short)
    for n in range(samples):
        bench.fold(jumped(**jump), n)
        assert bench.output.faults == ()
        assert bench.state.control.phase == Phase.PUSH
        # At most what the base has gone since the last good pose is missing.
        same.fold()
        assert bench.state.control.progress_m == pytest.approx(same.state.control.progress_m, abs=0.003)
        assert bench.state.control.theta_p == pytest.approx(same.state.control.theta_p, abs=1e-4)
        assert velocity(bench) == pytest.approx(velocity(same), abs=1e-4)
        assert bench.output.command_body.omega == pytest.approx(0.0, abs=1e-4)
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0
    assert bench.state.control.end_progress_m >= 0.5


def test_a_jump_in_the_approach_is_no_missed_object():
    bench = ran_to(Phase.APPROACH)
    bench.fold(jumped(x=1.0))
    assert bench.state.control.phase == Phase.APPROACH
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0


def test_between_two_poses_a_rejected_one_stays_rejected():
    """The feed may be slower than the loop: until the next pose comes, the newest record is still the jumped one."""
    bench = pushing()
    bench.fold(jumped(x=3.0))
    seq, at_ns = bench.inp.base.pose_seq, bench.inp.base.pose_received_ns
    for n in range(3):
        again = lambda inp, _: replace(  # noqa: E731
            jumped(x=3.0)(inp), base=replace(jumped(x=3.0)(inp).base, pose_seq=seq, pose_received_ns=at_ns)
        )
        bench.fold(again, n)
        assert bench.state.control.phase == Phase.PUSH
        assert bench.state.safety.pose_jumps == 1
        assert bench.output.faults == ()


@pytest.mark.parametrize("bad", [{"pose": Pose2D(math.nan, 0.0, math.nan)}, {"pose_valid": False}])
def test_a_pose_that_is_none_leaves_the_figures_of_the_run_as_they_were(bad):
    """The stop is for safety (F42); how far the push came, and that nothing pulled backward, is still to be told."""
    bench = pushing()
    progress, lateral = bench.state.control.progress_m, bench.state.control.lateral_m
    bench.run_until(lambda b: b.output.finished, lambda inp, _: replace(inp, base=replace(inp.base, **bad)))
    assert bench.output.faults == ("F42",)
    assert bench.state.control.progress_m == pytest.approx(progress, abs=0.0011)
    assert bench.state.control.lateral_m == pytest.approx(lateral, abs=1e-4)
