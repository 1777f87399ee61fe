"""The format of a log, and what the messages of an earlier format mean today: one line for each change.

Raise `LOG_FORMAT` with any change after which a log of before would be read wrongly: a field or topic that is renamed,
dropped, or means something else. A new field that has a default needs nothing here. Keys of the rig: `rig/renames`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from robot_io.errors import LogDamaged, UsageError
from robot_io.log.format_1 import arm_state
from robot_io.log.format_2 import always, sums_count
from robot_io.log.format_3 import not_kept

LOG_FORMAT = 5
FORMAT_FACT = "format"
"""Where a log's metadata `run` says its format; the first one said nothing."""
_FIRST_FORMAT = 1


class RenamedField(NamedTuple):
    """Logs up to `last_format` call the field `new` of `type_name` (its ROS name) `old`."""

    type_name: str
    old: str
    new: str
    last_format: int


class EarlierValue(NamedTuple):
    """A log up to `last_format`, which has no `field` in `type_name`, meant `value`, whatever today's default is."""

    type_name: str
    field: str
    value: Any
    last_format: int


class ComputedValue(NamedTuple):
    """A log up to `last_format` says `field` of `type_name` in other fields: `of` makes it from its message.

    The field is dotted where it is in a part of the message, and `of` takes the whole of it, as the log has it.
    """

    type_name: str
    field: str
    of: Callable[[Any], Any]
    last_format: int


class NowOptional(NamedTuple):
    """Logs up to `last_format` hold one message in `field` of `type_name`, today a sequence of at most one.

    `counts` says of the message that holds the field whether what it held there would be in it today.
    """

    type_name: str
    field: str
    counts: Callable[[Any], bool]
    last_format: int


class ChangedTopic(NamedTuple):
    """Logs up to `last_format` derived the messages of `topic` in another way, so that they cannot be compared."""

    topic: str
    last_format: int


RENAMED_FIELDS: tuple[RenamedField, ...] = ()
EARLIER_VALUES: tuple[EarlierValue, ...] = ()
COMPUTED_VALUES = (
    ComputedValue("push_msgs/msg/ArmRecord", "joints.state", arm_state, 1),
    ComputedValue("push_msgs/msg/BaseRecord", "pose_stamp_ns", not_kept, 3),
    ComputedValue("push_msgs/msg/BaseRecord", "odometry_stamp_ns", not_kept, 3),
    ComputedValue("push_msgs/msg/HostInput", "last_tick_ns", not_kept, 3),
)
NOW_OPTIONAL = (
    NowOptional("push_msgs/msg/ControlTick", "before", always, 2),
    NowOptional("push_msgs/msg/ControlState", "tare", sums_count, 2),
)
CHANGED_TOPICS = (ChangedTopic("/diagnostics", 1), ChangedTopic("/safety/event", 1), ChangedTopic("/rosout", 1))


def format_of(run_metadata: Mapping[str, str], where: str = "") -> int:
    """Return the format of the log `where` from its metadata `run`.

    Raises LogDamaged unless that is a number of at least 1, UsageError for a format newer than this program's.
    """
    said = run_metadata.get(FORMAT_FACT, str(_FIRST_FORMAT))
    if not (said.isascii() and said.isdigit() and 0 < len(said) < 10 and int(said) >= _FIRST_FORMAT):
        raise LogDamaged(
            f"its format is {said[:20]!r}, which is not a number", where=where, do="Look at it with `push log info`"
        )
    if int(said) > LOG_FORMAT:
        raise UsageError(
            f"this log has format {said}, and this program knows those up to {LOG_FORMAT}",
            where=where,
            do=f"Use the program that made it ({run_metadata.get('program', 'not named')})",
        )
    return int(said)
