"""Packs runs into a zip for others: logs, settings and summaries, without addresses and names; logs still replay."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from mcap.records import Attachment, Header, Message, Metadata
from msgspec.structs import replace

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.schema import type_from_schema
from robot_io.errors import LogDamaged
from robot_io.log.log_format import format_of
from robot_io.log.recovery import RECOVERED_METADATA, LogCopy
from robot_io.log.seal import CONFIG_FACT, config_seal, seal_of
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, END_METADATA, RUN_METADATA
from robot_io.mcap.read import LogSummary, read_summary
from robot_io.mcap.walk import Topic, walk
from robot_io.mcap.write import McapWriter
from robot_io.rig.logged import rig_of_log
from tools.log.scrub import Scrub

WITH_WORDS = {"/gate/decision": ("text",), "/safety/event": ("text",)}
"""Fields of messages that may hold an address: what a link said as it was lost."""
TEXTS = (".toml", ".json", ".csv", ".md", ".txt", ".html", ".svg")
LEFT_OUT = "processes.json"
_THEN = (1980, 1, 1, 0, 0, 0)
"""The date of every file, so that the same runs give the same zip."""


class Packed(NamedTuple):
    """What is in a zip: the folders of its runs, what was removed and how often, and the files that were left out."""

    runs: list[str]
    removed: dict[str, int]
    left_out: list[str]


def pack(logs: list[Path], top: Path, out: Path, names: tuple[str, ...]) -> Packed:
    """Write the zip. `logs` are the verified logs below `top`; names: of user and machine, to be removed.

    Raises LogDamaged, OSError; FileExistsError where `out` is there.
    """
    summaries = {log: read_summary(log) for log in logs}
    scrub = Scrub(names, str(top.resolve().parent))
    for log, summary in summaries.items():
        scrub.add_rig(rig_of_log(_config(summary), _format(summary, log)).rig)
    left_out: list[str] = []
    folders: dict[Path, list[Path]] = {}
    for log in logs:
        folders.setdefault(log.parent, []).append(log)
    runs = [scrub.text(str(folder.relative_to(top))) for folder in folders]
    root = scrub.text(top.resolve().name)
    with zipfile.ZipFile(out, "x", zipfile.ZIP_DEFLATED) as packed:
        for folder, files in folders.items():
            place = scrub.text((Path(top.resolve().name) / folder.relative_to(top)).as_posix())
            for file in sorted(folder.iterdir()):
                if file in files:
                    content = scrubbed_log(file, summaries[file], scrub)
                    _add(packed, f"{place}/{scrub.text(file.name)}", content, stored=True)
                elif file.suffix in TEXTS and file.name != LEFT_OUT:
                    text = scrub.text(file.read_text(encoding="utf-8", errors="replace"))
                    _add(packed, f"{place}/{scrub.text(file.name)}", text.encode())
                elif file.is_file():
                    left_out.append(f"{place}/{file.name}")
        removed = {kind: count for kind, count in sorted(scrub.counts.items()) if count}
        of_runs = [[summaries[file] for file in files] for files in folders.values()]
        _add(packed, f"{root}/README.txt", _readme(runs, removed, left_out, of_runs).encode())
    return Packed(runs, removed, left_out)


def scrubbed_log(path: Path, summary: LogSummary, scrub: Scrub) -> bytes:
    """Return a verified log with other texts in config, facts and the gate's words, and sealed again."""
    end_name = END_METADATA if END_METADATA in summary.metadata else RECOVERED_METADATA
    end = summary.metadata.get(end_name, {})
    stream = io.BytesIO()
    items = walk(path)
    first = next(items)
    assert isinstance(first, Header)
    copy = LogCopy(McapWriter(stream, first.profile, first.library), seal_of(end, _format(summary, path)))
    edits: dict[int, Callable[[bytes], bytes]] = {}
    for item in items:
        if isinstance(item, Topic):
            if item.channel.topic in WITH_WORDS:
                edits[item.channel.id] = _words_edit(item, scrub)
        elif isinstance(item, Message):
            if item.channel_id in edits:
                item.data = edits[item.channel_id](item.data)
        elif isinstance(item, Attachment):
            item.data = scrub.text(item.data.decode(errors="replace")).encode()
        elif isinstance(item, Metadata):
            if item.name == end_name:
                continue
            item.metadata = {key: scrub.text(value) for key, value in item.metadata.items()}
        copy.take(item)
    facts = {key: scrub.text(value) for key, value in end.items()} | copy.seal.facts()
    if CONFIG_FACT in end:
        facts |= config_seal(copy.config)
    if end:
        copy.writer.add_metadata(end_name, facts)
    copy.writer.finish()
    return stream.getvalue()


def _words_edit(topic: Topic, scrub: Scrub) -> Callable[[bytes], bytes]:
    kind: CdrType[Any] = type_from_schema(topic.schema.name, topic.schema.data.decode())
    fields = WITH_WORDS[topic.channel.topic]

    def edit(payload: bytes) -> bytes:
        message = kind.decode(payload)
        return kind.encode(replace(message, **{name: scrub.text(getattr(message, name)) for name in fields}))

    return edit


def _config(summary: LogSummary) -> str:
    if CONFIG_ATTACHMENT not in summary.attachments:
        raise LogDamaged("this is not the log of a push", do="Leave it out of the folder")
    return summary.attachments[CONFIG_ATTACHMENT].decode(errors="replace")


def _format(summary: LogSummary, path: Path) -> int:
    return format_of(summary.metadata.get(RUN_METADATA, {}), str(path))


def _add(packed: zipfile.ZipFile, name: str, content: bytes, *, stored: bool = False) -> None:
    info = zipfile.ZipInfo(name, _THEN)
    info.compress_type = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
    info.external_attr = 0o644 << 16
    packed.writestr(info, content)


def _readme(runs: list[str], removed: dict[str, int], left_out: list[str], logs: list[list[LogSummary]]) -> str:
    return "\n".join(_readme_lines(runs, removed, left_out, logs)) + "\n"


def _readme_lines(
    runs: list[str], removed: dict[str, int], left_out: list[str], logs: list[list[LogSummary]]
) -> Iterator[str]:
    yield "Runs of single-point-push, packed by `push log zip`."
    yield "`push replay RUN` re-runs the control of each on its logged inputs and compares every byte."
    yield ""
    for run, parts in zip(runs, logs, strict=True):
        facts = parts[0].metadata.get(RUN_METADATA, {})
        made = f"{facts.get('program', 'an unknown version')}, commit {facts.get('commit', 'unknown')}"
        yield f"  {run}: {sum(part.messages for part in parts)} messages, {made}"
    yield ""
    yield "Removed from settings, facts and texts, and replaced by words that mean nothing:"
    yield from (f"  {kind}: {count} times" for kind, count in removed.items())
    if not removed:
        yield "  nothing: there was none"
    yield "The logs were sealed again afterwards. Measurements, times and the seed are as they were recorded."
    if left_out:
        yield ""
        yield "Left out: process ids, and files that are neither a log nor text:"
        yield from (f"  {name}" for name in left_out)
