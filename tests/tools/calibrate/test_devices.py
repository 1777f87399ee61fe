"""What is made of what a base said: the direction it was driven in, and the poses while it turned."""

import math

import numpy as np
import pytest

from robot_io.errors import DeviceNotReady
from robot_io.messages import BodyTwist
from tools.calibrate.devices import BaseHeard, direction_driven
from tools.calibrate.places import while_turning

NOTHING = np.zeros((0, 3))


def test_commands_tell_the_direction_and_odometry_where_none_are_heard():
    back = BaseHeard(NOTHING, NOTHING, (), (BodyTwist(), BodyTwist(-0.2, 0.0), BodyTwist()))
    assert direction_driven(back) == (pytest.approx(math.pi), 0.0)
    dice = np.random.default_rng(1)
    # 0.01 m/s of noise across, 0.2 m/s along, 500 readings: 0.13 degrees (1 sigma).
    twists = tuple(BodyTwist(*(np.array([0.2, 0.0]) + dice.normal(size=2) * 0.01)) for _ in range(500))
    angle, error = direction_driven(BaseHeard(NOTHING, NOTHING, (*twists, BodyTwist()), ()))
    assert math.degrees(error) == pytest.approx(0.128, rel=0.15)
    assert abs(angle) < 3 * error
    with pytest.raises(DeviceNotReady, match="odometry"):
        direction_driven(BaseHeard(NOTHING, NOTHING, (BodyTwist(),) * 100, ()))


def test_poses_at_rest_before_and_after_a_turn_are_left_out():
    headings = np.concatenate([np.zeros(200), np.linspace(0.0, math.tau, 400), np.full(300, math.tau)])
    poses = np.column_stack([np.arange(900), np.zeros(900), np.array([math.remainder(h, math.tau) for h in headings])])
    kept = while_turning(poses)
    assert kept[0, 0] > 200
    assert kept[-1, 0] < 600
    assert len(kept) > 380
    assert len(while_turning(np.zeros((50, 3)))) == 50
