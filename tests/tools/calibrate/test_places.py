"""Contact point, marker frame and path from poses; true values worked out here."""

import math

import numpy as np
import pytest

from tests.tools.calibrate.feeds import HEADING_RAD, PLACE_M, SEEDS, keeps_its_promise, poses, stood
from tools.calibrate.estimators.contact import Sight, estimate_from_marker, estimate_from_plumb
from tools.calibrate.estimators.estimate import CannotCalibrate
from tools.calibrate.estimators.line import estimate_line
from tools.calibrate.estimators.marker import Straight, estimate_marker
from tools.calibrate.estimators.mean_pose import mean_pose

NOW = (1.0, 0.0, 0.15)


def carried(x, y, yaw, ahead, left):
    """Return a point of the base in WORLD."""
    return x + ahead * math.cos(yaw) - left * math.sin(yaw), y + ahead * math.sin(yaw) + left * math.cos(yaw)


def sight(dice, place, true, error_m):
    ball = np.array(carried(*place, *true)) + dice.normal(size=2) * error_m
    return Sight(stood(dice, 3, *place), tuple(ball), error_m)


def test_thirty_plumbings_lie_within_their_uncertainty():
    errors, uncertainties = [], []
    for seed in SEEDS:
        dice = np.random.default_rng(seed)
        true = (1.0 + 0.001 * seed, 0.02)
        tape = dice.uniform(-0.5, 0.5, size=2)  # where the tape's origin is does not matter
        sights = [sight(dice, place, true, 0.001) for place in ((2.0, 1.0, 0.3), (2.1, 1.2, 2.2))]
        moved = [one._replace(ball_m=tuple(np.array(one.ball_m) + tape)) for one in sights]
        found = estimate_from_plumb(moved, NOW)
        errors.append(np.array(found.value) - true)
        uncertainties.append(found.uncertainty)
        assert found.keys["frames.contact_in_base_m"][2] == NOW[2]
    keeps_its_promise(errors, uncertainties, [0.005, 0.005])


def test_thirty_sights_of_a_marker_on_the_ball_lie_within_their_uncertainty():
    errors, uncertainties = [], []
    for seed in SEEDS:
        dice = np.random.default_rng(seed)
        true = (0.98, -0.02)
        centre = np.array(true) + dice.normal(size=2) * 0.001  # the markers' middle is not quite the ball's
        ball = poses(dice, 3, *carried(2.0, 1.0, 0.3, *centre), 0.0)
        seen = mean_pose(ball)
        found = estimate_from_marker([Sight(stood(dice, 3, 2.0, 1.0, 0.3), (seen.pose.x, seen.pose.y), 3e-5)], NOW)
        errors.append(np.array(found.value) - true)
        uncertainties.append(found.uncertainty)
    keeps_its_promise(errors, uncertainties, [0.005, 0.005])


def test_plumbing_that_cannot_tell_is_refused():
    dice = np.random.default_rng(1)
    one, near, far = (sight(dice, (2.0, 1.0, yaw), (1.0, 0.0), 0.001) for yaw in (0.0, 0.3, 2.0))
    for sights, words in (([one], "too few"), ([one, near], "degrees apart")):
        with pytest.raises(CannotCalibrate, match=words):
            estimate_from_plumb(sights, NOW)
    wrong = far._replace(ball_m=(far.ball_m[0] + 20.0, far.ball_m[1]))
    with pytest.raises(CannotCalibrate, match="from the base's middle"):
        estimate_from_plumb([one, wrong], NOW)
    third = sight(dice, (2.0, 1.0, -2.0), (1.0, 0.0), 0.001)
    with pytest.raises(CannotCalibrate, match="contradict each other"):
        estimate_from_plumb([one, far._replace(ball_m=(far.ball_m[0] + 0.1, far.ball_m[1])), third], NOW)
    with pytest.raises(CannotCalibrate, match="marker"):
        estimate_from_marker([one, far._replace(ball_m=(far.ball_m[0] + 0.1, far.ball_m[1]))], NOW)


def drive(seed, true, *, ahead=1.5, arc=0.0, wander=0.0, sweep=math.tau):
    """Return a straight drive and a turn on the spot of markers at `true` (x, y, yaw in BODY)."""
    dice = np.random.default_rng(seed)
    x, y, yaw = 0.5, -0.3, 0.4
    steering = dice.normal(0.0, math.radians(0.05))

    def markers(base_x, base_y, base_yaw):
        return (*carried(base_x, base_y, base_yaw, *true[:2]), base_yaw + true[2])

    chord = yaw + arc / 2 + steering
    gone = (x + ahead * math.cos(chord), y + ahead * math.sin(chord), yaw + arc)
    straight = Straight(stood(dice, 2, *markers(x, y, yaw)), stood(dice, 2, *markers(*gone)), 0.0, 0.0)
    headings = yaw + np.linspace(0.0, sweep, 2000)
    middles = [(x + wander * math.sin(3 * h), y + wander * math.cos(5 * h), h) for h in headings]
    rows = np.array([markers(*middle) for middle in middles])
    return straight, rows + dice.normal(size=rows.shape) * [PLACE_M, PLACE_M, HEADING_RAD]


def test_thirty_drives_find_the_markers_within_their_uncertainty():
    errors, uncertainties = [], []
    for seed in SEEDS:
        true = (0.12, -0.05, 0.2 + 0.01 * seed)
        straight, turning = drive(seed, true)
        # As long as the straight drive is straight enough, an arc within it does no harm.
        found = estimate_marker(straight, turning, (0.0, 0.0, 0.0))
        errors.append(np.array(found.value) - true)
        uncertainties.append(found.uncertainty)
    keeps_its_promise(errors, uncertainties, [0.005, 0.005, math.radians(0.3)])


def test_a_drive_along_a_slight_arc_is_none_the_worse():
    # The markers, half a metre from the middle, are carried sideways by 17 mm: 0.7 degrees over 1.5 m.
    found = estimate_marker(*drive(3, (0.1, 0.5, 0.3), arc=math.radians(2.0)), (0.0, 0.0, 0.0))
    assert found.value[2] == pytest.approx(0.3, abs=math.radians(0.15))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ahead": 0.3}, "at least 0.8 m"),
        ({"arc": math.radians(10)}, "on the way"),
        ({"sweep": math.radians(60)}, "turned by 6"),
        ({"wander": 0.1}, "wandered"),
    ],
)
def test_drives_that_say_nothing_are_refused(changes, words):
    with pytest.raises(CannotCalibrate, match=words):
        estimate_marker(*drive(1, (0.1, 0.0, 0.0), **changes), (0.0, 0.0, 0.0))


def test_thirty_paths_lie_within_their_uncertainty():
    for two in (False, True):
        errors, uncertainties = [], []
        for seed in SEEDS:
            dice = np.random.default_rng(seed)
            x, y, yaw = 1.0, 2.0, math.radians(10.0 * seed)
            ahead = stood(dice, 3, *carried(x, y, yaw, 1.5, 0.0), yaw) if two else None
            found = estimate_line(stood(dice, 3, x, y, yaw), ahead, (1.0, 0.02, 0.15))
            true = np.array([*carried(x, y, yaw, 1.0, 0.02), math.degrees(yaw)])
            off = np.array(found.value) - true
            off[2] = math.remainder(off[2], 360.0)
            errors.append(off)
            uncertainties.append(found.uncertainty)
        keeps_its_promise(errors, uncertainties, [0.005, 0.005, 0.2])


def test_two_places_too_close_and_a_base_that_moves_are_refused():
    dice = np.random.default_rng(1)
    with pytest.raises(CannotCalibrate, match=r"0\.20 m apart"):
        estimate_line(stood(dice, 3, 0, 0, 0), stood(dice, 3, 0.2, 0, 0), NOW)
    rolling = poses(dice, 3, 0.0, 0.0, 0.0) + np.linspace([0, 0, 0], [0.1, 0, 0], 300)
    with pytest.raises(CannotCalibrate, match="moved by"):
        mean_pose(rolling)
    with pytest.raises(CannotCalibrate, match="only 10 poses"):
        mean_pose(poses(dice, 0.1, 0.0, 0.0, 0.0))
    round_the_back = mean_pose(poses(dice, 3, 0.0, 0.0, math.pi))  # headings on both sides of +-180 degrees
    assert abs(math.remainder(round_the_back.pose.yaw - math.pi, math.tau)) < 0.002
