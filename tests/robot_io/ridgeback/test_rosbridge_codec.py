"""JSON texts below are written by hand from the protocol document and from what a real bridge was seen to send."""

import json
import math

import pytest

from robot_io.geometry import base_pose_from_marker, compose, inverse, wrap_angle, yaw_from_quaternion
from robot_io.messages import BaseStatus, BodyTwist, Pose2D
from robot_io.ridgeback.rosbridge_codec import (
    OtherOperation,
    Published,
    ServiceAnswer,
    decode_frame,
    decode_subscribers,
    decode_time,
    decode_topic_type,
    encode_advertise,
    encode_call,
    encode_subscribe,
    encode_twist,
    spell_type,
    type_fits,
)
from robot_io.ridgeback.rosbridge_messages import (
    decode_joint_states,
    decode_odometry,
    decode_status,
    decode_transform,
    decode_twist,
)

ZEROS36 = "[" + ",".join(["0.0"] * 36) + "]"
TRANSFORM = (
    '{"op":"publish","topic":"/vicon/ThingBase_4/ThingBase_4","msg":{"header":{"seq":1,"stamp":{"secs":1795312357,'
    '"nsecs":98284244},"frame_id":"/odom"},"child_frame_id":"vicon/ThingBase_4/ThingBase_4","transform":{"translation":'
    '{"x":1.5,"y":-0.25,"z":0.31},"rotation":{"x":0.0,"y":0.0,"z":0.7071067811865476,"w":0.7071067811865476}}}}'
)
JOINTS = (
    '{"op":"publish","topic":"/ridgeback/joint_states","msg":{"header":{"seq":200,"stamp":{"secs":1795313503,'
    '"nsecs":59572458},"frame_id":""},"name":["yaw","x","y"],"position":[0.5,1.0,2.0],"velocity":[0.0,0.0,0.0],"effort":[]}}'
)
ODOMETRY = (
    '{"op":"publish","topic":"/ridgeback_velocity_controller/odom","msg":{"header":{"seq":1,"stamp":{"secs":1795313503,'
    '"nsecs":91884851},"frame_id":"odom"},"child_frame_id":"base_link","pose":{"pose":{"position":{"x":3.0,"y":4.0,"z":0.0},'
    '"orientation":{"x":0.0,"y":0.0,"z":1.0,"w":0.0}},"covariance":COV},"twist":{"twist":{"linear":{"x":0.1,"y":-0.2,"z":0.0},'
    '"angular":{"x":0.0,"y":0.0,"z":0.3}},"covariance":COV}}}'.replace("COV", ZEROS36)
)
STATUS = (
    '{"header":{"seq":7,"stamp":{"secs":1,"nsecs":2},"frame_id":""},"hardware_id":"mcu","stop_engaged":true,'
    '"drivers_active":false,"external_stop_present":true,"measured_battery":25.75}'
)


def message(text: str) -> bytes:
    frame = decode_frame(text.encode())
    assert isinstance(frame, Published)
    return frame.msg


# outwards


def test_twist_is_the_publish_of_the_protocol_document():
    assert encode_twist("/cmd_vel", "geometry_msgs/Twist", BodyTwist(0.1, -0.2, 0.3)) == (
        b'{"op":"publish","topic":"/cmd_vel","msg":{"linear":{"x":0.1,"y":-0.2,"z":0.0},'
        b'"angular":{"x":0.0,"y":0.0,"z":0.3}}}'
    )


def test_stamped_twist_leaves_the_stamp_to_the_robot():
    text = encode_twist("/cmd_vel", "geometry_msgs/msg/TwistStamped", BodyTwist(0.1, 0, 0))
    assert json.loads(text)["msg"] == {
        "header": {"frame_id": "base_link"},
        "twist": {"linear": {"x": 0.1, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}},
    }


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("axis", ["vx", "vy", "omega"])
def test_a_velocity_that_is_not_finite_is_refused(bad, axis):
    with pytest.raises(ValueError, match="finite"):
        encode_twist("/cmd_vel", "geometry_msgs/Twist", BodyTwist(**{axis: bad}))


def test_advertise_subscribe_and_their_opposites():
    assert json.loads(encode_advertise("/cmd_vel", "geometry_msgs/Twist")) == {
        "op": "advertise",
        "id": "adv:/cmd_vel",
        "topic": "/cmd_vel",
        "type": "geometry_msgs/Twist",
        "queue_size": 1,
        "latch": False,
    }
    subscribe = json.loads(encode_subscribe("/odom", "nav_msgs/Odometry"))
    assert subscribe == {
        "op": "subscribe",
        "id": "sub:/odom",
        "topic": "/odom",
        "type": "nav_msgs/Odometry",
        "throttle_rate": 0,
        "queue_length": 1,
    }
    assert isinstance(subscribe["throttle_rate"], int)  # a float makes the server drop the subscription


def test_service_call():
    assert json.loads(encode_call("s1", "/rosapi/topic_type", {"topic": "/cmd_vel"})) == {
        "op": "call_service",
        "id": "s1",
        "service": "/rosapi/topic_type",
        "args": {"topic": "/cmd_vel"},
    }


def test_type_names_of_both_ros():
    assert spell_type("geometry_msgs/Twist", 2) == "geometry_msgs/msg/Twist"
    assert spell_type("geometry_msgs/msg/Twist", 1) == "geometry_msgs/Twist"
    assert spell_type("geometry_msgs/msg/Twist", 2) == "geometry_msgs/msg/Twist"
    assert type_fits("geometry_msgs/Twist", "geometry_msgs/Twist")
    assert type_fits("geometry_msgs/Twist", "geometry_msgs/msg/Twist")
    assert not type_fits("geometry_msgs/msg/Twist", "geometry_msgs/Twist")  # ROS 1 has no such type
    assert not type_fits("geometry_msgs/Twist", "geometry_msgs/TwistStamped")


# inwards


def test_transform_of_the_marker():
    reading = decode_transform(message(TRANSFORM))
    assert reading.flaw == ""
    assert (reading.pose.x, reading.pose.y) == (1.5, -0.25)
    assert reading.pose.yaw == pytest.approx(math.pi / 2)
    assert (reading.frame, reading.child_frame) == ("/odom", "vicon/ThingBase_4/ThingBase_4")
    assert reading.stamp_s == pytest.approx(1795312357.098284244, abs=1e-6)


def test_escaped_slashes_are_the_same_topic():
    escaped = TRANSFORM.replace("/", "\\/")
    frame = decode_frame(escaped.encode())
    assert isinstance(frame, Published)
    assert frame.topic == "/vicon/ThingBase_4/ThingBase_4"
    assert decode_transform(frame.msg) == decode_transform(message(TRANSFORM))


def test_ros2_stamps():
    text = TRANSFORM.replace('"secs":1795312357,"nsecs":98284244', '"sec":1795312357,"nanosec":500000000')
    assert decode_transform(message(text)).stamp_s == 1795312357.5


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ('"x":1.5', '"x":null', "null"),
        ('"w":0.7071067811865476', '"w":null', "null"),
        ('"z":0.7071067811865476,"w":0.7071067811865476', '"z":0.0,"w":0.0', "quaternion"),
        ('"z":0.7071067811865476,"w":0.7071067811865476', '"z":0.9,"w":0.9', "quaternion"),
        ('"rotation":{"x":0.0', '"rotation":{"x":0.5', "quaternion"),
        ('"x":0.0,"y":0.0,"z":0.7071067811865476,"w":0.7071067811865476', '"x":1.0,"y":0.0,"z":0.0,"w":0.0', "upright"),
    ],
)
def test_unusable_poses_keep_their_flaw(old, new, word):
    assert TRANSFORM.count(old) == 1
    assert word in decode_transform(message(TRANSFORM.replace(old, new))).flaw


def test_odometry_gives_pose_and_body_velocity():
    odometry = decode_odometry(message(ODOMETRY))
    assert odometry.twist == BodyTwist(0.1, -0.2, 0.3)
    assert (odometry.reading.pose.x, odometry.reading.pose.y) == (3.0, 4.0)
    assert abs(odometry.reading.pose.yaw) == pytest.approx(math.pi)
    assert odometry.reading.child_frame == "base_link"


def test_null_in_odometry_is_nan():
    twist = decode_odometry(message(ODOMETRY.replace('"x":0.1', '"x":null'))).twist
    assert math.isnan(twist.vx)
    assert twist.vy == -0.2


def test_joint_states_go_by_name():
    reading = decode_joint_states(message(JOINTS))
    assert reading.pose == Pose2D(1.0, 2.0, 0.5)
    assert reading.flaw == ""
    assert decode_joint_states(message(JOINTS.replace('"yaw"', '"front_rocker"'))).flaw
    assert decode_joint_states(message(JOINTS.replace("[0.5,1.0,2.0]", "[0.5,null,2.0]"))).flaw
    assert decode_joint_states(message(JOINTS.replace("[0.5,1.0,2.0]", "[0.5]"))).flaw


def test_status():
    assert decode_status(STATUS.encode()) == BaseStatus(True, False, 25.75)
    assert math.isnan(decode_status(STATUS.replace("25.75", "null").encode()).battery_v)


def test_command_echo_plain_and_stamped():
    plain = b'{"linear":{"x":0.1,"y":0.0,"z":0.0},"angular":{"x":0.0,"y":0.0,"z":-1}}'
    assert decode_twist(plain, "geometry_msgs/Twist") == BodyTwist(0.1, 0.0, -1.0)
    stamped = b'{"header":{"stamp":{"sec":1,"nanosec":2},"frame_id":""},"twist":' + plain + b"}"
    assert decode_twist(stamped, "geometry_msgs/msg/TwistStamped") == BodyTwist(0.1, 0.0, -1.0)


def test_service_answers():
    good = decode_frame(
        b'{"op":"service_response","service":"\\/rosapi\\/topic_type","values":{"type":"geometry_msgs\\/Twist"},'
        b'"result":true,"id":"s1"}'
    )
    assert isinstance(good, ServiceAnswer)
    assert (good.call_id, good.ok) == ("s1", True)
    assert decode_topic_type(good.values) == "geometry_msgs/Twist"
    bad = decode_frame(
        b'{"op":"service_response","service":"/nope","values":"Service /nope does not exist","result":false,"id":"s3"}'
    )
    assert isinstance(bad, ServiceAnswer)
    assert not bad.ok
    assert decode_subscribers(b'{"subscribers":["/twist_mux"]}') == ["/twist_mux"]


def test_other_operations_are_named():
    assert decode_frame(b'{"op":"fragment","id":0,"data":"x","num":0,"total":3.02}') == OtherOperation("fragment")


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"hello",
        b"[1]",
        b'{"topic":"/a"}',
        b'{"op":3}',
        TRANSFORM[:-1].encode(),
        b'{"op":"publish","msg":{"x":NaN}}',
        b'{"op":"publish","topic":"/a","msg":' + b"[" * 100_000 + b"]" * 100_000 + b"}",
    ],
)
def test_nonsense_is_a_value_error(text):
    with pytest.raises(ValueError):
        decode_frame(text)


@pytest.mark.parametrize("decode", [decode_transform, decode_odometry, decode_joint_states, decode_status])
def test_the_wrong_message_is_a_value_error(decode):
    with pytest.raises(ValueError):
        decode(b'{"data":true}')
    with pytest.raises(ValueError):
        decode(b"null")
    with pytest.raises(ValueError):
        decode(b'{"deeper":' * 100_000 + b"0" + b"}" * 100_000)


@pytest.mark.parametrize("seconds", ["9" * 400, "4294967296", "-2147483649", "1.5", "null"])
def test_a_stamp_that_is_no_32_bit_number_is_a_value_error(seconds):
    assert decode_transform(json.dumps(json.loads(TRANSFORM)["msg"]).encode())
    with pytest.raises(ValueError):
        decode_transform(json.dumps(json.loads(TRANSFORM)["msg"]).replace("1795312357", seconds).encode())


# poses


def test_base_from_marker_by_hand():
    # The marker sits 0.2 m ahead of the base's centre, turned left by 90 degrees. The base stands at (1, 2), facing
    # +y (90 degrees): the marker is seen at (1, 2.2), facing -x (180 degrees).
    base = base_pose_from_marker(Pose2D(1.0, 2.2, math.pi), Pose2D(0.2, 0.0, math.pi / 2))
    assert (base.x, base.y, base.yaw) == pytest.approx((1.0, 2.0, math.pi / 2))


def test_inverse_undoes():
    pose = Pose2D(0.3, -0.4, 2.5)
    back = compose(pose, inverse(pose))
    assert (back.x, back.y, back.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_yaw_of_quaternions():
    assert yaw_from_quaternion(0, 0, math.sin(0.35), math.cos(0.35)) == pytest.approx(0.7)
    assert yaw_from_quaternion(0, 0, -math.sin(0.35), -math.cos(0.35)) == pytest.approx(0.7)
    assert yaw_from_quaternion(0, 0, 0, 0) is None
    assert yaw_from_quaternion(0, 0, 0, math.nan) is None
    assert wrap_angle(-math.pi) == math.pi


@pytest.mark.parametrize("names", [("secs", "nsecs"), ("sec", "nanosec")])
def test_the_robots_time_in_either_ros(names):
    whole, part = names
    values = json.dumps({"time": {whole: 1795312357, part: 250000000}}).encode()
    assert decode_time(values) == 1795312357.25


@pytest.mark.parametrize("values", ["{}", '{"time": 3}', '"Service does not exist"', '{"time": {"secs": 1.5}}'])
def test_what_is_no_time_is_refused(values):
    with pytest.raises(ValueError):
        decode_time(values.encode())
