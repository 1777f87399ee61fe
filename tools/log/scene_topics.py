"""Topics for a 3-D viewer: the robot and the object as primitives, the path, and the object's pose.

The base is drawn as a box with the dimensions in Clearpath's Ridgeback data sheet (0.960 x 0.793 x 0.296 m), the
pusher as its contact ball, and the object only where it is simulated (otherwise its shape is unknown).
"""

from __future__ import annotations

import math

from robot_io.geometry import StraightPath
from robot_io.log.ros_messages import (
    BASE_FRAME,
    SENSOR_FRAME,
    WORLD_FRAME,
    Header,
    Path,
    Pose,
    PoseStamped,
    Quaternion,
    String,
    TFMessage,
    Transform,
    TransformStamped,
    Vector3,
    planar_pose,
    ros_time,
    yaw_quaternion,
)
from robot_io.rig.config import RigConfig
from robot_io.rig.types import Matrix3
from tools.log.tick_topics import Message, message

BALL_FRAME, SLIDER_FRAME = "contact_ball", "slider"
_BASE_SIZE_M = (0.960, 0.793, 0.296)
_SLIDER_HEIGHT_M = 0.3
_PATH_STEP_M = 0.25


def scene_messages(rig: RigConfig, log_time_ns: int) -> list[Message]:
    """Return the messages written once, at the start of a log: robot description, static frames, path."""
    header = Header(ros_time(log_time_ns), WORLD_FRAME)
    body = Header(header.stamp, BASE_FRAME)
    sensor = Transform(Vector3(*rig.frames.sensor_in_base_m), _quaternion(rig.frames.base_from_sensor))
    ball = Transform(Vector3(*rig.frames.contact_in_base_m), yaw_quaternion(0.0))
    fixed = TFMessage((TransformStamped(body, SENSOR_FRAME, sensor), TransformStamped(body, BALL_FRAME, ball)))
    return [
        message("/robot_description", log_time_ns, String(urdf(rig))),
        message("/tf_static", log_time_ns, fixed),
        message("/path", log_time_ns, _path(rig, header)),
    ]


def slider_frame(pose: Pose, log_time_ns: int) -> Message:
    """Return the object's frame on /tf."""
    header = Header(ros_time(log_time_ns), WORLD_FRAME)
    at = pose.position
    placed = Transform(Vector3(at.x, at.y, at.z), pose.orientation)
    return message("/tf", log_time_ns, TFMessage((TransformStamped(header, SLIDER_FRAME, placed),)))


def slider_pose(pose: Pose, log_time_ns: int) -> Message:
    """Return the simulated ground-truth pose on /slider/pose."""
    return message("/slider/pose", log_time_ns, PoseStamped(Header(ros_time(log_time_ns), WORLD_FRAME), pose))


def urdf(rig: RigConfig) -> str:
    """Return the robot description as URDF: boxes, cylinders and a sphere, in the frames of /tf."""
    height = _BASE_SIZE_M[2]
    links = [
        f'<link name="{WORLD_FRAME}"/>',
        _link(BASE_FRAME, _box(*_BASE_SIZE_M), height / 2, "0.25 0.25 0.28 1"),
        _joint("base", "floating", WORLD_FRAME, BASE_FRAME, (0.0, 0.0, 0.0)),
        _link(BALL_FRAME, f'<sphere radius="{rig.world.ball_radius_m}"/>', 0.0, "0.85 0.35 0.1 1"),
        _joint("pusher", "fixed", BASE_FRAME, BALL_FRAME, rig.frames.contact_in_base_m),
    ]
    if rig.base.level != "hardware":
        slider = rig.world.slider
        if slider.shape == "circle":
            shape = f'<cylinder radius="{slider.radius_m}" length="{_SLIDER_HEIGHT_M}"/>'
        else:
            shape = _box(slider.length_m, slider.width_m, _SLIDER_HEIGHT_M)
        links.append(_link(SLIDER_FRAME, shape, _SLIDER_HEIGHT_M / 2, "0.2 0.45 0.7 1"))
        links.append(_joint("slider", "floating", WORLD_FRAME, SLIDER_FRAME, (0.0, 0.0, 0.0)))
    return '<?xml version="1.0"?>\n<robot name="push">\n' + "\n".join(links) + "\n</robot>\n"


def _box(x: float, y: float, z: float) -> str:
    return f'<box size="{x} {y} {z}"/>'


def _link(name: str, shape: str, z: float, colour: str) -> str:
    return (
        f'<link name="{name}"><visual><origin xyz="0 0 {z}"/><geometry>{shape}</geometry>'
        f'<material name="{name}_colour"><color rgba="{colour}"/></material></visual></link>'
    )


def _joint(name: str, kind: str, parent: str, child: str, xyz: tuple[float, float, float]) -> str:
    at = " ".join(str(value) for value in xyz)
    return (
        f'<joint name="{name}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/></joint>'
    )


def _path(rig: RigConfig, header: Header) -> Path:
    path = StraightPath.of(rig.path.origin_m, rig.path.direction_deg)
    length = rig.control.distance_m + rig.path.expected_contact_m
    steps = max(1, min(1000, math.ceil(length / _PATH_STEP_M)))
    distances = (length * i / steps for i in range(steps + 1))
    return Path(
        header,
        tuple(PoseStamped(header, planar_pose(*path.point_in_world(s, 0.0), path.heading)) for s in distances),
    )


def _quaternion(rotation: Matrix3) -> Quaternion:
    """Return the unit quaternion of a rotation matrix, by its largest component (Shepperd's method)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    squares = (1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i)  # 4 x^2, 4 y^2, 4 z^2, 4 w^2
    largest = squares.index(max(squares))
    rows = (
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    )
    x, y, z, w = rows[largest]
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return Quaternion(x / length, y / length, z / length, w / length)
