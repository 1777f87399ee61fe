"""The topics of the live view where `push watch` has opened the devices: those of a log that devices alone give."""

from __future__ import annotations

from robot_io.clock import monotonic_ns, wall_offset_ns
from robot_io.geometry import rotated
from robot_io.log.channels import CHANNELS
from robot_io.log.gate_log import GateLog
from robot_io.log.ros_messages import (
    BASE_FRAME,
    SENSOR_FRAME,
    SENSOR_WORLD_FRAME,
    WORLD_FRAME,
    Header,
    TFMessage,
    Transform,
    TransformStamped,
    Vector3,
    Wrench,
    WrenchStamped,
    ros_time,
    yaw_quaternion,
)
from robot_io.log.ros_messages import JointState as LoggedJoints
from robot_io.messages import BasePose, JointState, SensorWrench, Stamped
from robot_io.rig.config import RigConfig
from tools.live.feed import LiveFeed
from tools.log.scene_topics import scene_messages
from tools.log.tick_topics import JOINT_NAMES, Message, message
from tools.watch.reports import DeviceReport
from tools.watch.view import View


class LiveTopics:
    """Encodes what devices give and feeds it to the live view."""

    def __init__(self, rig: RigConfig, feed: LiveFeed) -> None:
        self._feed = feed
        self._offset_ns = wall_offset_ns()
        self._base = GateLog(self._record, self._offset_ns)
        for once in scene_messages(rig, monotonic_ns() + self._offset_ns):
            self._add(once)

    def take(self, report: DeviceReport) -> None:
        """Feed the samples of a report."""
        for wrench in report.ft:
            self._wrench(wrench)
        for joints in report.arm:
            self._joints(joints)
        for sample in report.base:
            self._base.inbound(sample)
            if isinstance(sample.value, BasePose) and sample.value.valid:
                self._frame(sample.value, sample.received_ns)

    def show(self, view: View) -> None:
        """Feed the wrench on the object, as a run logs it; then send what has been collected."""
        pose = view.base.pose
        torque = view.torque_on_object
        if view.force is not None and torque is not None and pose is not None:
            x, y, z = view.force.body
            on_object = (*rotated(-x, -y, pose[2]), -z)
            now_ns = monotonic_ns() + self._offset_ns
            header = Header(ros_time(now_ns), SENSOR_WORLD_FRAME)
            wrench = Wrench(Vector3(*on_object), Vector3(*torque))
            self._add(message("/ft/wrench", now_ns, WrenchStamped(header, wrench)))
        self._feed.flush()

    def _wrench(self, sample: Stamped[SensorWrench]) -> None:
        at_ns, value = sample.received_ns + self._offset_ns, sample.value
        wrench = Wrench(Vector3(value.fx, value.fy, value.fz), Vector3(value.mx, value.my, value.mz))
        self._add(message("/ft/wrench_raw", at_ns, WrenchStamped(Header(ros_time(at_ns), SENSOR_FRAME), wrench)))

    def _joints(self, sample: Stamped[JointState]) -> None:
        at_ns, value = sample.received_ns + self._offset_ns, sample.value
        header = Header(ros_time(at_ns), BASE_FRAME)
        self._add(
            message("/arm/joint_states", at_ns, LoggedJoints(header, JOINT_NAMES, value.position, value.velocity, ()))
        )

    def _frame(self, value: BasePose, received_ns: int) -> None:
        at_ns, pose = received_ns + self._offset_ns, value.pose
        placed = Transform(Vector3(pose.x, pose.y, 0.0), yaw_quaternion(pose.yaw))
        header = Header(ros_time(at_ns), WORLD_FRAME)
        self._add(message("/tf", at_ns, TFMessage((TransformStamped(header, BASE_FRAME, placed),))))

    def _record(self, kind: int, at_ns: int, payload: bytes) -> None:
        self._feed.add(CHANNELS[kind].topic, at_ns + self._offset_ns, payload)

    def _add(self, made: Message) -> None:
        self._feed.add(made.topic, made.log_time_ns, made.payload)
