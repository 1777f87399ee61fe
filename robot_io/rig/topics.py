"""The ROS topics of a base, as a rig file names them."""

from __future__ import annotations

from typing import Literal

from robot_io.rig.types import Table


class TopicsConfig(Table, frozen=True):
    """ROS topics and types of the base (rosbridge v2). An empty topic is not used."""

    ros_version: Literal[1, 2] = 1
    command: str = "/cmd_vel"
    """Must pass the controller that stops the wheels after 0.25 s."""
    command_type: str = "geometry_msgs/Twist"
    odometry: str = "/odometry/filtered"
    odometry_type: str = "nav_msgs/Odometry"
    base_pose: str = "/vicon/ThingBase_4/ThingBase_4"
    base_pose_type: str = "geometry_msgs/TransformStamped"
    joint_states: str = "/ridgeback/joint_states"
    """Joints named x, y and yaw; used with `pose_source = "joint_states"` only."""
    joint_states_type: str = "sensor_msgs/JointState"
    world_frame: str = ""
    """Frame in which the base pose must come; empty: the frame of the first message, and none other after it."""
    status: str = "/mcu/status"
    status_type: str = "ridgeback_msgs/Status"
    slider_pose: str = ""
    """Where motion capture sees the object; logged, never used for control."""
    slider_pose_type: str = "geometry_msgs/TransformStamped"
    ball_pose: str = ""
    """Where motion capture sees a marker on the contact ball, in the same type; for `push calibrate contact`."""
