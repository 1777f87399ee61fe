"""The law, the path and the rotations between frames, at exact values."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from control.base_velocity import body_from_world, contact_point_world, heading_rate
from control.path import StraightPath, wrap
from control.push_law import force_angle, push_angle, return_angle
from robot_io.messages import BodyTwist, WorldTwist
from robot_io.rig.config import PathConfig

QUARTER = math.pi / 2
angles = st.floats(-math.pi, math.pi)
lengths = st.floats(-10.0, 10.0)


def about(vx, vy, omega):
    return pytest.approx((vx, vy, omega), abs=1e-8)


def numbers(twist: BodyTwist):
    return twist.vx, twist.vy, twist.omega


@pytest.mark.parametrize(
    ("theta_f", "lateral", "k_f", "k_y", "theta_p"),
    [
        (0.0, 0.0, 0.3, 0.2, 0.0),
        (0.1, 0.0, 0.3, 0.2, 0.13),
        (-0.1, 0.0, 0.3, 0.2, -0.13),
        (0.0, 0.5, 0.3, 0.2, 0.1),  # left of the path: further left, the sign that looks wrong and is right
        (0.0, -0.5, 0.3, 0.2, -0.1),
        (0.2, -1.0, 0.1, 0.3, -0.08),
        (0.25, 4.0, 0.0, 0.0, 0.25),  # without gains the pusher follows the force
        (3.0, 1.0, 1.0, 0.5, 6.5),  # neither wrapped nor clipped
    ],
)
def test_the_law(theta_f, lateral, k_f, k_y, theta_p):
    assert push_angle(theta_f, lateral, k_f, k_y) == pytest.approx(theta_p, abs=1e-15)


@pytest.mark.parametrize(
    ("force", "angle"),
    [
        ((1.0, 0.0), 0.0),
        ((0.0, 2.0), QUARTER),
        ((0.0, -2.0), -QUARTER),
        ((3.0, 3.0), math.pi / 4),
        ((-1.0, 0.0), math.pi),
        ((-1.0, -0.0), math.pi),  # atan2 alone says -pi
        ((-1.0, -1e-9), -math.pi + 1e-9),
    ],
)
def test_the_angle_of_the_force_lies_in_minus_pi_to_pi(force, angle):
    assert force_angle(*force) == pytest.approx(angle, abs=1e-15)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3 * math.pi, math.pi),
        (-3 * math.pi, math.pi),
        (1.5 * math.pi, -QUARTER),
        (-1.5 * math.pi, QUARTER),
        (2 * math.pi + 0.25, 0.25),
    ],
)
def test_wrap(angle, wrapped):
    assert wrap(angle) == pytest.approx(wrapped, abs=1e-15)


@given(st.floats(-1e3, 1e3))
def test_a_wrapped_angle_is_the_same_direction_in_range(angle):
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


def test_a_lost_pusher_turns_towards_the_return_direction_and_stops_there():
    # 0.5 m left of the path with k_y = 0.2: the way back is -0.1 rad, to the right.
    assert return_angle(0.3, 0.5, 0.2, 0.002) == pytest.approx(0.298, abs=1e-15)
    assert return_angle(-0.3, 0.5, 0.2, 0.002) == pytest.approx(-0.298, abs=1e-15)
    assert return_angle(-0.0995, 0.5, 0.2, 0.002) == pytest.approx(-0.1, abs=1e-15)
    assert return_angle(0.3, -0.5, 0.2, 0.002) == pytest.approx(0.298, abs=1e-15)  # right of it: +0.1 rad


def path(direction_deg: float, origin=(0.0, 0.0)) -> StraightPath:
    return StraightPath.of(PathConfig(origin_m=origin, direction_deg=direction_deg))


def test_along_and_lateral_on_a_path_to_the_left():
    north = path(90.0, (2.0, 1.0))
    assert north.along(2.0, 4.0) == pytest.approx(3.0, abs=1e-15)
    assert north.lateral(2.0, 4.0) == pytest.approx(0.0, abs=1e-15)
    assert north.lateral(1.5, 4.0) == pytest.approx(0.5, abs=1e-15)  # west of a northward path is left of it
    assert north.vector_to_path(0.0, 1.0) == pytest.approx((1.0, 0.0), abs=1e-15)
    assert north.vector_to_path(1.0, 0.0) == pytest.approx((0.0, -1.0), abs=1e-15)
    assert north.direction_in_world(0.0) == pytest.approx((0.0, 1.0), abs=1e-15)
    assert north.direction_in_world(QUARTER) == pytest.approx((-1.0, 0.0), abs=1e-15)


@given(st.floats(-180.0, 180.0), st.tuples(lengths, lengths), st.tuples(lengths, lengths), angles)
def test_the_path_frame_is_a_rotation_about_the_origin(direction, origin, point, theta):
    p = path(direction, origin)
    x, y = p.along(*point), p.lateral(*point)
    assert math.hypot(x, y) == pytest.approx(math.dist(point, origin), abs=1e-9)
    dx, dy = p.direction_in_world(theta)
    assert p.vector_to_path(dx, dy) == pytest.approx((math.cos(theta), math.sin(theta)), abs=1e-12)
    # walking the path coordinates back from the origin ends at the point
    ex, ey = p.direction_in_world(0.0), p.direction_in_world(QUARTER)
    assert origin[0] + x * ex[0] + y * ey[0] == pytest.approx(point[0], abs=1e-9)
    assert origin[1] + x * ex[1] + y * ey[1] == pytest.approx(point[1], abs=1e-9)


def test_a_world_velocity_in_the_body_of_a_base_that_looks_left():
    # The base looks along +y: world +y is forward, world +x is to its right.
    assert numbers(body_from_world(WorldTwist(0.0, 0.1, 0.02), QUARTER)) == about(0.1, 0.0, 0.02)
    assert numbers(body_from_world(WorldTwist(0.1, 0.0, 0.0), QUARTER)) == about(0.0, -0.1, 0.0)
    # Looking 30 degrees to the left, pushed along +x: forward cos 30, to the right sin 30.
    assert numbers(body_from_world(WorldTwist(0.1, 0.0, 0.0), math.pi / 6)) == about(0.08660254, -0.05, 0.0)


def test_the_contact_point_turns_with_the_base():
    assert contact_point_world(1.0, 2.0, 0.0, 0.9, 0.1) == pytest.approx((1.9, 2.1), abs=1e-12)
    assert contact_point_world(1.0, 2.0, QUARTER, 0.9, 0.1) == pytest.approx((0.9, 2.9), abs=1e-12)
    assert contact_point_world(1.0, 2.0, math.pi, 0.9, 0.1) == pytest.approx((0.1, 1.9), abs=1e-12)


@pytest.mark.parametrize(
    ("wanted", "yaw", "rate"),
    [
        (0.0, 0.05, -0.05),  # turned left: turn right
        (0.0, -0.05, 0.05),
        (0.0, 0.4, -0.1),  # limited
        (0.0, -0.4, 0.1),
        (3.1, -3.1, 6.2 - 2 * math.pi),  # the short way, across pi: -0.0832 rad
        (-3.1, 3.1, 2 * math.pi - 6.2),
    ],
)
def test_the_heading_is_held(wanted, yaw, rate):
    assert heading_rate(wanted, yaw, 1.0, 0.1) == pytest.approx(rate, abs=1e-12)
