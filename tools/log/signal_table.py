"""The signals of a push as one table: a row for each tick, names instead of numbers for phase, mode, contact, fault."""

from __future__ import annotations

import csv
import importlib
import math
from collections.abc import Callable, Iterator
from enum import IntEnum
from itertools import islice
from pathlib import Path
from typing import Any

from robot_io.clock import NS_PER_S
from robot_io.errors import EnvironmentFault, LogDamaged, UsageError
from robot_io.log.log_format import format_of
from robot_io.log.logged_type import LoggedType
from robot_io.log.ros_messages import WORLD_FRAME, Header, ros_time
from robot_io.log.signals import SIGNALS, Contact, Signals, fault_id_of
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, RUN_METADATA
from robot_io.mcap.read import LogSummary, read_log, read_summary
from robot_io.rig.logged import rig_of_log
from robot_io.tick import TICK_CDR, Mode, Phase
from tools.log.derivation import TICK_TOPIC
from tools.log.signals import SignalsOf

TOPIC = "/control/signals"
NUMBERS = Signals.__struct_fields__[1:-4]
COLUMNS = ("time_s", "log_time_ns", *NUMBERS, "phase", "mode", "contact", "fault")
"""`time_s` counts from the first tick; the others are the fields of push_msgs/msg/Signals."""
Row = tuple[Any, ...]


def signal_rows(path: Path) -> Iterator[Row]:
    """Yield the rows of a log; of an earlier format, which has no such topic, they are derived from its ticks.

    Raises UsageError for a log that is none of a push, LogDamaged for one that cannot be trusted.
    """
    summary = read_summary(path)
    topics = {channel.topic: channel for channel in summary.channels}
    log_format = format_of(summary.metadata.get(RUN_METADATA, {}), str(path))
    decode: Callable[[bytes, int], Signals]
    if (own := topics.get(TOPIC)) is not None:
        topic, logged = TOPIC, LoggedType(SIGNALS, own.schema_name, own.schema_text, log_format)
        decode = lambda payload, _: logged.decode(payload)  # noqa: E731
    elif TICK_TOPIC in topics and CONFIG_ATTACHMENT in summary.attachments:
        topic, decode = TICK_TOPIC, _derived(summary, topics[TICK_TOPIC].schema_text, log_format)
    else:
        raise UsageError("this is not the log of a push: it has no ticks", where=str(path), do="Leave out --signals")
    first_ns: int | None = None
    for message in read_log(path):
        if message.topic == topic:
            first_ns = message.log_time_ns if first_ns is None else first_ns
            yield _row(decode(message.payload, message.log_time_ns), message.log_time_ns, first_ns)


def write_csv(path: Path, rows: Iterator[Row]) -> int:
    """Write a new CSV file; return the number of rows. Raises OSError."""
    count = 0
    with path.open("x", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for time_s, *cells in rows:
            writer.writerow([time_s, *map(_cell, cells)])
            count += 1
    return count


def write_parquet(path: Path, rows: Iterator[Row]) -> int:
    """Write a new Parquet file, numbers as float32; return the number of rows.

    Raises EnvironmentFault without pyarrow, OSError.
    """
    try:
        arrow, parquet = importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    except ImportError:
        raise EnvironmentFault(
            "Parquet needs pyarrow, which is not installed",
            do="Install the extra: `.venv/bin/python -m pip install -e '.[parquet]'`, or write CSV",
        ) from None
    names = dict.fromkeys(COLUMNS[-4:], arrow.string())
    numbers = dict.fromkeys(NUMBERS, arrow.float32())
    types = {"time_s": arrow.float64(), "log_time_ns": arrow.int64(), **numbers, **names}
    schema = arrow.schema(list(types.items()))
    count = 0
    with path.open("xb") as file, parquet.ParquetWriter(file, schema) as writer:
        while some := list(islice(rows, 10_000)):
            cells = zip(zip(*some, strict=True), types.values(), strict=True)
            writer.write_batch(arrow.record_batch([arrow.array(column, kind) for column, kind in cells], schema=schema))
            count += len(some)
    return count


WRITERS = {"csv": write_csv, "parquet": write_parquet}


def _derived(summary: LogSummary, schema_text: str, log_format: int) -> Callable[[bytes, int], Signals]:
    ticks = LoggedType(TICK_CDR, TICK_CDR.name, schema_text, log_format)
    rig = rig_of_log(summary.attachments[CONFIG_ATTACHMENT].decode(), log_format).rig
    signals = SignalsOf(rig)

    def decode(payload: bytes, log_time_ns: int) -> Signals:
        try:
            return signals.of(ticks.decode(payload), Header(ros_time(log_time_ns), WORLD_FRAME))
        except ValueError as error:
            raise LogDamaged(f"a tick cannot be read: {error}") from None

    return decode


def _row(signals: Signals, log_time_ns: int, first_ns: int) -> Row:
    numbers = [getattr(signals, name) for name in NUMBERS]
    names = (_name(Phase, signals.phase), _name(Mode, signals.mode), _name(Contact, signals.contact))
    return ((log_time_ns - first_ns) / NS_PER_S, log_time_ns, *numbers, *names, fault_id_of(signals.fault))


def _cell(value: Any) -> Any:
    """Return the cell of a CSV: empty for NaN, seven digits of a float32."""
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.7g}"


def _name(kind: type[IntEnum], value: int) -> str:
    return kind(value).name.lower() if value in kind.__members__.values() else str(value)
