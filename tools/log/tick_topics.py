"""Derive the topics people plot from `/control/tick`, for ROS tools; a pure function of the ticks.

Header stamps and log times are wall time in ns: the tick's CLOCK_MONOTONIC times plus the run's offset. A message of
a standard type is left out where a number in it would not be finite: viewers drop such messages, the tick holds it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from robot_io.clock import NS_PER_S
from robot_io.geometry import point_outside
from robot_io.log.channels import BY_TOPIC
from robot_io.log.log_format import LOG_FORMAT
from robot_io.log.messages import ArmStatus, LoopTiming, SafetyEvent
from robot_io.log.ros_messages import (
    BASE_FRAME,
    SENSOR_FRAME,
    SENSOR_WORLD_FRAME,
    WORLD_FRAME,
    DiagnosticArray,
    DiagnosticStatus,
    Header,
    JointState,
    KeyValue,
    Log,
    TFMessage,
    Transform,
    TransformStamped,
    TwistStamped,
    Vector3,
    Wrench,
    WrenchStamped,
    planar_twist,
    ros_time,
    yaw_quaternion,
)
from robot_io.messages import ArmState, BodyTwist, LinkState
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlTick, FtReading, Mode
from safety.faults import FAULTS
from tools.kinds import device_names
from tools.log.signals import SignalsOf
from tools.log.thinned_topics import TickThinning
from tools.log.torque import TorqueOf

JOINT_NAMES = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
_NO_TORQUE = Vector3(math.nan, math.nan, math.nan)
_MODE_NAMES = {int(mode): mode.name for mode in Mode}
_ARM_STATES = {int(state): state.name.lower() for state in ArmState}
_INFO, _WARN, _ERROR = 20, 30, 40


class Message(NamedTuple):
    """An encoded message: topic, log time in ns since 1970, payload."""

    topic: str
    log_time_ns: int
    payload: bytes


def message(topic: str, log_time_ns: int, value: Any) -> Message:
    """Encode `value` for one of the program's own topics."""
    return Message(topic, log_time_ns, BY_TOPIC[topic].cdr_type.encode(value))


class TickTopics:
    """Derives the other topics from ticks given in order; remembers only the last state reported."""

    def __init__(self, rig: RigConfig, wall_offset_ns: int, log_format: int = LOG_FORMAT) -> None:
        """log_format: of the log whose topics are derived; earlier ones have fewer."""
        self._offset_ns = wall_offset_ns
        self._names = device_names(rig)
        self._sensor_in_base = rig.frames.sensor_in_base_m
        self._until_3 = log_format <= 3
        self._torque, self._signals = TorqueOf(rig), SignalsOf(rig)
        self._thinned = TickThinning(rig, log_format)
        self._faults: tuple[str, ...] = ()
        self._mode = 0
        self._paused = False
        self._arm_packets = 0
        self._pose_seq = 0
        self._diagnosed_ns: int | None = None

    def expand(self, tick: ControlTick) -> list[Message]:
        """Return the messages derived from one tick, raw samples first."""
        inp, out = tick.input, tick.output
        now_ns = inp.now_ns + self._offset_ns
        header = Header(ros_time(now_ns), WORLD_FRAME)
        body = Header(header.stamp, BASE_FRAME)
        messages = [raw for reading in inp.ft.readings for raw in self._raw_wrench(reading)]
        torque = self._torque.of(tick)
        if self._thinned.viewers(now_ns):
            messages += self._wrench(tick, torque, now_ns)
            messages += self._twist("/base/cmd_vel_raw", body, now_ns, out.wanted_body)
            messages += self._twist("/base/cmd_vel", body, now_ns, out.command_body)
        if not self._until_3:
            messages.append(message("/control/signals", now_ns, self._signals.of(tick, header)))
        if self._thinned.timing(now_ns, inp.host.skipped):
            messages.append(message("/loop/timing", now_ns, _timing(tick, header)))
        messages += self._arm(tick)
        messages += self._base(tick)
        messages += self._events(tick, header, now_ns)
        if self._diagnosed_ns is None or inp.now_ns - self._diagnosed_ns >= NS_PER_S:
            self._diagnosed_ns = inp.now_ns
            messages.append(message("/diagnostics", now_ns, _diagnostics(tick, header, self._names)))
        return messages

    def _raw_wrench(self, reading: FtReading) -> list[Message]:
        time_ns = reading.received_ns + self._offset_ns
        if not self._sound(*reading.force, *reading.torque):
            return []
        wrench = Wrench(Vector3(*reading.force), Vector3(*reading.torque))
        return [message("/ft/wrench_raw", time_ns, WrenchStamped(Header(ros_time(time_ns), SENSOR_FRAME), wrench))]

    def _wrench(self, tick: ControlTick, torque: tuple[float, float, float], now_ns: int) -> list[Message]:
        force = tick.after.control.force_world
        frame = WORLD_FRAME if self._until_3 else SENSOR_WORLD_FRAME
        if not self._sound(*force, *torque):
            return []
        wrench = Wrench(Vector3(*force), _NO_TORQUE if self._until_3 else Vector3(*torque))
        return [message("/ft/wrench", now_ns, WrenchStamped(Header(ros_time(now_ns), frame), wrench))]

    def _twist(self, topic: str, header: Header, now_ns: int, twist: BodyTwist) -> list[Message]:
        if not self._sound(twist.vx, twist.vy, twist.omega):
            return []
        return [message(topic, now_ns, TwistStamped(header, planar_twist(twist)))]

    def _sound(self, *numbers: float) -> bool:
        """Return whether a standard message may hold these numbers; logs up to format 3 held what there was."""
        return self._until_3 or all(map(math.isfinite, numbers))

    def _arm(self, tick: ControlTick) -> list[Message]:
        arm = tick.input.arm
        if arm.packets == self._arm_packets:
            return []
        self._arm_packets = arm.packets
        joints, time_ns = arm.joints, arm.changed_ns + self._offset_ns
        header = Header(ros_time(time_ns), BASE_FRAME)
        messages = []
        if self._sound(*joints.position, *joints.velocity):
            state = JointState(header, JOINT_NAMES, joints.position, joints.velocity, ())
            messages.append(message("/arm/joint_states", time_ns, state))
        if not self._until_3 and self._thinned.arm_status(time_ns, arm):
            status = ArmStatus(
                header, joints.controller_time_s, joints.device_state, joints.state, arm.link, arm.error, arm.servo
            )
            messages.append(message("/arm/status", time_ns, status))
        return messages

    def _base(self, tick: ControlTick) -> list[Message]:
        base = tick.input.base
        if base.pose_seq == self._pose_seq or not base.pose_valid:
            return []
        self._pose_seq = base.pose_seq
        time_ns = base.pose_received_ns + self._offset_ns
        if not self._sound(base.pose.x, base.pose.y, base.pose.yaw) or not self._thinned.frames(time_ns):
            return []
        header = Header(ros_time(time_ns), WORLD_FRAME)
        pose = Transform(Vector3(base.pose.x, base.pose.y, 0.0), yaw_quaternion(base.pose.yaw))
        placed = TransformStamped(header, BASE_FRAME, pose)
        if self._until_3:
            return [message("/tf", time_ns, TFMessage((placed,)))]
        ahead, left, up = self._sensor_in_base
        x, y = point_outside(base.pose.x, base.pose.y, base.pose.yaw, ahead, left)
        sensor = Transform(Vector3(x, y, up), yaw_quaternion(0.0))
        aligned = TransformStamped(header, SENSOR_WORLD_FRAME, sensor)
        return [message("/tf", time_ns, TFMessage((placed, aligned)))]

    def _events(self, tick: ControlTick, header: Header, now_ns: int) -> list[Message]:
        before = tick.before[0].safety.mode if tick.before else self._mode
        after = self._mode = tick.after.safety.mode
        faults, self._faults, known = tick.output.faults, tick.output.faults, self._faults
        paused, self._paused, was_paused = tick.input.paused, tick.input.paused, self._paused
        if faults == known and before == after and paused == was_paused:
            return []
        events = []
        if paused != was_paused:
            events.append(("operator", "", "paused" if paused else "goes on after a pause", _INFO))
        for fault in faults:
            if fault not in known:
                row = FAULTS.get(fault)
                events.append(("fault", fault, row.text if row else fault, _ERROR if row and row.mode else _WARN))
        for fault in known:
            if fault not in faults:
                events.append(("cleared", fault, f"over: {FAULTS[fault].text if fault in FAULTS else fault}", _INFO))
        if before != after:
            events.append(("mode", "", f"{_mode(before)} -> {_mode(after)}", _WARN if after > Mode.PUSHING else _INFO))
        messages = []
        for kind, fault, text, level in events:
            event = SafetyEvent(header, tick.input.tick, kind, fault, text, before, after)
            messages.append(message("/safety/event", now_ns, event))
            line = f"{fault} {text}".strip()
            messages.append(message("/rosout", now_ns, Log(header.stamp, level, "safety", line, "", "", 0)))
        return messages


def _timing(tick: ControlTick, header: Header) -> LoopTiming:
    number, now_ns, host = tick.input.tick, tick.input.now_ns, tick.input.host
    return LoopTiming(
        header, number, now_ns - host.late_ns, host.late_ns, host.skipped, host.skipped > 0, host.log_dropped
    )


def _mode(number: int) -> str:
    return _MODE_NAMES.get(number, str(number))


def _arm_state(number: int) -> str:
    return _ARM_STATES.get(number, str(number))


def _diagnostics(tick: ControlTick, header: Header, names: tuple[str, str, str]) -> DiagnosticArray:
    sensor_name, arm_name, base_name = names
    ft, arm, base, host = tick.input.ft, tick.input.arm, tick.input.base, tick.input.host
    arm_up = arm.link == LinkState.UP and not arm.error
    base_up = base.pose_valid and not base.latched
    return DiagnosticArray(
        header,
        (
            _status(
                sensor_name,
                ft.link == LinkState.UP,
                packets=ft.packets_ok,
                crc_fail=ft.crc_fail,
                junk=ft.junk_bytes,
            ),
            _status(arm_name, arm_up, packets=arm.packets, error=arm.error, state=_arm_state(arm.joints.state)),
            _status(
                base_name,
                base_up and not base.status.stop_engaged,
                battery_v=round(base.status.battery_v, 2),
                stop_engaged=base.status.stop_engaged,
                gate_verdict=base.verdict,
                gate_latched=base.latched,
            ),
            _status("loop", not host.loop_error and host.skipped == 0, skipped=host.skipped, dropped=host.log_dropped),
            _status(
                "safety", not tick.output.faults, mode=_mode(tick.output.mode), faults=" ".join(tick.output.faults)
            ),
        ),
    )


def _status(name: str, good: bool, **values: object) -> DiagnosticStatus:
    pairs = tuple(KeyValue(key, str(value)) for key, value in values.items())
    return DiagnosticStatus(0 if good else 2, name, "ok" if good else "see values", name, pairs)
