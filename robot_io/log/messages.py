"""Messages of this program's own that are in the log beside the tick, the world's records and standard ROS types."""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.log.ros_messages import Header
from robot_io.messages import ArmError, ArmState, BaseStatus, BodyTwist, LinkState, Pose2D
from robot_io.named_values import Latch
from robot_io.tick import Mode


class LoopTiming(msgspec.Struct, frozen=True, gc=False):
    """How one tick came: woken `late_ns` after its deadline, `skipped` periods left out before it."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/LoopTiming"
    header: Header
    tick: int
    deadline_ns: int
    """CLOCK_MONOTONIC."""
    late_ns: int
    skipped: int
    overrun: bool
    """At least one period was left out."""
    log_dropped: int
    """Records that did not fit into the log's ring since the start."""


class SafetyEvent(msgspec.Struct, frozen=True, gc=False):
    """What changed; `kind`: "mode", "fault" and "cleared" (a fault came, went), "operator" (a pause) or "injected"."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/SafetyEvent"
    header: Header
    tick: int
    kind: str
    fault: str
    """Id in the fault table; empty for a change of mode."""
    text: str
    mode_before: Annotated[int, "uint8", Mode]
    mode_after: Annotated[int, "uint8", Mode]


class GateDecision(msgspec.Struct, frozen=True, gc=False):
    """What the gate made of a frame of control, or why it latched without one."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/GateDecision"
    header: Header
    seq: int
    tick: int
    verdict: Annotated[int, "uint8", Latch]
    """0: accepted; otherwise why not."""
    latched: bool
    text: str


class FlawedSample(msgspec.Struct, frozen=True, gc=False):
    """A pose or odometry that cannot be used as it came, or not all of it; NaN where a number was null.

    Only what is sound is on `topic` itself: nothing of a flawed pose, of odometry the velocity where it is whole.
    """

    __ros_name__: ClassVar[str] = "push_msgs/msg/FlawedSample"
    header: Header
    topic: str
    flaw: str
    """What is wrong, in words."""
    pose: Pose2D
    twist: BodyTwist


class BaseClock(msgspec.Struct, frozen=True, gc=False):
    """How far the wall clock of the base's computer is ahead of this machine's, and how well that is known."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/BaseClock"
    header: Header
    ahead_s: float
    within_s: float


class ArmStatus(msgspec.Struct, frozen=True, gc=False):
    """State of the arm with each of its packets; `header.stamp` is when it arrived."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ArmStatus"
    header: Header
    controller_time_s: float
    """The controller's own time: of a UR since it was switched on."""
    device_state: int
    """The controller's own modes, packed by its driver."""
    state: Annotated[int, "uint8", ArmState]
    link: Annotated[int, "uint8", LinkState]
    error: Annotated[int, "uint8", ArmError]
    servo: bool
    """Held actively."""


GATE_SAYS = "gate: "
"""How the text of an event begins that is the gate's own; all others are derived from ticks."""

INJECTED = "injected"
"""The kind of an event that says that a fault to be injected has changed its first sample."""

LOOP_TIMING = CdrType(LoopTiming, "push_msgs/msg/LoopTiming")
SAFETY_EVENT = CdrType(SafetyEvent, "push_msgs/msg/SafetyEvent")
GATE_DECISION = CdrType(GateDecision, "push_msgs/msg/GateDecision")
FLAWED_SAMPLE = CdrType(FlawedSample, "push_msgs/msg/FlawedSample")
ARM_STATUS = CdrType(ArmStatus, "push_msgs/msg/ArmStatus")
BASE_CLOCK = CdrType(BaseClock, "push_msgs/msg/BaseClock")
BASE_STATUS = CdrType(BaseStatus, "push_msgs/msg/BaseStatus")
