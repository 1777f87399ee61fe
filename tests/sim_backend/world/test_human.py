"""A person presses on the ball and moves the arm: what sensor and joints read, with numbers worked out by hand.

The sensor reads a force (x, y, z) of the base as (sin a y + cos a z, -cos a y + sin a z, x), a = pi/2 - 1.31 rad.
0.6 kg weigh 5.886 N. In the held pose the joints 2 to 4 turn about the base's y axis (left): +90 degrees turn forward
to down.
"""

import math

import pytest

from robot_io.clock import NS_PER_MS, NS_PER_S
from sim_backend.world.world import World
from tools.rig import resolve_rig

QUIET = (
    *("world.sensor.noise_force_N=0", "world.sensor.noise_torque_Nm=0"),
    "world.sensor.bias=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]",
)
LIGHT = "world.sensor.tool_mass_kg=0"
START = 7 * NS_PER_S
HELD = resolve_rig("sim").arm.held_pose_rad
HALF = math.pi / 2


def world_with(*settings):
    return World(resolve_rig("sim", [*QUIET, *settings]), 0, START)


def test_a_press_of_the_rig_is_read_from_its_time_on_for_its_time():
    world = world_with(LIGHT, "world.hand=[{at_s = 1.0, for_s = 0.5, force_body_N = [-10.0, 0.0, 0.0]}]")
    read = [world.read_ft(START + at_ms * NS_PER_MS)[2] for at_ms in (0, 999, 1000, 1499, 1500)]
    assert read == pytest.approx([0.0, 0.0, -10.0, -10.0, 0.0])


def test_the_presses_of_the_rig_come_one_after_another():
    first = "{at_s = 1.0, for_s = 0.5, force_body_N = [-10.0, 0.0, 0.0]}"
    second = "{at_s = 3.0, for_s = 0.5, force_body_N = [-4.0, 0.0, 0.0]}"
    world = world_with(LIGHT, f"world.hand=[{first}, {second}]")
    read = [world.read_ft(START + at_ms * NS_PER_MS)[2] for at_ms in (0, 1200, 2000, 3200, 4000)]
    assert read == pytest.approx([0.0, -10.0, 0.0, -4.0, 0.0])


def test_presses_add_up_and_have_a_lever():
    """5 N to the left at the ball, 0.15 m ahead of the sensor: moment (0, 0, 0.75) -> (0.75 cos a, 0.75 sin a, 0)."""
    world = world_with(LIGHT)
    world.press((0.0, 3.0, 0.0), 1.0, START)
    world.press((0.0, 2.0, 0.0), 1.0, START)
    wanted = (1.289250, -4.830925, 0.0, 0.724639, 0.193388, 0.0)
    assert world.read_ft(START + 1) == pytest.approx(wanted, abs=2e-6)
    world.press((0.0, 0.0, 4.0), 1.0, START + 2 * NS_PER_S)
    assert world.read_ft(START + NS_PER_S)[:3] == pytest.approx((0.0, 0.0, 0.0))
    assert world.read_ft(START + 2 * NS_PER_S)[:3] == pytest.approx((3.864740, 1.031400, 0.0), abs=2e-6)


def test_a_hand_on_a_turned_sensor_reads_turned():
    world = world_with(LIGHT, "world.truth.sensor_yaw_deg=3")
    world.press((-15.0, 0.0, 0.0), 1.0, START)
    assert world.read_ft(START)[:3] == pytest.approx((0.202422, -0.758493, -14.979443), abs=2e-6)


def test_base_and_object_do_not_feel_the_hand():
    pressed, alone = world_with(), world_with()
    pressed.press((-50.0, 20.0, 0.0), 5.0, START)
    for world in (pressed, alone):
        world.advance_to(START + NS_PER_S)
    assert pressed.read_base(START).pose == alone.read_base(START).pose
    assert pressed.read_slider(START) == alone.read_slider(START)


def moved(joint, by):
    joints = list(HELD)
    joints[joint] += by
    return tuple(joints)


@pytest.mark.parametrize(
    ("joints", "force"),
    [
        (moved(5, HALF - 1.31), (-5.886, 0.0, 0.0)),  # a = 0: X up
        (moved(5, -1.31), (0.0, -5.886, 0.0)),  # a = pi/2: Y up
        (moved(5, math.pi - 1.31), (0.0, 5.886, 0.0)),  # a = -pi/2: Y down
        (moved(3, HALF), (0.0, 0.0, 5.886)),  # Z down
        (moved(3, -HALF), (0.0, 0.0, -5.886)),  # Z up
        (moved(3, math.pi / 6), (-4.925057, -1.314371, 2.943)),  # X and Y by cos 30, Z by sin 30
        (moved(0, 0.7), (-5.686965, -1.517705, 0.0)),  # about the vertical: as in the held pose
    ],
)
def test_the_tool_weighs_along_the_axes_that_the_arm_gives_the_sensor(joints, force):
    world = world_with()
    world.move_arm(joints, 0.0, START)
    assert world.read_ft(START + NS_PER_S)[:3] == pytest.approx(force, abs=2e-4)


def test_its_moment_goes_with_it():
    """Z down: the centre 6 cm along Z hangs straight below the sensor; X up: (0, 0.06 x -5.886, 0)."""
    world = world_with()
    world.move_arm(moved(3, HALF), 0.0, START)
    assert world.read_ft(START + NS_PER_S)[3:] == pytest.approx((0.0, 0.0, 0.0), abs=2e-5)
    world.move_arm(moved(5, HALF - 1.31), 0.0, START + NS_PER_S)
    assert world.read_ft(START + 2 * NS_PER_S)[3:] == pytest.approx((0.0, -0.353160, 0.0), abs=2e-5)


def test_the_arm_goes_at_constant_speed_and_stays_there():
    world = world_with()
    end = moved(3, 0.4)
    world.move_arm(end, 2.0, START + NS_PER_S)
    before, halfway, after = (world.read_arm(START + at * NS_PER_S) for at in (1, 2, 4))
    assert before.position == HELD
    assert halfway.position == pytest.approx(moved(3, 0.2))
    assert halfway.velocity == pytest.approx((0.0, 0.0, 0.0, 0.2, 0.0, 0.0))
    assert (after.position, after.velocity) == (end, (0.0,) * 6)


def test_a_second_move_starts_where_the_first_one_is():
    world = world_with()
    world.move_arm(moved(3, 0.4), 2.0, START)
    world.move_arm(HELD, 1.0, START + NS_PER_S)
    assert world.read_arm(START + NS_PER_S).position == pytest.approx(moved(3, 0.2))
    assert world.read_arm(START + 2 * NS_PER_S).position == HELD


def test_moved_away_and_back_it_reads_as_before():
    world = world_with()
    before = world.read_ft(START)
    world.move_arm(moved(3, 1.0), 0.5, START)
    world.move_arm(HELD, 0.5, START + NS_PER_S)
    assert world.read_ft(START + 2 * NS_PER_S) == before


def test_the_hand_presses_on_the_tool_also_where_the_arm_was_moved_to():
    """Z down, a force of 7 N upwards on the ball: -7 N on Z. The ball is 0.15 m along Z, so there is no moment."""
    world = world_with(LIGHT)
    world.move_arm(moved(3, HALF), 0.0, START)
    world.press((0.0, 0.0, 7.0), 9.0, START)
    assert world.read_ft(START + NS_PER_S) == pytest.approx((0.0, 0.0, -7.0, 0.0, 0.0, 0.0), abs=1e-4)
