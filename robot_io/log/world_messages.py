"""What the simulated world writes into the log, so that it can be run again and compared bit for bit.

Times are ns of the world's own time line (CLOCK_MONOTONIC, virtual at level `sim`), on its 1 ms grid.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.messages import BodyTwist, Pose2D
from robot_io.named_values import ContactMode


class WorldStart(msgspec.Struct, frozen=True, gc=False):
    """Where and when a world began; its parameters are the rig in the log's `config.toml`."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/WorldStart"
    seed: int
    start_ns: int


class WorldCommand(msgspec.Struct, frozen=True, gc=False):
    """A command that reached the wheels (BODY frame, m/s, rad/s), or a switch of the motors, and when."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/WorldCommand"
    arrival_ns: int
    twist: BodyTwist
    is_switch: bool
    drivers_active: bool


class WorldState(msgspec.Struct, frozen=True, gc=False):
    """The truth, every 10 ms: base, object, and the contact (N and m in the WORLD frame)."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/WorldState"
    t_ns: int
    base: Pose2D
    velocity: BodyTwist
    slider: Pose2D
    force_x: float
    force_y: float
    contact_x: float
    contact_y: float
    contact_mode: Annotated[int, "uint8", ContactMode]


class WorldStall(msgspec.Struct, frozen=True, gc=False):
    """The host paused: the world had to catch up by `steps` steps of 1 ms at once."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/WorldStall"
    t_ns: int
    steps: int


START_CDR = CdrType(WorldStart, "push_msgs/msg/WorldStart")
COMMAND_CDR = CdrType(WorldCommand, "push_msgs/msg/WorldCommand")
STATE_CDR = CdrType(WorldState, "push_msgs/msg/WorldState")
STALL_CDR = CdrType(WorldStall, "push_msgs/msg/WorldStall")
