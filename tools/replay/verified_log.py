"""Read a log while verifying it: its chain of ticks, their times, the seal at its end, and the order of its parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, TypeVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.errors import LogDamaged, PushError, ReplayDiffers
from robot_io.log.chain import TickChain
from robot_io.log.log_format import format_of
from robot_io.log.logged_type import LoggedType
from robot_io.log.recovery import RECOVERED_METADATA
from robot_io.log.seal import CONFIG_FACT, LogSeal, PayloadSeal, config_seal, seal_of
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, END_METADATA, LIBRARY, RUN_METADATA
from robot_io.mcap.read import LogMessage, LogSummary, read_log, read_summary
from robot_io.rig.config import RigConfig
from robot_io.rig.logged import rig_of_log
from robot_io.tick import TICK_CDR, ControlTick
from tools.log.derivation import TICK_TOPIC
from tools.log.run_log import OFFSET_FACT
from tools.log.run_parts import BEFORE_FACT, PART_FACT
from tools.replay.code_origin import CodeOrigin, compare_code
from tools.run.facts.code_facts import code_facts

MessageT = TypeVar("MessageT", bound=msgspec.Struct)
LAST_TICK_FACT = "last_tick_crc32"
DO_DAMAGED = "Do not trust this log from there on; `push log info` shows what it contains"


class Item(NamedTuple):
    """One message; `tick` is its decoded value on `/control/tick`."""

    topic: str
    log_time_ns: int
    payload: bytes
    tick: ControlTick | None


class VerifiedLog:
    """The rig and facts of a log, available once every checksum of the file is verified, and its messages.

    Raises UsageError if it cannot be opened or is of a later format, LogDamaged if it cannot be trusted.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        summary = read_summary(path)
        if summary.library != LIBRARY and CONFIG_ATTACHMENT not in summary.attachments:
            what = f"this is not the log of a push: it contains no {CONFIG_ATTACHMENT}"
            raise LogDamaged(what, where=str(path), do="Give the run.mcap of a `push run`")
        self._end = summary.metadata.get(END_METADATA)
        self._saved = summary.metadata.get(RECOVERED_METADATA)
        self.facts = summary.metadata.get(RUN_METADATA, {})
        self.channels = summary.channels
        self.start_ns, self.end_ns = summary.start_ns, summary.end_ns
        """Log times of its first and its last message."""
        self.made_by: CodeOrigin = compare_code(self.facts, code_facts(), format_of(self.facts, str(path)))
        try:
            self.ticks = self.type_of(TICK_TOPIC, TICK_CDR)
        except LogDamaged as error:
            raise self._damaged(error.what) from None
        self.config_intact = self._is_config_intact(summary)
        """Whether config.toml is unchanged since the log was finished."""
        self.notes: tuple[str, ...] = ()
        """Config settings that have no meaning today, and parts of the log that the seal does not cover."""
        self._rig = self._read_rig(summary)
        if self._end is None and self._saved is None:
            raise self._damaged("the log has no end record")

    def usable_rig(self) -> RigConfig:
        """Return the rig. Raises LogDamaged, or ReplayDiffers if only the code that wrote the log can use its rig."""
        if isinstance(self._rig, RigConfig):
            return self._rig
        for _ in self.messages():  # report damage first
            continue
        raise ReplayDiffers(
            f"{self.made_by.cause}: its {CONFIG_ATTACHMENT} cannot be used today: {self._rig}",
            where=str(self.path),
            do="Replay it with the code that wrote it",
        )

    @property
    def end_facts(self) -> dict[str, str]:
        """What was known at the end of the log, or when it was recovered."""
        return self._end if self._end is not None else self._saved or {}

    @property
    def complete(self) -> bool:
        """Return whether the log has its end; a recovered log does not."""
        return self._end is not None

    @property
    def in_contact(self) -> bool:
        """Return whether the run started in contact."""
        return self.facts.get("in_contact") == "True"

    @property
    def wall_offset_ns(self) -> int:
        """Offset added to tick times to get log times, in ns; 0 if the log does not record it."""
        text = self.facts.get(OFFSET_FACT, "")
        return int(text) if text.removeprefix("-").isdecimal() and len(text) < 25 else 0

    def type_of(self, topic: str, today: CdrType[MessageT]) -> LoggedType[MessageT]:
        """Return how to read the log's messages of a topic as today's type. Raises LogDamaged if they cannot be."""
        for channel in self.channels:
            if channel.topic == topic:
                return LoggedType(today, channel.schema_name, channel.schema_text, self.made_by.format)
        return LoggedType(today, today.name, today.schema_text, self.made_by.format)

    def dropped(self, ring: str) -> bool:
        """Return whether records are known to be missing because a ring was full."""
        return (self._end or {}).get(f"dropped_{ring}", "0") != "0"

    def messages(self) -> Iterator[Item]:
        """Yield every message in file order. Read all before trusting any: the end may raise LogDamaged."""
        chain, seal = TickChain(), seal_of(self.end_facts, self.made_by.format)
        for channel in self.channels:
            seal.declare(channel.topic, channel.schema_name, channel.schema_text.encode())
        last = -1
        for message in read_log(self.path):
            seal.note(message.topic, message.log_time_ns, message.payload)
            tick = None
            if message.topic == TICK_TOPIC:
                tick = self._tick(message, last, chain.holds(message.payload))
                last = tick.input.tick
            yield Item(message.topic, message.log_time_ns, message.payload, tick)
        self._check_end(chain, seal, last)

    def verify(self) -> int:
        """Read every message as `messages`, but decode no tick; return the number of ticks. Raises LogDamaged."""
        chain, seal = TickChain(), seal_of(self.end_facts, self.made_by.format)
        for channel in self.channels:
            seal.declare(channel.topic, channel.schema_name, channel.schema_text.encode())
        for message in read_log(self.path):
            seal.note(message.topic, message.log_time_ns, message.payload)
            if message.topic == TICK_TOPIC and not chain.holds(message.payload):
                raise self._damaged("a tick was altered, or ticks are missing: the chain of checksums is broken")
        self._check_end(chain, seal, chain.ticks - 1)
        return chain.ticks

    def _is_config_intact(self, summary: LogSummary) -> bool:
        if self.end_facts and self.made_by.format == 1 and CONFIG_FACT not in self.end_facts:
            return True  # format 1 did not seal it, as the notes say
        return (
            self.end_facts.get(CONFIG_FACT) == config_seal(summary.attachments.get(CONFIG_ATTACHMENT, b""))[CONFIG_FACT]
        )

    def _read_rig(self, summary: LogSummary) -> RigConfig | str:
        """Return the rig, or why today's program cannot use it although the log is intact."""
        try:
            rig, notes = rig_of_log(summary.attachments[CONFIG_ATTACHMENT].decode(), self.made_by.format)
        except (KeyError, UnicodeDecodeError, RecursionError, PushError) as error:
            why = "it is missing" if isinstance(error, KeyError) else " ".join(str(error).split())
            if self.config_intact and self.made_by.other and isinstance(error, PushError):
                return why
            raise self._damaged(f"the log contains no usable {CONFIG_ATTACHMENT}: {why}") from None
        self.notes = (*self._seal_notes(), *notes)
        return rig

    def _seal_notes(self) -> list[str]:
        """Return what the seal of a log of the first format does not cover."""
        if self.made_by.format > 1 or "message_sum" in self.end_facts:
            return []
        what = "types and times of messages" if "payload_sum" in self.end_facts else "messages but ticks"
        return [f"the log's seal does not cover its config.toml, nor {what}"]

    def _tick(self, message: LogMessage, last: int, chained: bool) -> ControlTick:
        if not chained:
            named = "the first tick" if last < 0 else f"tick {last} or {last + 1}"
            raise self._damaged(f"{named} was altered, or ticks are missing there: the chain of checksums is broken")
        try:
            tick = self.ticks.decode(message.payload)
        except LogDamaged as error:
            named = "the first tick" if last < 0 else f"tick {last + 1}"
            raise self._damaged(f"{named} was altered: {error.what}") from None
        if last < 0 and not tick.before:
            raise self._damaged("the first tick was altered: it holds no state to start from")
        if self.facts.get(OFFSET_FACT) != str(message.log_time_ns - tick.input.now_ns):
            raise self._damaged(f"tick {tick.input.tick} was altered: its log time does not match its content")
        return tick

    def _check_end(self, chain: TickChain, seal: LogSeal | PayloadSeal, last: int) -> None:
        if chain.ticks == 0:
            raise LogDamaged(
                "the log contains no ticks", where=str(self.path), do="The run ended before its loop started"
            )
        wanted = self.end_facts
        if self._end is not None:
            ticks = {"ticks": str(chain.ticks), LAST_TICK_FACT: f"{chain.crc32:08x}"}
            if any(wanted.get(name) != value for name, value in ticks.items()):
                raise self._damaged(f"tick {last}, the last one, was altered or ticks are missing")
        if any(wanted.get(name) != value for name, value in seal.facts().items()):
            raise self._damaged(
                f"messages or their types were changed, lost or added after the log was finished "
                f"({seal.messages} are present, {wanted.get('messages', 'an unknown number')} were written)"
            )

    def require_config(self) -> None:
        """Raise LogDamaged if config.toml was changed."""
        if not self.config_intact:
            raise self._damaged(f"its {CONFIG_ATTACHMENT} was changed after the log was finished")

    def _damaged(self, what: str) -> LogDamaged:
        return LogDamaged(what, where=str(self.path), do=DO_DAMAGED)


def in_order(logs: Sequence[VerifiedLog]) -> None:
    """Raise LogDamaged unless each part names the last tick of the one before it."""
    for before, part in pairwise(logs):
        numbers = before.facts.get(PART_FACT, "?"), part.facts.get(PART_FACT, "?")
        follows = numbers[0].isdecimal() and numbers[1] == str(int(numbers[0]) + 1)
        # A part that was recovered has lost its end, and does not know which tick was the last.
        if follows and before.complete:
            follows = part.facts.get(BEFORE_FACT) == before.end_facts.get(LAST_TICK_FACT)
        if not follows:
            what = f"it does not go on where {before.path.name} ends"
            raise LogDamaged(what, where=str(part.path), do="Replay each part by itself")
