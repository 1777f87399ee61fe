"""Logs as another version of the program would have written them: with message types that differ from today's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.schema import type_from_schema
from robot_io.cdr.shape import Many, Nested, Shape
from robot_io.log.channels import CHANNELS, Channel, Kind
from robot_io.mcap.read import read_log, read_summary
from robot_io.tick import TICK_CDR, ControlTick
from tests.replay.runs import as_logged
from tools.log import run_log
from tools.log.derivation import Derivation
from tools.log.run_log import RunLog

EditText = Callable[[str], str]


def without(*fields: str) -> EditText:
    """Return an edit of a schema's text that takes out lines like "int64 child_pid"."""

    def edit(text: str) -> str:
        for field in fields:
            assert text.count(f"\n{field}\n") == 1, field
            text = text.replace(f"\n{field}\n", "\n")
        return text

    return edit


def instead(old: str, new: str) -> EditText:
    """Return an edit of a schema's text that puts one line, or several, in the place of one."""

    def edit(text: str) -> str:
        assert text.count(f"\n{old}\n") == 1, old
        return text.replace(f"\n{old}\n", f"\n{new}\n")

    return edit


def older_type(today: CdrType[Any], edit: EditText) -> CdrType[Any]:
    """Return the type as it was."""
    return type_from_schema(today.name, edit(today.schema_text))


def as_older(shape: Shape, value: Any, more: Mapping[str, Any]) -> Any:
    """Return a message of today as one of an older type; `more` are the values of fields that are not there today."""
    match shape:
        case Nested(struct_type, _, fields):
            names = {name.lower(): name for name in value.__struct_fields__}
            values = [
                more[name] if name in more else as_older(inner, getattr(value, names[name]), more)
                for name, inner in fields
            ]
            return struct_type(*values)
        case Many(element, _) if not isinstance(value, bytes):
            return tuple(as_older(element, item, more) for item in value)
    return value


def write_older(
    path: Path,
    config: str,
    ticks: list[ControlTick],
    edit: EditText,
    monkeypatch: Any,
    *,
    facts: dict[str, str],
    more: Mapping[str, Any],
) -> Path:
    """Write ticks as a log in which `/control/tick` is of an older type."""
    older = older_type(TICK_CDR, edit)
    with monkeypatch.context() as patch:
        patch.setitem(run_log.BY_TOPIC, "/control/tick", Channel("/control/tick", older))
        patch.setattr(run_log, "Derivation", partial(Derivation, log_format=int(facts["format"])))
        patch.setattr(run_log, "shortened", lambda tick: tick)
        patch.setattr(run_log.TICK_CDR, "encode", lambda tick: older.encode(as_older(older.shape, tick, more)))
        log = RunLog(path, config_text=config, metadata=facts, wall_offset_ns=10**18)
        for tick in as_logged(ticks):
            log.tick(tick.input.now_ns, b"", tick)
        log.finish({})
    return path


def derived_as(path: Path, out: Path, log_format: int, monkeypatch: Any) -> Path:
    """Write a log of today with the topics that one of an earlier format derived; its own records are as they are."""
    summary = read_summary(path)
    facts = {**summary.metadata["run"], "format": str(log_format)}
    offset_ns = int(facts["wall_offset_ns"])
    kinds = {channel.topic: kind for kind, channel in CHANNELS.items() if kind not in (Kind.SAFETY_EVENT, Kind.ROSOUT)}
    with monkeypatch.context() as patch:
        patch.setattr(run_log, "Derivation", partial(Derivation, log_format=log_format))
        config = summary.attachments["config.toml"].decode()
        log = RunLog(out, config_text=config, metadata=facts, wall_offset_ns=offset_ns)
        for message in read_log(path):
            if message.topic in kinds:
                log.record(kinds[message.topic], message.log_time_ns - offset_ns, message.payload)
        log.finish({})
    return out
