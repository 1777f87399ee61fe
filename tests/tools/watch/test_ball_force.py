"""Signs of the force on the ball, from the frames page: pushing ahead with 15 N, the sensor reads Fz = -15 N."""

import math

import pytest

from robot_io.geometry import StraightPath
from tools.rig import resolve_rig
from tools.watch.ball_force import ball_force, direction, drawing, mean

AHEAD = StraightPath.of((0.0, 0.0), 0.0)
LEFTWARDS = StraightPath.of((0.0, 0.0), 90.0)
BIAS = (-20.0, 22.0, -48.0)
A = math.pi / 2 - 1.31
PUSHED_AHEAD = (-20.0, 22.0, -63.0)
PUSHED_AHEAD_AND_LEFT = (-20.0 - 10.0 * math.sin(A), 22.0 + 10.0 * math.cos(A), -63.0)


@pytest.fixture(scope="module")
def mounting():
    return resolve_rig("emulated").frames.base_from_sensor


def test_a_ball_pressed_from_the_front_is_pushed_backward(mounting):
    force = ball_force(PUSHED_AHEAD, BIAS, mounting, 0.0, AHEAD)
    assert force.sensor == pytest.approx((0.0, 0.0, -15.0))
    assert force.body == pytest.approx((-15.0, 0.0, 0.0))
    assert force.path == pytest.approx((-15.0, 0.0, 0.0))
    assert force.theta_f_rad == pytest.approx(0.0)
    assert direction(force.body)[:2] == ("BACKWARD", "-x")


def test_the_object_pushed_to_the_left_pushes_the_ball_to_the_right(mounting):
    force = ball_force(PUSHED_AHEAD_AND_LEFT, BIAS, mounting, 0.0, AHEAD)
    assert force.body == pytest.approx((-15.0, -10.0, 0.0), abs=1e-6)
    assert math.degrees(force.theta_f_rad) == pytest.approx(33.69, abs=0.01)
    assert direction(force.body).words == "BACKWARD-RIGHT"


def test_the_path_frame_turns_with_the_base_and_with_the_path(mounting):
    turned = ball_force(PUSHED_AHEAD, BIAS, mounting, math.pi / 2, AHEAD)
    assert turned.body == pytest.approx((-15.0, 0.0, 0.0))
    assert turned.path == pytest.approx((0.0, -15.0, 0.0), abs=1e-9)
    assert math.degrees(turned.theta_f_rad) == pytest.approx(90.0)
    along = ball_force(PUSHED_AHEAD, BIAS, mounting, math.pi / 2, LEFTWARDS)
    assert along.path == pytest.approx((-15.0, 0.0, 0.0), abs=1e-9)


def test_without_a_heading_there_is_no_path_frame(mounting):
    force = ball_force(PUSHED_AHEAD, BIAS, mounting, None, AHEAD)
    assert (force.path, force.theta_f_rad) == (None, None)
    assert force.body == pytest.approx((-15.0, 0.0, 0.0))


def test_a_force_within_the_noise_has_no_direction(mounting):
    force = ball_force((-20.0, 22.0, -48.9), BIAS, mounting, 0.0, AHEAD)
    assert force.theta_f_rad is None
    assert direction(force.body).words == "no force"


@pytest.mark.parametrize(
    ("degrees", "words", "arrow"),
    [
        (0, "FORWARD", "↑"),
        (45, "FORWARD-LEFT", "↖"),
        (90, "LEFT", "←"),
        (135, "BACKWARD-LEFT", "↙"),
        (180, "BACKWARD", "↓"),
        (-135, "BACKWARD-RIGHT", "↘"),
        (-90, "RIGHT", "→"),
        (-45, "FORWARD-RIGHT", "↗"),
    ],
)
@pytest.mark.parametrize("off", [-22, 0, 22])
def test_eight_directions_seen_from_above(degrees, words, arrow, off):
    at = math.radians(degrees + off)
    found = direction((10.0 * math.cos(at), 10.0 * math.sin(at), 3.0))
    assert (found.words, found.arrow) == (words, arrow)


def test_up_and_down():
    assert direction((1.0, 1.0, 5.0)).words == "UP"
    assert direction((1.0, 1.0, -5.0)).words == "DOWN"


@pytest.mark.parametrize("body", [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (math.inf, math.nan, 0.0)])
def test_what_is_no_number_is_called_so(body):
    assert direction(body).words == "NOT A NUMBER"
    assert "".join(drawing(body)).split() == ["?"]


@pytest.mark.parametrize(
    ("body", "row", "column"),
    [((9.0, 0.0, 0.0), 0, 6), ((-9.0, 0.0, 0.0), 6, 6), ((0.0, 9.0, 0.0), 3, 0), ((0.0, -9.0, 0.0), 3, 12)],
)
def test_the_drawing_has_its_tip_where_the_force_points(body, row, column):
    lines = drawing(body, rows=7)
    assert len(lines) == 7
    assert lines[3][6] == "o"
    assert lines[row][column] == direction(body).arrow
    assert drawing(body, rows=7, unicode=False)[row][column] == direction(body).ascii_arrow


def test_the_mean_is_taken_axis_by_axis():
    assert mean([(1.0, 2.0, 3.0), (3.0, 6.0, -3.0)]) == (2.0, 4.0, 0.0)
