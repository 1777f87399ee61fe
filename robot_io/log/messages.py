"""Messages of this program's own that are in the log beside the tick, the world's records and standard ROS types."""

from __future__ import annotations

from typing import ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.log.ros_messages import Header
from robot_io.messages import BaseStatus


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
    mode_before: int
    mode_after: int


class GateDecision(msgspec.Struct, frozen=True, gc=False):
    """What the gate made of a frame of control, or why it latched without one."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/GateDecision"
    header: Header
    seq: int
    tick: int
    verdict: int
    """0: accepted; otherwise why not, as in `safety/gate.py`."""
    latched: bool
    text: str


GATE_SAYS = "gate: "
"""How the text of an event begins that is the gate's own; all others are derived from ticks."""

INJECTED = "injected"
"""The kind of an event that says that a fault to be injected has changed its first sample."""

LOOP_TIMING = CdrType(LoopTiming, "push_msgs/msg/LoopTiming")
SAFETY_EVENT = CdrType(SafetyEvent, "push_msgs/msg/SafetyEvent")
GATE_DECISION = CdrType(GateDecision, "push_msgs/msg/GateDecision")
BASE_STATUS = CdrType(BaseStatus, "push_msgs/msg/BaseStatus")
