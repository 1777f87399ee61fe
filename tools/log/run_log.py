"""The log of one run as the recorder and level `sim` write it: ring records in, topics out.

Each control tick is added to the checksum chain and written, followed by the topics people plot, derived from it;
every other kind is written unchanged. Topics are declared on first use.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec.structs import replace

from robot_io.clock import NS_PER_S
from robot_io.errors import LogDamaged
from robot_io.log.chain import TickChain
from robot_io.log.channels import BY_TOPIC, CHANNELS, Kind
from robot_io.log.seal import LogSeal, config_seal
from robot_io.log.world_messages import STATE_CDR
from robot_io.mcap.log_file import McapLog
from robot_io.rig.config import rig_from_toml
from robot_io.tick import TICK_CDR, ControlTick, shortened
from tools.log.derivation import SLIDER_TOPIC, TICK_TOPIC, Derivation
from tools.log.heard import STAMPED, Heard
from tools.log.thinned_topics import holds_world_state
from tools.log.tick_topics import Message

OFFSET_FACT = "wall_offset_ns"
DERIVED_FACT, NOT_DERIVED = "derived_topics", "left out"
STATE_EVERY_NS = 10 * NS_PER_S
"""At least so often a tick holds the state before it, from which replay can start."""


class RunLog:
    """One file of a run's log.

    config_text: the resolved rig. wall_offset_ns: added to each record's time to get its log time; stored in
    `metadata`. also: called with topic, log time and payload of each message that was written. derive: whether the
    topics made of others are written, too; what is left out can be derived again. heard: what was learned in the files
    before. newest: the last tick in them. Raises as `McapLog` and `rig_from_toml`; OSError when writing to disk fails.
    """

    def __init__(
        self,
        path: Path,
        *,
        config_text: str,
        metadata: dict[str, str],
        wall_offset_ns: int,
        also: Callable[[str, int, bytes], None] | None = None,
        derive: bool = True,
        heard: Heard | None = None,
        newest: ControlTick | None = None,
    ) -> None:
        self._also = also
        self._derives = derive
        if not derive:
            metadata = metadata | {DERIVED_FACT: NOT_DERIVED}
        rig = rig_from_toml(config_text)
        self._derive = Derivation(rig, wall_offset_ns)
        self._rig = rig
        self._offset_ns = wall_offset_ns
        self._log = McapLog(path, config_text=config_text, metadata={**metadata, OFFSET_FACT: str(wall_offset_ns)})
        self._config_seal = config_seal(config_text.encode())
        self._declared: set[str] = set()
        self._scene_written = False
        self._heard = heard or Heard()
        self.newest = newest
        self._state_kept_ns: int | None = None
        self._seal = LogSeal()
        self.chain = TickChain()
        self.undecodable = 0
        self.unknown_kinds = 0

    @property
    def messages(self) -> int:
        """Number of messages written, including derived ones."""
        return self._log.messages

    @property
    def size_bytes(self) -> int:
        """Number of bytes written to the file so far."""
        return self._log.size_bytes

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        """Write one ring record and the messages derived from it. Raises OSError when writing to disk fails."""
        if kind == Kind.CONTROL_TICK:
            try:
                tick = TICK_CDR.decode(payload)
            except LogDamaged:
                tick = None
            self.tick(time_ns, payload, tick)
        elif kind == Kind.WORLD_STATE and not holds_world_state(self._rig, time_ns):
            return
        elif kind in CHANNELS:
            log_time_ns = time_ns + self._offset_ns
            self._write(Message(CHANNELS[kind].topic, log_time_ns, payload))
            if kind in STAMPED:
                self._heard.stamped(kind, payload, log_time_ns)
            elif kind == Kind.BASE_CLOCK:
                self._note_clock(payload)
            if self._derives and kind in (Kind.WORLD_STATE, Kind.SLIDER_POSE):
                self._slider(kind, log_time_ns, payload)
        else:
            self.unknown_kinds += 1

    def tick(self, time_ns: int, payload: bytes, tick: ControlTick | None) -> None:
        """Chain and write one tick; `tick` is the decoded `payload` (None if it cannot be decoded)."""
        if tick is not None:
            written = self._with_state(tick)
            payload = TICK_CDR.encode(written if written.output.finished else shortened(written))
            self.newest, tick = tick, written
        self._write(Message(TICK_TOPIC, time_ns + self._offset_ns, self.chain.link(payload)))
        if tick is None:
            self.undecodable += 1
            return
        if self._derives:
            for derived in self._derive.tick(tick):
                self._write(derived)

    def flush(self) -> None:
        """Flush everything to the operating system."""
        self._log.flush()

    def fileno(self) -> int:
        """Return the descriptor of the file."""
        return self._log.fileno()

    def finish(self, facts: dict[str, str]) -> None:
        """Close the log, adding the facts known only at its end; idempotent."""
        own = {
            **self._seal.facts(),
            **self._config_seal,
            "ticks": str(self.chain.ticks),
            "last_tick_crc32": f"{self.chain.crc32:08x}",
            "undecodable": str(self.undecodable),
            "unknown_kinds": str(self.unknown_kinds),
            **{f"latency {topic}": latency.in_words() for topic, latency in self._heard.latencies.items()},
        }
        self._log.finish({**own, **facts})

    def abandon(self) -> None:
        """Close the file unfinished, after a disk error; never raises."""
        self._log.abandon()

    def _write(self, message: Message) -> None:
        if self._derives and not self._scene_written:
            self._scene_written = True  # not earlier: the first record's time is the start of the log
            for first in self._derive.scene(message.log_time_ns):
                self._write(first)
        if message.topic not in self._declared:
            self._declared.add(message.topic)
            channel = BY_TOPIC[message.topic]
            self._log.channel(channel.topic, channel.cdr_type, latched=channel.latched)
            self._seal.declare(channel.topic, channel.cdr_type.name, channel.cdr_type.schema_text.encode())
        if message.topic == SLIDER_TOPIC:
            self._heard.object_at(message.payload)
        self._seal.note(message.topic, message.log_time_ns, message.payload)
        self._log.write(message.topic, message.log_time_ns, message.payload)
        if self._also is not None:
            self._also(message.topic, message.log_time_ns, message.payload)

    def _with_state(self, tick: ControlTick) -> ControlTick:
        """Return a tick with the state before it where this file holds none that is younger than 10 s."""
        now_ns, kept_ns, last = tick.input.now_ns, self._state_kept_ns, self.newest
        if not tick.before:
            if kept_ns is not None and now_ns - kept_ns < STATE_EVERY_NS:
                return tick
            if last is None or tick.input.tick != last.input.tick + 1 + tick.input.host.skipped:
                return tick  # the state before it is not that of the tick before
            tick = replace(tick, before=(last.after,))
        self._state_kept_ns = now_ns
        return tick

    def _note_clock(self, payload: bytes) -> None:
        try:
            self._heard.clock_of_base(payload)
        except LogDamaged:
            self.undecodable += 1

    def _slider(self, kind: int, log_time_ns: int, payload: bytes) -> None:
        try:
            if kind == Kind.WORLD_STATE:
                derived = self._derive.world(STATE_CDR.decode(payload), log_time_ns)
            else:
                derived = self._derive.slider(payload, log_time_ns)
        except LogDamaged:
            self.undecodable += 1
            return
        for message in derived:
            self._write(message)
