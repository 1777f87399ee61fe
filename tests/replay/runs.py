"""Runs of `push` for the tests of replay, and logs rewritten as a stranger would: with right checksums everywhere."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from msgspec.structs import replace

from robot_io.log.seal import LogSeal
from robot_io.mcap.read import read_summary
from robot_io.rig.config import rig_from_toml
from robot_io.tick import TICK_CDR, ControlTick
from tests.forked_push import forked
from tools.cli import main
from tools.run.tick_core import TickCore

ROOT = Path(__file__).resolve().parents[2]
PUSH = "import sys; from tools.cli import main; sys.exit(main(sys.argv[1:]))"

Messages = list[tuple[str, Message]]
Edit = Callable[[Messages], Messages]


def push(*argv: object, state: Path, cwd: Path = ROOT, **env: str) -> subprocess.CompletedProcess[str]:
    """Run `push` in a process of its own, with its own state folder; with `env`, in one that starts with that."""
    if not env:
        ended = forked(state, *map(str, argv), cwd=cwd)
        return subprocess.CompletedProcess(argv, ended.code, ended.out, ended.err)
    environment = os.environ | {"XDG_STATE_HOME": str(state), "PYTHONPATH": str(ROOT), **env}
    words = [sys.executable, "-c", PUSH, *map(str, argv)]
    return subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, timeout=80, check=False)


def replayed(capsys, *argv: object) -> tuple[int, dict[str, Any]]:
    """Run `push replay ... --json` here; return exit code and object."""
    capsys.readouterr()
    code = main(["replay", *map(str, argv), "--json"])
    return code, json.loads(capsys.readouterr().out.splitlines()[-1])


def rewritten(
    path: Path,
    out: Path,
    edit: Edit = lambda messages: messages,
    *,
    config: Callable[[str], str] = lambda text: text,
    metadata: Callable[[str, dict[str, str]], dict[str, str] | None] = lambda name, values: values,
    schema: Callable[[str], str] = lambda text: text,
    data_crc: bool = True,
) -> Path:
    """Write the log again with the `mcap` library alone: messages edited, checksums of the file right.

    data_crc: whether its data as a whole get one too; the library's default is not.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    messages: Messages = []
    notes: list[Metadata] = []
    attachments: list[Attachment] = []
    with path.open("rb") as file:
        for record in StreamReader(file).records:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                messages.append((channels[record.channel_id].topic, record))
            elif isinstance(record, Metadata):
                notes.append(record)
            elif isinstance(record, Attachment):
                attachments.append(record)
    with out.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, enable_crcs=True, enable_data_crcs=data_crc)
        writer.start("ros2", "another-tool")
        new_schema = {
            n: writer.register_schema(s.name, s.encoding, schema(s.data.decode()).encode()) for n, s in schemas.items()
        }
        new_channel = {
            n: writer.register_channel(c.topic, c.message_encoding, new_schema[c.schema_id], c.metadata)
            for n, c in channels.items()
        }
        for _, m in edit(messages):
            writer.add_message(new_channel[m.channel_id], m.log_time, m.data, m.publish_time, m.sequence)
        for one in attachments:  # behind the messages, as the library's own tools put them
            text = config(one.data.decode())
            writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, text.encode())
        for note in notes:
            values = metadata(note.name, note.metadata)
            if values is not None:
                writer.add_metadata(note.name, values)
        writer.finish()
    return out


def resealed(path: Path, out: Path, edit: Edit, **more: Any) -> Path:
    """Write the log again as a forger who mends the seal as well; `more` as for `rewritten`."""
    kept: Messages = []
    channels = read_summary(path).channels
    schema: Callable[[str], str] = more.get("schema", lambda text: text)

    def keep(messages: Messages) -> Messages:
        kept.extend(edit(messages))
        return kept

    def mend(name: str, values: dict[str, str]) -> dict[str, str]:
        seal = LogSeal()
        for channel in channels:
            seal.declare(channel.topic, channel.schema_name, schema(channel.schema_text).encode())
        for topic, message in kept:
            seal.note(topic, message.log_time, message.data)
        return {**values, **seal.facts()} if name == "run_end" else values

    return rewritten(path, out, keep, metadata=mend, **more)


def with_data(message: Message, data: bytes) -> Message:
    """Return the message with other bytes in it."""
    return Message(message.channel_id, message.log_time, data, message.publish_time, message.sequence)


def places(messages: Messages, topic: str) -> list[int]:
    """Return where the messages of a topic are."""
    return [i for i, (name, _) in enumerate(messages) if name == topic]


def changed(topic: str, index: int, change: Callable[[bytes], bytes]) -> Edit:
    """Return an edit that changes the payload of one message of a topic."""

    def edit(messages: Messages) -> Messages:
        at = places(messages, topic)[index]
        name, message = messages[at]
        data = change(message.data)
        assert data != message.data
        return [*messages[:at], (name, with_data(message, data)), *messages[at + 1 :]]

    return edit


def with_input(tick: ControlTick, **parts: Any) -> ControlTick:
    """Return the tick with other parts of its input."""
    return replace(tick, input=replace(tick.input, **parts))


def ticks_in(path: Path) -> list[ControlTick]:
    """Return the ticks of a log, each with the whole state before and after it, so that a log may begin with any."""
    found: list[ControlTick] = []

    def look(messages: Messages) -> Messages:
        found.extend(TICK_CDR.decode(m.data) for topic, m in messages if topic == "/control/tick")
        return []

    rewritten(path, Path(os.devnull), look)
    facts = read_summary(path)
    core = TickCore.of(rig_from_toml(facts.attachments["config.toml"].decode()))
    for i, tick in enumerate(found):
        before = tick.before or (found[i - 1].after,)
        after, _ = core.fold(before[0], tick.input)
        found[i] = replace(tick, reserved=0, before=before, after=after)
    return found


def as_logged(ticks: list[ControlTick]) -> list[ControlTick]:
    """Return the ticks with the state before only where a log holds it: where it is not the end of the one before."""
    follow = [False, *(not tick.before or tick.before[0] is last.after for last, tick in itertools.pairwise(ticks))]
    return [replace(tick, before=()) if known else tick for known, tick in zip(follow, ticks, strict=True)]
