"""A log that is checked while it is read: its chain of ticks, their times, and the seal at its end."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from robot_io.errors import LogDamaged, PushError
from robot_io.log.chain import TickChain
from robot_io.log.mcap_log import CONFIG_ATTACHMENT, END_METADATA, RUN_METADATA
from robot_io.log.mcap_read import LogMessage, read_log, read_summary
from robot_io.log.mcap_recover import RECOVERED_METADATA
from robot_io.log.seal import CONFIG_FACT, LogSeal, config_seal
from robot_io.rig.config import RigConfig, rig_from_toml
from robot_io.tick import TICK_CDR, ControlTick
from tools.log.run_log import OFFSET_FACT

TICK_TOPIC = "/control/tick"
DO_DAMAGED = "Do not trust this log from there on; `push log info` shows what it holds"


class Item(NamedTuple):
    """One message; `tick` is the decoded one of `/control/tick`."""

    topic: str
    payload: bytes
    tick: ControlTick | None


class VerifiedLog:
    """The rig and facts of a log, after every checksum of the file was verified, and then its messages.

    Raises UsageError when it cannot be opened, LogDamaged when it cannot be trusted.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        summary = read_summary(path)
        self._end = summary.metadata.get(END_METADATA)
        self._saved = summary.metadata.get(RECOVERED_METADATA)
        self.facts = summary.metadata.get(RUN_METADATA, {})
        try:
            self.rig: RigConfig = rig_from_toml(summary.attachments[CONFIG_ATTACHMENT].decode())
        except (KeyError, UnicodeDecodeError, RecursionError, PushError) as error:
            why = "it is missing" if isinstance(error, KeyError) else str(error).splitlines()[0]
            raise self._damaged(f"the log holds no usable {CONFIG_ATTACHMENT}: {why}") from None
        end = self._end if self._end is not None else self._saved
        if end is None:
            raise self._damaged("the log does not say how it ends")
        seal = config_seal(summary.attachments[CONFIG_ATTACHMENT])
        self.config_holds = end.get(CONFIG_FACT) == seal[CONFIG_FACT]
        """Whether config.toml is the one that the log was finished with."""
        self._channels = summary.channels

    @property
    def complete(self) -> bool:
        """Whether the end is there; what was recovered of a truncated log has none."""
        return self._end is not None

    @property
    def in_contact(self) -> bool:
        """Whether the run started in contact."""
        return self.facts.get("in_contact") == "True"

    def dropped(self, ring: str) -> bool:
        """Tell whether records of a ring are known to be missing, because it was full."""
        return (self._end or {}).get(f"dropped_{ring}", "0") != "0"

    def messages(self) -> Iterator[Item]:
        """Yield every message in the order of the file. Take all before trusting any: the end may raise LogDamaged."""
        chain, seal = TickChain(), LogSeal()
        for channel in self._channels:
            seal.declare(channel.topic, channel.schema_name, channel.schema_text.encode())
        last = -1
        for message in read_log(self.path):
            seal.note(message.topic, message.log_time_ns, message.payload)
            tick = None
            if message.topic == TICK_TOPIC:
                tick = self._tick(message, last, chain.holds(message.payload))
                last = tick.input.tick
            yield Item(message.topic, message.payload, tick)
        self._check_end(chain, seal, last)

    def _tick(self, message: LogMessage, last: int, chained: bool) -> ControlTick:
        if not chained:
            named = "the first tick" if last < 0 else f"tick {last} or {last + 1}"
            raise self._damaged(f"{named} was altered, or ticks are missing there: the chain of checksums breaks")
        try:
            tick = TICK_CDR.decode(message.payload)
        except LogDamaged as error:
            named = "the first tick" if last < 0 else f"tick {last + 1}"
            raise self._damaged(f"{named} was altered: {error.what}") from None
        if self.facts.get(OFFSET_FACT) != str(message.log_time_ns - tick.input.now_ns):
            raise self._damaged(f"tick {tick.input.tick} was altered: its time in the log is not its own")
        return tick

    def _check_end(self, chain: TickChain, seal: LogSeal, last: int) -> None:
        if chain.ticks == 0:
            raise LogDamaged("the log holds no tick", where=str(self.path), do="The run ended before its loop began")
        wanted = self._end if self._end is not None else self._saved or {}
        if self._end is not None:
            ticks = {"ticks": str(chain.ticks), "last_tick_crc32": f"{chain.crc32:08x}"}
            if any(wanted.get(name) != value for name, value in ticks.items()):
                raise self._damaged(f"tick {last}, the last one, was altered or ticks are missing")
        if any(wanted.get(name) != value for name, value in seal.facts().items()):
            raise self._damaged(
                f"messages or their types were changed, lost or added after it was finished "
                f"({seal.messages} are there, {wanted.get('messages', 'an unknown number')} were written)"
            )

    def require_config(self) -> None:
        """Raise LogDamaged unless `config_holds`."""
        if not self.config_holds:
            raise self._damaged(f"its {CONFIG_ATTACHMENT} was changed after it was finished")

    def _damaged(self, what: str) -> LogDamaged:
        return LogDamaged(what, where=str(self.path), do=DO_DAMAGED)
