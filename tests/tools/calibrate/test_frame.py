"""Mounting of the sensor from a cord, from hand presses and from the tool's weight; true values worked out here."""

import math

import numpy as np
import pytest

from tests.tools.calibrate.feeds import SEEDS, keeps_its_promise, reading, rot, wrench
from tools.calibrate.estimators.cord import Pull, check_directions, estimate_yaw
from tools.calibrate.estimators.estimate import CannotCalibrate
from tools.calibrate.estimators.sign import estimate_sign
from tools.calibrate.estimators.steady import steady
from tools.calibrate.estimators.ur10_rotation import base_from_flange
from tools.calibrate.estimators.weight import Pose, estimate_mounting

# X mostly up, Y to the right, Z ahead: the shipped mounting (a = pi/2 - 1.31 rad).
A = math.pi / 2 - 1.31
RIG = ((0.0, 0.0, 1.0), (math.sin(A), -math.cos(A), 0.0), (math.cos(A), math.sin(A), 0.0))
HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.3100)


def felt(mounting, force_body):
    """Return a force on the tool as the sensor with this mounting reads it."""
    return mounting.T @ np.array(force_body)


def pull(dice, mounting, mark_deg, hand_deg, size=25.0, lift=0.0, tare_shift=0.0):
    angle = math.radians(mark_deg + hand_deg)
    force = felt(mounting, (size * math.cos(angle), size * math.sin(angle), lift))
    return Pull(mark_deg, reading(dice, 3, force + tare_shift))


def cord(seed, yaw_deg, marks=(0.0, 120.0, 240.0), marking_deg=0.3, **changes):
    dice = np.random.default_rng(seed)
    mounting = rot("z", yaw_deg) @ np.array(RIG)
    before = reading(dice, 5)
    pulls = [pull(dice, mounting, mark, dice.normal(0.0, marking_deg), **changes) for mark in marks]
    return estimate_yaw(pulls, before, reading(dice, 5), RIG, marking_deg)


def test_thirty_cords_lie_within_their_uncertainty():
    yaws = [math.remainder(1.7 * seed, 8.0) for seed in SEEDS]
    found = [cord(seed, yaw) for seed, yaw in zip(SEEDS, yaws, strict=True)]
    errors = [one.value[0] - yaw for one, yaw in zip(found, yaws, strict=True)]
    keeps_its_promise(errors, [one.uncertainty[0] for one in found], 0.5)


def test_the_new_mounting_is_the_true_one():
    found = np.array(cord(4, 3.0).keys["frames.base_from_sensor"])
    true = rot("z", 3.0) @ np.array(RIG)
    assert np.degrees(np.arccos((np.trace(found @ true.T) - 1) / 2)) < 0.5
    assert found @ found.T == pytest.approx(np.eye(3), abs=1e-8)


def test_a_tare_that_is_off_cancels_where_the_directions_lie_all_round():
    # 1 N beside 25 N is 2.3 degrees in one direction.
    assert abs(cord(5, 3.0, tare_shift=felt(np.array(RIG), (0.0, 1.0, 0.0))).value[0] - 3.0) < 0.5


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"size": 4.0}, "at least 8 N"),
        ({"lift": 15.0}, "not level"),
        ({"size": -25.0}, "the other way round"),
    ],
)
def test_pulls_that_say_nothing_are_refused(changes, words):
    with pytest.raises(CannotCalibrate, match=words):
        cord(6, 0.0, **changes)


def test_a_cord_let_go_too_early_is_refused():
    dice, mounting = np.random.default_rng(9), np.array(RIG)
    pulls = [pull(dice, mounting, mark, 0.0) for mark in (0.0, 120.0, 240.0)]
    times, values = wrench(dice, 3)
    values[:240, :3] += felt(mounting, (25.0, 0.0, 0.0))  # the last 0.6 s are without
    pulls[0] = pulls[0]._replace(reading=steady(times, values))
    with pytest.raises(CannotCalibrate, match="at 0 degrees was not held while measured"):
        estimate_yaw(pulls, reading(dice, 5), reading(dice, 5), RIG, 0.3)


def test_directions_too_few_one_sided_or_contradicting_are_refused():
    with pytest.raises(CannotCalibrate, match="too few"):
        check_directions((0.0, 90.0))
    with pytest.raises(CannotCalibrate, match="close together"):
        check_directions((0.0, 20.0, 40.0))
    dice, mounting = np.random.default_rng(7), np.array(RIG)
    pulls = [pull(dice, mounting, mark, hand) for mark, hand in ((0.0, 0.0), (120.0, 9.0), (240.0, 0.0))]
    with pytest.raises(CannotCalibrate, match="contradict"):
        estimate_yaw(pulls, reading(dice, 5), reading(dice, 5), RIG, 0.3)
    with pytest.raises(CannotCalibrate, match="no mere yaw"):
        cord(8, 40.0)


def presses(mounting, seed=0, sign=1.0):
    dice = np.random.default_rng(seed)
    asked = {"forward": (1.0, 0.0, 0.0), "left": (0.0, 1.0, 0.0), "up": (0.0, 0.0, 1.0)}
    slanted = {name: rot("z", dice.normal(0, 6)) @ rot("x", dice.normal(0, 6)) @ axis for name, axis in asked.items()}
    forces = {name: felt(mounting, sign * 15.0 * direction) for name, direction in slanted.items()}
    return {name: reading(dice, 2, force) for name, force in forces.items()}, reading(dice, 5)


@pytest.mark.parametrize("seed", range(5))
def test_the_rig_s_mounting_is_confirmed_and_another_one_proposed(seed):
    confirmed = estimate_sign(*presses(rot("z", 3.0) @ np.array(RIG), seed), RIG)
    assert not confirmed.keys
    assert confirmed.value == (0.0,)
    for true in (rot("z", 90) @ np.array(RIG), np.array(RIG) @ rot("z", 90), np.array(RIG) @ rot("x", 180)):
        proposed = np.array(estimate_sign(*presses(true, seed), RIG).keys["frames.base_from_sensor"])
        assert proposed == pytest.approx(true, abs=1e-8)


def test_reversed_weak_repeated_and_slanted_presses_are_refused():
    with pytest.raises(CannotCalibrate, match="the other way round"):
        estimate_sign(*presses(np.array(RIG), sign=-1.0), RIG)
    with pytest.raises(CannotCalibrate, match="at least 5 N"):
        estimate_sign(*presses(np.array(RIG), sign=0.1), RIG)
    twice, tare = presses(np.array(RIG))
    with pytest.raises(CannotCalibrate, match="along one line"):
        estimate_sign(twice | {"left": twice["forward"]}, tare, RIG)
    with pytest.raises(CannotCalibrate, match="no mounting along the axes"):
        estimate_sign(*presses(rot("x", 45) @ rot("z", 45) @ np.array(RIG)), RIG)


# By hand: with all joints at zero the flange's z points along the arm's -y, and its x along the arm's x.
def test_the_flange_points_where_the_maker_s_drawing_shows_it():
    straight = base_from_flange((0.0,) * 6)
    assert straight @ [0, 0, 1] == pytest.approx([0, -1, 0], abs=1e-12)
    assert straight @ [1, 0, 0] == pytest.approx([1, 0, 0], abs=1e-12)
    turned = base_from_flange((math.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert turned == pytest.approx(rot("z", 90) @ straight, abs=1e-12)
    assert base_from_flange((0, 0, 0, 0, 0, math.pi / 2)) == pytest.approx(straight @ rot("z", 90), abs=1e-12)


POSES = (
    HELD,
    (*HELD[:4], HELD[4] + 1.2, HELD[5]),
    (*HELD[:5], HELD[5] + 1.5),
    (*HELD[:3], HELD[3] - 0.8, HELD[4], 0.0),
)
NOMINAL = (rot("z", 90) @ base_from_flange(HELD)).T @ np.array(RIG)
"""flange_from_sensor as the rig means it: the arm is mounted turned by 90 degrees."""


def weighed(seed, flange_from_sensor, joints=POSES, weight=6.0):
    """Return what a sensor mounted like this reads of its tool in each pose."""
    dice = np.random.default_rng(seed)
    forces = [flange_from_sensor.T @ base_from_flange(q).T @ [0.0, 0.0, -weight] for q in joints]
    return [Pose(q, reading(dice, 10, force)) for q, force in zip(joints, forces, strict=True)]


def test_thirty_weighings_find_the_tilt_within_their_uncertainty():
    errors, uncertainties = [], []
    for seed in SEEDS:
        true = NOMINAL @ rot("x", 2.0) @ rot("y", -1.5) @ rot("z", seed / 10)
        found = estimate_mounting(weighed(seed, true), HELD, RIG)
        up_true = (base_from_flange(HELD) @ true).T @ [0, 0, 1]  # the vertical as the sensor sees it
        up_found = np.array(found.keys["frames.base_from_sensor"]).T @ [0, 0, 1]
        errors.append(np.degrees(np.linalg.norm(np.cross(up_true, up_found))))
        uncertainties.append(found.uncertainty[0])
    keeps_its_promise(errors, uncertainties, 2.0)


def test_yaw_stays_as_the_rig_has_it_and_that_is_said():
    found = estimate_mounting(weighed(1, NOMINAL @ rot("z", 2.0)), HELD, RIG)  # z is forward: it rolls
    assert found.unseen == "yaw"
    change = np.array(found.keys["frames.base_from_sensor"]) @ np.array(RIG).T
    assert change[1, 0] == pytest.approx(change[0, 1], abs=1e-6)  # no turn about the vertical
    assert found.value[0] == pytest.approx(2.0, abs=0.8)
    assert any("yaw about the vertical is unseen" in line and "--cord" in line for line in found.told)


def test_a_light_tool_like_poses_and_a_bent_reading_are_refused():
    with pytest.raises(CannotCalibrate, match="2 poses are too few"):
        estimate_mounting(weighed(1, NOMINAL)[:2], HELD, RIG)
    with pytest.raises(CannotCalibrate, match="weighs"):
        estimate_mounting(weighed(1, NOMINAL, weight=0.5), HELD, RIG)
    with pytest.raises(CannotCalibrate, match="too much alike"):
        estimate_mounting(weighed(1, NOMINAL, joints=(HELD, HELD, POSES[1])), HELD, RIG)
    poses = weighed(1, NOMINAL)
    poses[3] = poses[3]._replace(reading=reading(np.random.default_rng(1), 10, (0.0, 5.0, 0.0)))
    with pytest.raises(CannotCalibrate, match="contradict"):
        estimate_mounting(poses, HELD, RIG)
