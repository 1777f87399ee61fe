"""The topics of a log, and the kinds of records that the processes of a run push into their rings.

A ring record is (kind, time_ns, payload): the payload is a whole CDR message of the kind's type, `time_ns` is when it
was received (CLOCK_MONOTONIC). Header stamps *inside* a payload are wall time, as everywhere in ROS: monotonic plus
the run's one `wall_offset_ns`. The control tick is chained by the recorder (`chain`), which also derives the
topics of `DERIVED` from it.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

from robot_io.cdr.cdr_type import CdrType
from robot_io.log import world_messages as world
from robot_io.log.messages import (
    ARM_STATUS,
    BASE_CLOCK,
    BASE_STATUS,
    FLAWED_SAMPLE,
    GATE_DECISION,
    LOOP_TIMING,
    SAFETY_EVENT,
)
from robot_io.log.ros_messages import (
    DIAGNOSTIC_ARRAY,
    JOINT_STATE,
    LOG,
    ODOMETRY,
    PATH,
    POSE_STAMPED,
    STRING,
    TF_MESSAGE,
    TWIST_STAMPED,
    WRENCH_STAMPED,
)
from robot_io.log.signals import SIGNALS
from robot_io.tick import TICK_CDR


class Kind(IntEnum):
    """What a ring record is."""

    CONTROL_TICK = 1
    BASE_ODOM = 10
    BASE_POSE = 11
    """Pose of the base as localised (mocap, odometry or joint states), WORLD frame."""
    BASE_STATUS = 12
    SLIDER_POSE = 13
    """From motion capture; for the log only."""
    GATE_SENT = 14
    """What the gate really sent to the base."""
    GATE_DECISION = 15
    BASE_FLAWED = 16
    """What came from the base or the motion capture and cannot be used as it came."""
    BASE_CLOCK = 17
    """Once, when the base has been opened."""
    WORLD_START = 20
    WORLD_COMMAND = 21
    WORLD_STATE = 22
    WORLD_STALL = 23
    ROSOUT = 30
    SAFETY_EVENT = 31


class Channel(NamedTuple):
    """A topic, the type of its messages, and whether it is offered to late subscribers."""

    topic: str
    cdr_type: CdrType[Any]
    latched: bool = False


CHANNELS: dict[int, Channel] = {
    Kind.CONTROL_TICK: Channel("/control/tick", TICK_CDR),
    Kind.BASE_ODOM: Channel("/base/odom", ODOMETRY),
    Kind.BASE_POSE: Channel("/base/pose", POSE_STAMPED),
    Kind.BASE_STATUS: Channel("/base/status", BASE_STATUS),
    Kind.SLIDER_POSE: Channel("/slider/pose", POSE_STAMPED),
    Kind.BASE_CLOCK: Channel("/base/clock", BASE_CLOCK, latched=True),
    Kind.BASE_FLAWED: Channel("/base/flawed", FLAWED_SAMPLE),
    Kind.GATE_SENT: Channel("/gate/sent", TWIST_STAMPED),
    Kind.GATE_DECISION: Channel("/gate/decision", GATE_DECISION),
    Kind.WORLD_START: Channel("/world/start", world.START_CDR),
    Kind.WORLD_COMMAND: Channel("/world/command", world.COMMAND_CDR),
    Kind.WORLD_STATE: Channel("/world/state", world.STATE_CDR),
    Kind.WORLD_STALL: Channel("/world/stall", world.STALL_CDR),
    Kind.ROSOUT: Channel("/rosout", LOG),
    Kind.SAFETY_EVENT: Channel("/safety/event", SAFETY_EVENT),
}
"""Topic and type of each kind."""

DERIVED = (
    Channel("/ft/wrench_raw", WRENCH_STAMPED),
    Channel("/ft/wrench", WRENCH_STAMPED),
    Channel("/arm/joint_states", JOINT_STATE),
    Channel("/arm/status", ARM_STATUS),
    Channel("/control/signals", SIGNALS),
    Channel("/base/cmd_vel_raw", TWIST_STAMPED),
    Channel("/base/cmd_vel", TWIST_STAMPED),
    Channel("/loop/timing", LOOP_TIMING),
    Channel("/diagnostics", DIAGNOSTIC_ARRAY),
    Channel("/tf", TF_MESSAGE),
    Channel("/tf_static", TF_MESSAGE, latched=True),
    Channel("/robot_description", STRING, latched=True),
    Channel("/path", PATH, latched=True),
)
"""Topics that the recorder makes from the tick, from the world's state and from the rig."""

BY_TOPIC: dict[str, Channel] = {channel.topic: channel for channel in (*CHANNELS.values(), *DERIVED)}
"""Every topic of a log of this program."""
