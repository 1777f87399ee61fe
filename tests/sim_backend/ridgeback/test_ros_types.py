import math

import pytest

from robot_io.messages import BaseStatus, BodyTwist, Pose2D
from sim_backend.ridgeback.feeds import FeedWriter
from sim_backend.ridgeback.ros_graph import message_json
from sim_backend.ridgeback.ros_types import BadMessage, RosTypes

ROS1 = RosTypes(1, lambda: (12, 34))
ROS2 = RosTypes(2, lambda: (12, 34))
TWIST = "geometry_msgs/Twist"


def test_missing_fields_are_zero_and_ints_are_floats():
    assert ROS1.filled(TWIST, {"linear": {"x": 1}}) == {
        "linear": {"x": 1.0, "y": 0.0, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": 0.0},
    }
    assert ROS1.filled(TWIST, {})["linear"]["x"] == 0.0


@pytest.mark.parametrize("bad", ["0.1", True, None, [0.1], {}])
def test_anything_but_a_number_voids_the_message(bad):
    with pytest.raises(BadMessage):
        ROS1.filled(TWIST, {"linear": {"x": bad}})


@pytest.mark.parametrize("bad", [{"speed": 1.0}, {"linear": {"w": 1.0}}, None, [], 3, "x"])
def test_unknown_fields_and_no_objects_void_the_message(bad):
    with pytest.raises(BadMessage):
        ROS1.filled(TWIST, bad)


def test_nan_and_infinity_pass_inwards_and_are_null_outwards():
    filled = ROS1.filled(TWIST, {"linear": {"x": math.nan, "y": math.inf}})
    assert math.isnan(filled["linear"]["x"])
    assert message_json(filled).startswith('{"linear":{"x":null,"y":null,"z":0.0}')


def test_type_names_of_either_ros():
    assert ROS1.canonical("geometry_msgs/Twist") == "geometry_msgs/Twist"
    assert ROS1.canonical("geometry_msgs/msg/Twist") is None
    assert ROS2.canonical("geometry_msgs/Twist") == "geometry_msgs/msg/Twist"
    assert ROS2.canonical("geometry_msgs/msg/Twist") == "geometry_msgs/msg/Twist"
    assert ROS1.canonical("geometry_msgs/Nonsense") is None
    assert ROS1.canonical(5) is None


def test_header_time_is_filled_in():
    stamped = "geometry_msgs/TwistStamped"
    assert ROS1.filled(stamped, {})["header"] == {"seq": 0, "stamp": {"secs": 12, "nsecs": 34}, "frame_id": ""}
    assert ROS2.filled(stamped, {})["header"]["stamp"] == {"sec": 0, "nanosec": 0}
    assert ROS2.filled(stamped, {"header": {}})["header"] == {"stamp": {"sec": 12, "nanosec": 34}, "frame_id": ""}
    given = {"header": {"stamp": {"secs": 5, "nsecs": 6}}}
    assert ROS1.filled(stamped, given)["header"]["stamp"] == {"secs": 5, "nsecs": 6}


def test_arrays():
    state = ROS1.filled("sensor_msgs/JointState", {"name": ["a"], "position": [1, 2.5]})
    assert state["name"] == ["a"]
    assert state["position"] == [1.0, 2.5]
    assert state["velocity"] == []
    with pytest.raises(BadMessage):
        ROS1.filled("sensor_msgs/JointState", {"position": [None]})
    with pytest.raises(BadMessage):
        ROS1.filled("geometry_msgs/TwistWithCovariance", {"covariance": [0.0] * 35})


@pytest.mark.parametrize(("types", "version"), [(ROS1, 1), (ROS2, 2)])
def test_every_feed_is_a_complete_message_of_its_type(types, version):
    writer = FeedWriter(version, lambda t_ns: types.time(divmod(t_ns, 10**9)), (0.0, 0.0, 0.0))
    pose, twist = Pose2D(1.0, 2.0, 0.5), BodyTwist(0.1, 0.2, 0.3)
    for type_name, message in (
        ("geometry_msgs/TransformStamped", writer.base_transform("/vicon/a/a", pose, 5)),
        ("nav_msgs/Odometry", writer.odometry("/odom", pose, twist, 5)),
        ("sensor_msgs/JointState", writer.joint_states("/ridgeback/joint_states", pose, twist, 5)),
        ("ridgeback_msgs/Status", writer.status("/mcu/status", BaseStatus(False, True, 26.0), 0, 5)),
    ):
        assert types.filled(type_name, message) == message


def test_joint_states_turn_the_velocity_into_the_world():
    writer = FeedWriter(1, lambda t_ns: {"secs": 0, "nsecs": t_ns}, (0.0, 0.0, 0.0))
    message = writer.joint_states("/j", Pose2D(0.0, 0.0, math.pi / 2), BodyTwist(0.1, 0.0, 0.2), 0)
    assert message["velocity"] == pytest.approx([0.0, 0.1, 0.2])
