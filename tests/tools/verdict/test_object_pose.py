"""Where the object is beside the path, and how far it has turned."""

import math

import pytest

from robot_io.messages import Pose2D
from robot_io.rig.task import PathConfig
from tools.verdict.object_pose import object_pose


def test_the_objects_own_error_left_of_a_turned_path():
    path = PathConfig(origin_m=(1.0, 2.0), direction_deg=90.0)  # along +y: left is -x
    found = object_pose(path, (Pose2D(1.0, 2.1, math.radians(170)), Pose2D(0.78, 3.0, math.radians(-110))))
    assert found.lateral_m == pytest.approx(0.22)
    assert math.degrees(found.turned_rad) == pytest.approx(80.0)


@pytest.mark.parametrize("poses", [None, (Pose2D(), Pose2D(math.nan, 0.0, 0.0)), (Pose2D(0, 0, math.nan), Pose2D())])
def test_a_pose_that_is_not_known_says_nothing(poses):
    assert object_pose(PathConfig(), poses) is None
