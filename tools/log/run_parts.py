"""The log of one run in one file, or in parts of which each is a whole log by itself, one beginning where one ends."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from robot_io.clock import NS_PER_S
from robot_io.errors import PushError
from robot_io.log.channels import Kind
from robot_io.mcap.files import part_path
from robot_io.messages import Pose2D
from robot_io.rig.config import rig_from_toml
from robot_io.tick import ControlTick
from tools.log.heard import Heard
from tools.log.run_log import RunLog
from tools.log.stamp_ages import Latency

PART_FACT, SINCE_FACT, BEFORE_FACT = "part", "part_since_ns", "part_before_crc32"
"""The number of a part, when it began (CLOCK_MONOTONIC), and the CRC-32 of the last tick of the part before."""


class RunParts:
    """As `RunLog`, in as many files as the rig's `[log]` asks for; `log` names the whole.

    A part ends only between two calls of `cut`, or behind a tick of `tick`: what a tick holds of other records is then
    in the same part, or in the one before. Raises as `RunLog`.
    """

    def __init__(
        self,
        log: Path,
        *,
        config_text: str,
        metadata: dict[str, str],
        wall_offset_ns: int,
        also: Callable[[str, int, bytes], None] | None = None,
        derive: bool = True,
    ) -> None:
        self._log = log
        self._config_text, self._metadata, self._also, self._derive = config_text, metadata, also, derive
        self._wall_offset_ns = wall_offset_ns
        self._settings = rig_from_toml(config_text).log
        self._heard = Heard()
        self._messages = self._ticks = self._undecodable = 0
        self._number = 1
        self._since_ns: int | None = None
        self._part = self._begin({PART_FACT: "1"} if self._settings.in_parts else {})

    @property
    def messages(self) -> int:
        """Number of messages written, including derived ones."""
        return self._messages + self._part.messages

    @property
    def ticks(self) -> int:
        """Number of ticks written."""
        return self._ticks + self._part.chain.ticks

    @property
    def undecodable(self) -> int:
        """Number of records that could not be decoded."""
        return self._undecodable + self._part.undecodable

    @property
    def object_poses(self) -> tuple[Pose2D, Pose2D] | None:
        """The first and the last pose of the object, WORLD frame; None if no valid one was written."""
        return self._heard.object_poses

    @property
    def latencies(self) -> dict[str, Latency]:
        """How old the messages of the base and the motion capture were when they arrived, by topic."""
        return self._heard.latencies

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        """Write one ring record and the messages derived from it. Raises OSError when writing to disk fails."""
        self._part.record(kind, time_ns, payload)

    def tick(self, time_ns: int, payload: bytes, tick: ControlTick | None) -> None:
        """Write one tick of a run in lockstep, in which all that it holds has been written before. As `record`."""
        self._part.tick(time_ns, payload, tick)
        self.cut(time_ns)

    def cut(self, now_ns: int) -> None:
        """Begin the next part where it is due; all records that were made so far are written. Raises OSError."""
        if self._since_ns is None:
            self._since_ns = now_ns
        if not self._settings.in_parts or not self._part.chain.ticks or not self._is_due(now_ns - self._since_ns):
            return
        part = self._part
        part.finish({})
        self._messages += part.messages
        self._ticks += part.chain.ticks
        self._undecodable += part.undecodable
        self._number += 1
        self._since_ns = now_ns
        before = f"{part.chain.crc32:08x}"
        facts = {PART_FACT: str(self._number), SINCE_FACT: str(now_ns), BEFORE_FACT: before}
        try:
            self._part = self._begin(facts, part)
        except PushError as error:  # the disk is full, say: as for any other byte that cannot be written
            raise OSError(0, error.what) from None
        if self._heard.clock is not None:
            self._part.record(Kind.BASE_CLOCK, now_ns, self._heard.clock)

    def flush(self) -> None:
        """Flush everything to the operating system."""
        self._part.flush()

    def fileno(self) -> int:
        """Return the descriptor of the file that is being written."""
        return self._part.fileno()

    def finish(self, facts: dict[str, str]) -> None:
        """Close the log, adding the facts known only at its end; idempotent."""
        self._part.finish(facts)

    def abandon(self) -> None:
        """Close the file unfinished, after a disk error; never raises."""
        self._part.abandon()

    def _is_due(self, for_ns: int) -> bool:
        minutes, megabytes = self._settings.split_minutes, self._settings.split_MB
        by_time = minutes > 0 and for_ns >= minutes * 60 * NS_PER_S
        return by_time or (megabytes > 0 and self._part.size_bytes >= megabytes * 1e6)

    def _begin(self, facts: dict[str, str], before: RunLog | None = None) -> RunLog:
        return RunLog(
            part_path(self._log, self._number) if self._settings.in_parts else self._log,
            config_text=self._config_text,
            metadata=self._metadata | facts,
            wall_offset_ns=self._wall_offset_ns,
            also=self._also,
            derive=self._derive,
            heard=self._heard,
            newest=before.newest if before is not None else None,
        )
