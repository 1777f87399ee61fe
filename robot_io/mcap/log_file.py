"""Writes the log of a run: MCAP, profile `ros2`, every channel CDR with its `ros2msg` schema in the file.

Nothing in the file depends on when or where it is written: the same calls give the same bytes. Every part of it is
covered by a CRC-32. What has been flushed survives the death of the writer (`push log recover`); what is finished
opens everywhere.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, BinaryIO

from robot_io.cdr.cdr_type import CdrType
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.mcap.write import McapWriter

PROFILE = "ros2"
LIBRARY = "single-point-push"
MESSAGE_ENCODING = "cdr"
SCHEMA_ENCODING = "ros2msg"
CONFIG_ATTACHMENT = "config.toml"
RUN_METADATA = "run"
END_METADATA = "run_end"

_FOREVER = "{sec: 9223372036, nsec: 854775807}"
# All fields or none: rosbags fails on a profile that lacks one. Numbers are those of rmw: keep last 1, reliable,
# transient local, automatic liveliness.
LATCHED_QOS = (
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    f"  deadline: {_FOREVER}\n  lifespan: {_FOREVER}\n"
    f"  liveliness: 1\n  liveliness_lease_duration: {_FOREVER}\n"
    "  avoid_ros_namespace_conventions: false\n"
)


class McapLog:
    """A log being written.

    path: where it goes; nothing may be there yet.
    config_text: attached as config.toml.
    metadata: the facts of the run.

    Raises UsageError when `path` exists, EnvironmentFault when it cannot be created. Errors of the disk while
    writing come out as OSError; the file then ends at the last flush, and only `abandon` makes sense.
    """

    def __init__(self, path: Path, *, config_text: str, metadata: dict[str, str]) -> None:
        self.path = path
        self.messages = 0
        self._stream = create_new(path)
        self._writer = McapWriter(self._stream, PROFILE, LIBRARY)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._sequences: dict[str, int] = {}
        self._writer.add_attachment(0, 0, CONFIG_ATTACHMENT, "application/toml", config_text.encode())
        self._writer.add_metadata(RUN_METADATA, metadata)

    def channel(self, topic: str, cdr_type: CdrType[Any], *, latched: bool = False) -> None:
        """Declare a topic, once, before its first message; `latched` topics are offered to late subscribers."""
        if topic in self._channels:
            raise ValueError(f"{topic} is already declared")
        if cdr_type.name not in self._schemas:
            text = cdr_type.schema_text.encode()
            self._schemas[cdr_type.name] = self._writer.register_schema(cdr_type.name, SCHEMA_ENCODING, text)
        metadata = {"offered_qos_profiles": LATCHED_QOS} if latched else {}
        schema_id = self._schemas[cdr_type.name]
        self._channels[topic] = self._writer.register_channel(topic, MESSAGE_ENCODING, schema_id, metadata)
        self._sequences[topic] = 0

    def write(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Append a message of a declared topic; `log_time_ns` since 1970, when it was received."""
        sequence = self._sequences[topic]
        self._writer.add_message(self._channels[topic], log_time_ns, payload, log_time_ns, sequence)
        self._sequences[topic] = sequence + 1
        self.messages += 1

    @property
    def size_bytes(self) -> int:
        """Number of bytes that have left this process; what has not been flushed is not among them."""
        return self._writer.size_bytes

    def fileno(self) -> int:
        """Return the descriptor of the file."""
        return self._stream.fileno()

    def flush(self) -> None:
        """Hand everything to the operating system: it then survives the death of this process."""
        self._writer.flush()

    def finish(self, metadata_end: dict[str, str]) -> None:
        """Close the log properly, with the facts known only at the end; idempotent."""
        if self._stream.closed:
            return
        self._writer.flush()
        self._writer.add_metadata(END_METADATA, metadata_end)
        finish_writer(self._writer, self._stream)

    def abandon(self) -> None:
        """Close the file as it is, after an error of the disk; never raises."""
        try:
            self._stream.close()
        except OSError:
            return


def create_new(path: Path) -> BinaryIO:
    """Open a file that must not exist yet. Raises UsageError when it does, EnvironmentFault when it cannot be."""
    try:
        return path.open("xb")
    except FileExistsError:
        raise UsageError("there is already a file of this name", where=str(path), do="Give another name") from None
    except OSError as error:
        raise EnvironmentFault(
            f"the log cannot be created: {error.strerror}", where=str(path), do="Check the directory and the disk"
        ) from None


def finish_writer(writer: McapWriter, stream: BinaryIO) -> None:
    """Write the summary, bring the file to the disk and close it."""
    writer.finish()
    stream.flush()
    os.fsync(stream.fileno())
    stream.close()
