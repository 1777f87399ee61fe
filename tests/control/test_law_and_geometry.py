"""The law and the rotations between frames, at exact values."""

import math

import pytest

from control.base_velocity import body_from_world, contact_point_world, heading_rate
from control.push_law import force_angle, push_angle, return_angle
from control.wrench import low_pass
from robot_io.messages import BodyTwist, WorldTwist

QUARTER = math.pi / 2


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
        (0.2, -0.5, 0.1, 0.3, 0.07),
        (0.0, 1.25, 0.3, 0.2, 0.25),
        (0.0, 3.0, 0.3, 0.2, 0.25),  # further beside the path the offset says no more
        (0.0, -3.0, 0.3, 0.2, -0.25),
        (0.25, 4.0, 0.0, 0.0, 0.25),  # without gains the pusher follows the force
        (3.0, 0.5, 1.0, 0.5, 6.25),  # neither wrapped nor clipped
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


def test_a_lost_pusher_turns_towards_the_return_direction_and_stops_there():
    # 0.5 m left of the path with k_y = 0.2: the way back is -0.1 rad, to the right.
    assert return_angle(0.3, 0.5, 0.2, 0.002) == pytest.approx(0.298, abs=1e-15)
    assert return_angle(-0.3, 0.5, 0.2, 0.002) == pytest.approx(-0.298, abs=1e-15)
    assert return_angle(-0.0995, 0.5, 0.2, 0.002) == pytest.approx(-0.1, abs=1e-15)
    assert return_angle(0.3, -0.5, 0.2, 0.002) == pytest.approx(0.298, abs=1e-15)  # right of it: +0.1 rad


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


def test_the_low_pass_moves_each_axis_by_the_same_share_of_its_own_step():
    """After one time constant 1 - 1/e of the way is gone: 0.632 of 10, -20 and 40 N, from 1, 2 and 3 N."""
    share = 1.0 - math.exp(-1.0)
    assert low_pass((1.0, 2.0, 3.0), (11.0, -18.0, 43.0), 0.05, 0.05) == pytest.approx(
        (1.0 + 10.0 * share, 2.0 - 20.0 * share, 3.0 + 40.0 * share), rel=1e-12
    )


def test_the_low_pass_of_no_time_is_what_it_was_and_without_a_time_constant_the_sample():
    before, sample = (1.0, 2.0, 3.0), (11.0, -18.0, 43.0)
    assert low_pass(before, sample, 0.0, 0.05) == before
    assert low_pass(before, sample, 0.01, 0.0) == sample
