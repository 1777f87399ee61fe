"""Vectors, points, poses and the path between frames of the floor, at exact values."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_io.geometry import (
    StraightPath,
    compose,
    inverse,
    point_outside,
    rotated,
    seen_from_frame,
    wrap_angle,
)
from robot_io.messages import Pose2D

QUARTER = math.pi / 2
angles = st.floats(-math.pi, math.pi)
lengths = st.floats(-10.0, 10.0)


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
def test_an_angle_is_wrapped(angle, wrapped):
    assert wrap_angle(angle) == pytest.approx(wrapped, abs=1e-15)


@given(st.floats(-1e3, 1e3))
def test_a_wrapped_angle_is_the_same_direction_in_range(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


def test_an_angle_that_is_not_a_number_stays_none():
    assert math.isnan(wrap_angle(math.nan))


def test_a_vector_of_a_frame_turned_left_by_a_quarter():
    assert rotated(1.0, 0.0, QUARTER) == pytest.approx((0.0, 1.0), abs=1e-15)
    assert rotated(0.0, 1.0, QUARTER) == pytest.approx((-1.0, 0.0), abs=1e-15)
    assert seen_from_frame(1.0, 0.0, QUARTER) == pytest.approx((0.0, -1.0), abs=1e-15)
    assert seen_from_frame(0.0, 1.0, QUARTER) == pytest.approx((1.0, 0.0), abs=1e-15)
    # By 30 degrees: 2 ahead and 1 to the left is sqrt(3) - 1/2 along x and 1 + sqrt(3)/2 along y.
    assert rotated(2.0, 1.0, math.pi / 6) == pytest.approx((1.2320508, 1.8660254), abs=1e-7)
    assert seen_from_frame(1.2320508, 1.8660254, math.pi / 6) == pytest.approx((2.0, 1.0), abs=1e-7)


def test_a_point_and_a_pose_of_a_frame():
    assert point_outside(1.0, 2.0, QUARTER, 0.9, 0.1) == pytest.approx((0.9, 2.9), abs=1e-12)
    outer = compose(Pose2D(1.0, 2.0, QUARTER), Pose2D(0.9, 0.1, QUARTER))
    assert (outer.x, outer.y, outer.yaw) == pytest.approx((0.9, 2.9, math.pi), abs=1e-12)


@given(lengths, lengths, angles)
def test_an_inverse_undoes_a_pose(x, y, yaw):
    back = compose(Pose2D(x, y, yaw), inverse(Pose2D(x, y, yaw)))
    assert (back.x, back.y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert math.sin(back.yaw) == pytest.approx(0.0, abs=1e-9)


def path(direction_deg: float, origin=(0.0, 0.0)) -> StraightPath:
    return StraightPath.of(origin, direction_deg)


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
    assert p.point_in_world(x, y) == pytest.approx(point, abs=1e-9)
    assert origin[0] + x * ex[0] + y * ey[0] == pytest.approx(point[0], abs=1e-9)
    assert origin[1] + x * ex[1] + y * ey[1] == pytest.approx(point[1], abs=1e-9)
