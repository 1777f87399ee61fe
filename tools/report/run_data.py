"""Read a log once into plain numbers for figures and tables, in bounded memory however long the log is."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Message, Metadata

from robot_io.cdr.cdr_type import CdrType
from robot_io.clock import NS_PER_S
from robot_io.errors import LogDamaged, PushError
from robot_io.geometry import StraightPath, yaw_from_quaternion
from robot_io.log.log_format import format_of
from robot_io.log.logged_type import LoggedType
from robot_io.log.messages import LOOP_TIMING, SAFETY_EVENT, SafetyEvent
from robot_io.log.ros_messages import POSE_STAMPED
from robot_io.log.signals import SIGNALS
from robot_io.log.world_messages import STATE_CDR
from robot_io.mcap.files import files_of
from robot_io.mcap.log_file import RUN_METADATA
from robot_io.mcap.walk import Grown, Topic, walk
from robot_io.rig.config import RigConfig
from robot_io.rig.logged import rig_of_log
from robot_io.tick import TICK_CDR, ControlTick
from tools.report.bounded_series import Floats, Series, Span, Spans, Tally
from tools.report.tick_row import TICK_COLUMNS, tick_row

MOST_SKIPS = 5000
SLIDER_COLUMNS = ("t_s", "x_m", "y_m", "yaw_rad")
READ: dict[str, CdrType[Any]] = {
    "/control/tick": TICK_CDR,
    "/control/signals": SIGNALS,
    "/loop/timing": LOOP_TIMING,
    "/safety/event": SAFETY_EVENT,
    "/world/state": STATE_CDR,
    "/slider/pose": POSE_STAMPED,
}
"""The topics that are read, and the types of their messages; all others are skipped."""


@dataclass
class RunData:
    """What the report needs from a log. Times in s since the first tick (or message, if there are no ticks)."""

    log: Path
    rig: RigConfig
    facts: dict[str, str]
    recovered: str
    """What was wrong with the log before `push log recover`; "" for an original log."""
    ticks: dict[str, Floats]
    tick_stride: int
    """One in this many ticks was kept."""
    slider: dict[str, Floats]
    slider_source: str
    """ "world" (truth), "motion capture", or "" if the object's pose is unknown."""
    late: Tally
    skipped: int
    skips: list[tuple[float, int]]
    ages: dict[str, Tally]
    """Age of each device's newest data at each kept tick: ft, arm, base."""
    faults: list[Span]
    modes: list[Span]
    first: ControlTick | None
    last: ControlTick | None
    tick_count: int
    messages: int
    duration_s: float
    config_text: str = ""
    world_end_s: float | None = None
    """When the emulated or simulated world last spoke; None where there is none."""
    run_facts: dict[str, str] = field(default_factory=dict)
    """The `facts` known at the start of the run: together with the config they identify it."""


def read_run(path: Path, *, grown: Grown | None = None) -> RunData:
    """Read a log to its end. Raises UsageError (no such file) and LogDamaged (cannot be trusted, or not a run's log).

    `grown`: see `walk`, for a log that is still being written.
    """
    reader = _Reader(path)
    topics: dict[int, str] = {}
    files = files_of(path)
    for item in walk(path, grown=grown) if grown is not None else chain.from_iterable(map(walk, files)):
        if isinstance(item, Message):
            reader.message(topics[item.channel_id], item.log_time, item.data)
        elif isinstance(item, Topic):
            topics[item.channel.id] = item.channel.topic
            reader.channel(item.channel.topic, item.schema.name, item.schema.data)
        elif isinstance(item, Attachment) and item.name == "config.toml":
            reader.config(item.data)
        elif isinstance(item, Metadata):
            reader.metadata[item.name] = dict(item.metadata)
    return reader.finish()


class _Reader:
    """Collects the records of one log, given in file order."""

    def __init__(self, path: Path) -> None:
        self.metadata: dict[str, dict[str, str]] = {}
        self._path = path
        self._text = ""
        self._config: bytes | None = None
        self._rig: RigConfig | None = None
        self._types: dict[str, LoggedType[Any]] = {}
        self._ticks = Series(TICK_COLUMNS)
        self._world = Series(SLIDER_COLUMNS)
        self._world_end_s: float | None = None
        self._seen = Series(SLIDER_COLUMNS)
        self._late = Tally()
        self._late_in_signals = False
        self._skipped = 0
        self._skips: list[tuple[float, int]] = []
        self._ages = {"ft": Tally(), "arm": Tally(), "base": Tally()}
        self._last_reading_ns = 0
        self._faults = Spans()
        self._modes = Spans()
        self._first: ControlTick | None = None
        self._last_payload = b""
        self._count = 0
        self._messages = 0
        self._reference_ns = 0
        self._first_tick_s = 0.0
        self._end_s = 0.0

    def config(self, data: bytes) -> None:
        """Take the rig of the run; decoded with the first tick, because its format is in the metadata."""
        self._config = data

    def channel(self, topic: str, schema_name: str, schema: bytes) -> None:
        """Take the declaration of a topic."""
        if topic not in READ:
            return
        text = schema.decode(errors="replace")
        log_format = self._format()
        self._late_in_signals = log_format >= 5  # the topic of the timing holds one tick a second since then
        try:
            self._types[topic] = LoggedType(READ[topic], schema_name, text, log_format)
        except LogDamaged as error:
            raise self._foreign(f"its {topic}: {error.what}") from None

    def message(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take one message."""
        if not self._messages:
            self._reference_ns = log_time_ns
        self._messages += 1
        time_s = (log_time_ns - self._reference_ns) / NS_PER_S
        self._end_s = max(self._end_s, time_s)
        if topic == "/control/tick":
            self._tick(time_s, payload)
        elif topic == "/loop/timing":
            timing = self._types[topic].decode(payload)
            if not self._late_in_signals:
                self._late.add(timing.late_ns * 1e-6)
            self._skipped += timing.skipped
            if timing.skipped and len(self._skips) < MOST_SKIPS:
                self._skips.append((time_s, timing.skipped))
        elif topic == "/control/signals" and self._late_in_signals:
            self._late.add(self._types[topic].decode(payload).wake_late_us * 1e-3)
        elif topic == "/safety/event":
            self._event(time_s, self._types[topic].decode(payload))
        elif topic == "/world/state":
            self._world_end_s = time_s
            if self._world.wants():
                slider = self._types[topic].decode(payload).slider
                self._world.add((time_s, slider.x, slider.y, slider.yaw))
        # A simulated run's /slider/pose is derived from the world's state, so the world takes precedence.
        elif topic == "/slider/pose" and not len(self._world) and self._seen.wants():
            pose = self._types[topic].decode(payload).pose
            turned = pose.orientation
            yaw = yaw_from_quaternion(turned.x, turned.y, turned.z, turned.w)
            at = pose.position
            self._seen.add((time_s, at.x, at.y, math.nan if yaw is None else yaw))

    def finish(self) -> RunData:
        """Return the collected data."""
        rig = self._read_rig("it contains no config.toml")
        last = self._types["/control/tick"].decode(self._last_payload) if self._last_payload else None
        recovered = self.metadata.get("recovered")
        ticks, world, seen = self._ticks.arrays(), self._world.arrays(), self._seen.arrays()
        for table in (ticks, world, seen):
            table["t_s"] -= self._first_tick_s
        source = "world" if len(self._world) else "motion capture" if len(self._seen) else ""
        return RunData(
            log=self._path,
            rig=rig,
            facts={key: value for record in self.metadata.values() for key, value in record.items()},
            recovered=(recovered.get("cause", "") or "truncated") if recovered is not None else "",
            ticks=ticks,
            tick_stride=self._ticks.stride,
            slider=world if source == "world" else seen,
            slider_source=source,
            late=self._late,
            skipped=self._skipped,
            skips=[(time_s - self._first_tick_s, count) for time_s, count in self._skips],
            ages=self._ages,
            faults=self._faults.finish(self._end_s, self._first_tick_s),
            modes=self._modes.finish(self._end_s, self._first_tick_s),
            first=self._first,
            last=last,
            tick_count=self._count,
            messages=self._messages,
            duration_s=self._end_s - self._first_tick_s,
            config_text=self._text,
            world_end_s=None if self._world_end_s is None else self._world_end_s - self._first_tick_s,
            run_facts=self.metadata.get(RUN_METADATA, {}),
        )

    def _tick(self, time_s: float, payload: bytes) -> None:
        if self._rig is None:
            self._read_rig("it contains no config.toml before its first tick")
        self._count += 1
        self._last_payload = payload
        if not self._ticks.wants():
            return
        tick = self._types["/control/tick"].decode(payload)
        if self._first is None:
            self._first = tick
            self._first_tick_s = time_s
            self._modes.begin("", str(tick.after.safety.mode), "", time_s)
        self._ticks.add(tick_row(tick, self._path_frame, time_s))
        if tick.input.ft.readings:
            self._last_reading_ns = tick.input.ft.readings[-1].received_ns
        now_ns = tick.input.now_ns
        for device, at_ns in (
            ("ft", self._last_reading_ns),
            ("arm", tick.input.arm.changed_ns),
            ("base", tick.input.base.pose_received_ns),
        ):
            if at_ns:
                self._ages[device].add((now_ns - at_ns) * 1e-6)

    def _event(self, time_s: float, event: SafetyEvent) -> None:
        if event.kind == "mode":
            self._modes.begin("", str(event.mode_after), "", time_s)
        elif event.kind == "fault":
            self._faults.begin(event.fault, event.fault, event.text, time_s)
        else:
            self._faults.end(event.fault, time_s)

    def _format(self) -> int:
        return format_of(self.metadata.get(RUN_METADATA, {}), str(self._path))

    def _read_rig(self, missing: str) -> RigConfig:
        if self._config is None:
            raise self._foreign(missing)
        log_format = self._format()
        try:
            self._text = self._config.decode()
            self._rig = rig_of_log(self._text, log_format).rig
        except (UnicodeDecodeError, PushError) as error:
            raise self._foreign(f"its config.toml cannot be used: {error}") from None
        self._path_frame = StraightPath.of(self._rig.path.origin_m, self._rig.path.direction_deg)
        return self._rig

    def _foreign(self, what: str) -> LogDamaged:
        return LogDamaged(
            f"this is not the log of a push: {what}", where=str(self._path), do="Give the run.mcap of a `push run`"
        )
