"""An emulated Ridgeback that does something wrong from the start."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import BodyTwist
from robot_io.rig.config import RigConfig
from sim_backend.injection.wire_words import WireFault
from sim_backend.ridgeback.emulator import RosbridgeEmulator
from sim_backend.ridgeback.faults import BridgeFaults
from sim_backend.ridgeback.ros_graph import Message

FOR_GOOD_S = 1e6
OTHER_TYPES = {"command-type": "geometry_msgs/TwistStamped", "pose-type": "geometry_msgs/PoseStamped"}
Change = Callable[[Message], Message | None]


def spoil_base(loop: EventLoop, emulator: RosbridgeEmulator, faults: Sequence[WireFault], rig: RigConfig) -> None:
    """Let the emulator do wrong what `faults` of base say."""
    bridge = BridgeFaults(loop, emulator)
    changes: dict[str, list[Change]] = {}
    for fault in faults:
        kind = (fault.device, fault.kind)
        if fault.kind in OTHER_TYPES:
            topic = rig.base.topics.command if fault.kind == "command-type" else _topic(rig, "base.pose")
            bridge.topic_type(f"/{topic.lstrip('/')}", OTHER_TYPES[fault.kind])
        elif kind in _DEEDS:
            _DEEDS[kind](bridge, fault.value)
        else:
            changes.setdefault(_topic(rig, fault.device), []).append(_change(fault))
    if changes:
        bridge.alter(lambda topic, message: _altered(changes.get(topic, []), message))


_DEEDS: dict[tuple[str, str], Callable[[BridgeFaults, tuple[float, ...]], None]] = {
    ("base", "silent"): lambda bridge, _: bridge.freeze(FOR_GOOD_S),
    ("base", "lag"): lambda bridge, value: bridge.lag(value[0]),
    ("base", "no-rosapi"): lambda bridge, _: bridge.no_rosapi(),
    ("base", "cold"): lambda bridge, value: bridge.cold(value[0]),
    ("base", "slow-answers"): lambda bridge, value: bridge.slow_answers(value[0]),
    ("base", "no-listener"): lambda bridge, _: bridge.subscriber_missing(),
    ("base", "second-publisher"): lambda bridge, _: bridge.other_publisher(),
    ("base", "second-client"): lambda bridge, _: bridge.other_client(),
    ("base", "commanded"): lambda bridge, value: bridge.other_commands(BodyTwist(value[0])),
    ("base", "clock"): lambda bridge, value: bridge.set_clock(value[0]),
    ("base", "battery"): lambda bridge, value: bridge.battery(value[0]),
    ("base.command", "ignored"): lambda bridge, _: bridge.subscriber_missing(),
    ("base.command", "lost"): lambda bridge, _: bridge.kill(),
    ("base.status", "e-stop"): lambda bridge, _: bridge.press_stop(),
    ("base.status", "motors-off"): lambda bridge, _: bridge.motors_off(),
}


def _topic(rig: RigConfig, device: str) -> str:
    topics = rig.base.topics
    pose = {"mocap": topics.base_pose, "odometry": topics.odometry, "joint_states": topics.joint_states}
    name = {"base.odometry": topics.odometry, "base.status": topics.status}.get(device, pose[rig.base.pose_source])
    return f"/{name.lstrip('/')}"


def _altered(changes: Sequence[Change], message: Message) -> Message | None:
    altered: Message | None = copy.deepcopy(message)
    for change in changes:
        altered = change(altered) if altered is not None else None
    return altered


def _change(fault: WireFault) -> Change:
    if fault.kind == "off":
        return lambda _message: None
    if fault.kind == "slow":
        return _Slow(fault.value[0])
    if fault.kind == "intermittent":
        half_ns = fault.value[0] * NS_PER_S / 2
        return lambda message: message if int(monotonic_ns() / half_ns) % 2 else None
    if fault.kind == "frame":
        return _Frames()
    if fault.device == "base.status":
        return lambda message: {**message, "measured_battery": message["measured_battery"] + fault.value[0]}
    if fault.kind == "wrong":
        return lambda message: _faster(message, fault.value[0])
    return lambda message: _without_numbers(message, "pose" if fault.device == "base.pose" else "twist")


class _Slow:
    """Passes only so many messages a second."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = NS_PER_S / rate_hz
        self._next_ns = 0.0

    def __call__(self, message: Message) -> Message | None:
        now_ns = monotonic_ns()
        if now_ns < self._next_ns:
            return None
        self._next_ns = now_ns + self._period_ns
        return message


class _Frames:
    """Gives every other message in another frame."""

    def __init__(self) -> None:
        self._count = 0

    def __call__(self, message: Message) -> Message | None:
        self._count += 1
        if self._count % 2:
            message["header"]["frame_id"] = "map"
        return message


def _faster(message: Message, by_m_per_s: float) -> Message:
    message["twist"]["twist"]["linear"]["x"] += by_m_per_s
    return message


def _without_numbers(message: Message, what: str) -> Message:
    """Return the message with NaN for every coordinate (`pose`) or velocity (`twist`)."""
    if "position" in message:  # joint states
        message["position"] = [math.nan] * len(message["position"])
        return message
    for part in (message.get("transform") or message[what][what]).values():
        for name in part:
            part[name] = math.nan
    return message
