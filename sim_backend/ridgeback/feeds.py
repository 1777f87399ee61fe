"""The messages a Ridgeback and the motion capture beside it publish, as plain dicts in the bridge's JSON shape.

Times of the messages are the robot's wall clock: monotonic time plus an offset. Positions m, angles rad. The base
turns about the vertical only, so its quaternion is (0, 0, sin(yaw/2), cos(yaw/2)).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from robot_io.clock import NS_PER_S
from robot_io.geometry import point_outside, rotated, seen_from_frame, wrap_angle
from robot_io.messages import BaseStatus, BodyTwist, Pose2D

Message = dict[str, Any]
_NO_COVARIANCE = [0.0] * 36
_MARKER_HEIGHT_M = 0.31
_AMPERE_IDLE = 3.2


class FeedWriter:
    """Builds messages; counts the sequence numbers of ROS 1 headers per topic.

    `stamp` turns a monotonic time (ns) into the header's time in the format of the ROS version.
    `base_from_marker`: x, y, yaw of the marker frame in the BODY frame: motion capture sees the markers.
    """

    def __init__(
        self, ros_version: int, stamp: Callable[[int], dict[str, int]], base_from_marker: tuple[float, float, float]
    ) -> None:
        self._ros1 = ros_version == 1
        self._stamp = stamp
        self._marker = base_from_marker
        self._sequence: Counter[str] = Counter()

    def base_transform(self, topic: str, pose: Pose2D, t_ns: int) -> Message:
        """Return motion capture's message for the base's markers: geometry_msgs/TransformStamped."""
        ahead, left, turn = self._marker
        x, y = point_outside(pose.x, pose.y, pose.yaw, ahead, left)
        return self.transform(topic, Pose2D(x, y, pose.yaw + turn), t_ns)

    def transform(self, topic: str, pose: Pose2D, t_ns: int) -> Message:
        """Return motion capture's message for a segment; the topic names it (/vicon/<subject>/<segment>)."""
        return {
            "header": self._header(topic, "/odom" if self._ros1 else "odom", t_ns),
            "child_frame_id": topic.lstrip("/"),
            "transform": {
                "translation": {"x": pose.x, "y": pose.y, "z": _MARKER_HEIGHT_M},
                "rotation": _quaternion(pose.yaw),
            },
        }

    def odometry(self, topic: str, pose: Pose2D, twist: BodyTwist, t_ns: int) -> Message:
        """nav_msgs/Odometry: pose since the start, velocity in the BODY frame."""
        return {
            "header": self._header(topic, "odom", t_ns),
            "child_frame_id": "base_link",
            "pose": {
                "pose": {"position": {"x": pose.x, "y": pose.y, "z": 0.0}, "orientation": _quaternion(pose.yaw)},
                "covariance": _NO_COVARIANCE,
            },
            "twist": {
                "twist": {
                    "linear": {"x": twist.vx, "y": twist.vy, "z": 0.0},
                    "angular": {"x": 0.0, "y": 0.0, "z": twist.omega},
                },
                "covariance": _NO_COVARIANCE,
            },
        }

    def joint_states(self, topic: str, pose: Pose2D, twist: BodyTwist, t_ns: int) -> Message:
        """sensor_msgs/JointState with joints x, y, yaw in the WORLD frame, not smoothed as the real one is."""
        velocity = [*rotated(twist.vx, twist.vy, pose.yaw), twist.omega]
        return {
            "header": self._header(topic, "", t_ns),
            "name": ["x", "y", "yaw"],
            "position": [pose.x, pose.y, math.remainder(pose.yaw, math.tau)],
            "velocity": velocity,
            "effort": [],
        }

    def status(self, topic: str, status: BaseStatus, up_ns: int, t_ns: int) -> Message:
        """ridgeback_msgs/Status of the microcontroller; `up_ns`: when it was started."""
        uptime = self._duration(t_ns - up_ns)
        return {
            "header": self._header(topic, "", t_ns),
            "hardware_id": "emulated",
            "mcu_uptime": uptime,
            "connection_uptime": uptime,
            "pcb_temperature": 31.0,
            "mcu_temperature": 33.0,
            "stop_power_status": True,
            "stop_engaged": status.stop_engaged,
            "drivers_active": status.drivers_active,
            "external_stop_present": False,
            "charger_connected": False,
            "charging_complete": False,
            "measured_battery": status.battery_v,
            "measured_12v": 12.1,
            "measured_5v": 5.0,
            "measured_inverter": 0.0,
            "measured_front_axle": status.battery_v if status.drivers_active else 0.0,
            "measured_rear_axle": status.battery_v if status.drivers_active else 0.0,
            "measured_light": 0.0,
            "total_current": _AMPERE_IDLE,
            "total_current_peak": _AMPERE_IDLE,
            "total_power_consumed": 0.0,
        }

    def _header(self, topic: str, frame: str, t_ns: int) -> Message:
        header: Message = {"stamp": self._stamp(t_ns), "frame_id": frame}
        if not self._ros1:
            return header
        self._sequence[topic] += 1
        return {"seq": self._sequence[topic], **header}

    def _duration(self, span_ns: int) -> dict[str, int]:
        whole, part = divmod(span_ns, NS_PER_S)
        return {"secs": whole, "nsecs": part} if self._ros1 else {"sec": whole, "nanosec": part}


def twist_of(message: Message) -> BodyTwist:
    """Return the velocity in a Twist or TwistStamped: linear x and y, angular z; the rest is ignored."""
    twist = message.get("twist", message)
    return BodyTwist(twist["linear"]["x"], twist["linear"]["y"], twist["angular"]["z"])


def seen_from(origin: Pose2D, pose: Pose2D) -> Pose2D:
    """Return `pose` in the frame of `origin`: odometry is relative to where it started."""
    x, y = seen_from_frame(pose.x - origin.x, pose.y - origin.y, origin.yaw)
    return Pose2D(x, y, wrap_angle(pose.yaw - origin.yaw))


def _quaternion(yaw: float) -> Message:
    return {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * yaw), "w": math.cos(0.5 * yaw)}
