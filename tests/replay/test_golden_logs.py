"""Logs of earlier formats stay readable: kept logs, written by the program as it was, are read by the program of today.

How each was made, and when, stands in `tests/golden/README.md`, with its numbers. None is ever made anew.
"""

from __future__ import annotations

import csv
import json
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from msgspec.structs import replace

from robot_io.cdr.schema import type_from_schema
from robot_io.mcap.read import read_summary
from tests.how_many import mostly_long
from tests.replay.runs import changed, replayed, resealed, rewritten
from tools.cli import main
from tools.commands.replay import machine_differences

LOGS = Path(__file__).resolve().parents[1] / "golden" / "logs"
LARGEST = 700_000


class Golden(NamedTuple):
    """What was in a log when it was written."""

    messages: int
    ticks: int
    states: int
    """Of the simulated world."""
    faults: tuple[str, ...] = ()
    first_push_tick: int = 0
    """First tick of mode PUSHING."""
    derived: int = 0
    """Messages that replay derives again; only where all of it replays."""
    arrived: int = 1232
    """Messages of the base that the ticks hold; only where all of it replays."""
    speed: float = 0.1
    """Of the push, m/s."""

    @property
    def before_the_force(self) -> int:
        """Ticks that no change of how the force is used may touch: all before it is tared, or the first packets."""
        return 3 if self is GOLDEN["sim-barrel-in-contact"] else self.first_push_tick - 1


GOLDEN = {
    "sim": Golden(13131, 969, 968, (), 121),
    "emulated": Golden(11950, 850, 953, (), 100),
    "sim-barrel-in-contact": Golden(10059, 741, 740, (), 21),
    "sim-other-keys": Golden(11768, 867, 866, (), 71),
    "sim-arm-drifts": Golden(6145, 453, 452, ("F20-hold", "F20-stop"), 71),
}
_THE_SAME = Golden(8274, 611, 610, (), 71, 4899)
LATER = {
    "sim-format-2": _THE_SAME,
    "sim-format-3": _THE_SAME,
    "sim-format-4": _THE_SAME._replace(messages=9496, derived=6120),
    "sim-format-4-whole": Golden(9252, 595, 594, (), 71, 5959, 1201, 0.2),
}
"""By the program within each of these formats, the last one at the end of format 4: the law has not changed since."""
WHOLE = {**GOLDEN, **LATER}
NEWER = {
    "input.ft.bias_jumps",
    "input.paused",
    "input.host.law_ns",
    "control.law_error",
    "control.law_state",
    "control.sideways_m",
}
"""Fields of a tick that these logs do not hold."""
MOST_IN_LONG = mostly_long(WHOLE, "sim-arm-drifts")
CUT_OFF = LOGS / "emulated-cut-off.mcap"
SAVED = Golden(5014, 352, 427, (), 30)
"""What could be saved of it when it was written."""


def told(capsys: Any, *argv: object) -> dict[str, Any]:
    """Run `push ... --json` here, which must succeed; return its object."""
    capsys.readouterr()
    code = main([*map(str, argv), "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    found: dict[str, Any] = json.loads(out.splitlines()[-1])
    return found


def cat(capsys: Any, log: Path, *topics: str) -> list[dict[str, Any]]:
    """Return the messages that `push log cat` prints."""
    capsys.readouterr()
    assert main(["log", "cat", str(log), "--topics", *topics]) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def check_events(capsys: Any, log: Path, golden: Golden) -> None:
    events = [line["message"] for line in cat(capsys, log, "/safety/event")]
    assert tuple(event["fault"] for event in events if event["kind"] == "fault") == golden.faults
    pushing = [event["tick"] for event in events if event["text"].endswith("-> PUSHING")]
    assert pushing[0] == golden.first_push_tick


def replayed_here(capsys: Any, log: Path) -> tuple[int, dict[str, Any]]:
    """Replay a log to the bit where this machine computes as the one that wrote it did, as docs/logs.md says."""
    facts = {name: value for record in read_summary(log).metadata.values() for name, value in record.items()}
    return replayed(capsys, log, *(("--tolerance", "1e-9") if machine_differences(facts) else ()))


def check_replay(capsys: Any, log: Path, golden: Golden, *, complete: bool) -> None:
    code, found = replayed_here(capsys, log)
    assert code == 7, found
    assert found["made_by"]["other"], "the law sees the median of three readings now: said to be other code, not damage"
    assert (found["ticks"], found["gaps"]) == (golden.ticks, 0)
    assert golden.before_the_force <= found["identical"] < golden.ticks
    assert (found["world"]["states"], found["world"]["identical"]) == (golden.states, golden.states)
    assert found["complete"] == complete


def test_all_kept_logs_are_read_here_and_are_small():
    kept = {path.stem: path.stat().st_size for path in LOGS.iterdir()}
    assert set(kept) == {*WHOLE, CUT_OFF.stem}
    assert max(kept.values()) < LARGEST


@pytest.mark.parametrize("name", WHOLE)
def test_info_tells_what_is_in_it(name, capsys):
    info = told(capsys, "log", "info", LOGS / f"{name}.mcap")
    counts = {channel["topic"]: channel["messages"] for channel in info["channels"]}
    assert info["messages"] == WHOLE[name].messages
    assert (counts["/control/tick"], counts["/world/state"]) == (WHOLE[name].ticks, WHOLE[name].states)
    assert info["metadata"]["run"]["level"] == name.partition("-")[0]


@pytest.mark.parametrize("name", MOST_IN_LONG)
def test_cat_prints_its_messages(name, capsys):
    log = LOGS / f"{name}.mcap"
    assert len(cat(capsys, log, "/control/tick")) == WHOLE[name].ticks
    check_events(capsys, log, WHOLE[name])


@pytest.mark.parametrize("name", MOST_IN_LONG)
def test_export_writes_its_tables(name, tmp_path, capsys):
    files = told(capsys, "log", "export", LOGS / f"{name}.mcap", "--out", tmp_path / "tables")["files"]
    assert sum(files.values()) == WHOLE[name].messages
    with (tmp_path / "tables" / "base_cmd_vel.csv").open(newline="") as file:
        speeds = [float(row["twist.linear.x [m/s]"]) for row in csv.DictReader(file)]
    assert len(speeds) == WHOLE[name].ticks
    assert WHOLE[name].speed * 0.9 < max(speeds) <= WHOLE[name].speed + 1e-9


@pytest.mark.parametrize("name", MOST_IN_LONG)
def test_report_makes_a_page_of_it(name, tmp_path, capsys):
    page = Path(told(capsys, "report", LOGS / f"{name}.mcap", "--out", tmp_path)["report"])
    text = page.read_text()
    assert text.rstrip().endswith("</html>")
    for fault in WHOLE[name].faults:
        assert fault in text


@pytest.mark.parametrize("name", mostly_long(LATER, "sim-format-2", "sim-format-3", "sim-format-4-whole"))
def test_a_log_of_an_earlier_format_replays_with_all_that_it_held(name, capsys):
    """In format 2 all ticks hold the state before them; up to 3 topics were derived in another way."""
    code, found = replayed_here(capsys, LOGS / f"{name}.mcap")
    golden = LATER[name]
    assert (code, found["identical"], found["gaps"]) == (0, golden.ticks, 0), found
    notes = [note for note in found["notes"] if "not compared" in note]
    left_out = {field for note in notes for field in note.rpartition(": ")[2].split(", ")}
    assert {field.removeprefix("before.").removeprefix("after.") for field in left_out} <= NEWER, "the tare's sums are"
    assert found["world"]["identical"] == golden.states
    assert found["derived"]["identical"] == found["derived"]["messages"] == golden.derived
    assert found["arrived"]["identical"] == found["arrived"]["messages"] == golden.arrived


def test_a_state_before_a_tick_that_was_changed_is_found_in_such_a_log(tmp_path, capsys):
    """`lateral_m` of the state before the last tick, by the type as it was then; every checksum is mended."""
    log = LOGS / "sim-format-2.mcap"
    summary = read_summary(log)
    (text,) = (c.schema_text for c in summary.channels if c.topic == "/control/tick")
    then = type_from_schema("push_msgs/msg/ControlTick", text)
    kept: list[bytes] = []

    def edit(data: bytes) -> bytes:
        tick = then.decode(data)
        control = replace(tick.before.control, lateral_m=tick.before.control.lateral_m + 1e-9)
        kept.append(then.encode(replace(tick, before=replace(tick.before, control=control))))
        return kept[0]

    def end(name: str, values: dict[str, str]) -> dict[str, str]:
        return {**values, "last_tick_crc32": f"{zlib.crc32(kept[0]):08x}"} if name == "run_end" else values

    edited = rewritten(log, tmp_path / "edited.mcap", changed("/control/tick", -1, edit), metadata=end)
    code, found = replayed(capsys, resealed(edited, tmp_path / "run.mcap", lambda messages: messages))
    assert (code, found["identical"]) == (7, 610)
    assert found["first_difference"]["field"] == "before[0].control.lateral_m"


@pytest.mark.parametrize("name", mostly_long(GOLDEN, "emulated", "sim-other-keys", "sim-arm-drifts"))
def test_replay_verifies_world_topics_and_start_with_the_rig_s_keys_as_they_were_called_then(name, capsys):
    """In two logs the tare's time decides how long the start is: the default would differ."""
    check_replay(capsys, LOGS / f"{name}.mcap", GOLDEN[name], complete=True)


def test_a_log_that_was_cut_off_is_recovered_and_read_as_the_others(tmp_path, capsys):
    assert main(["replay", str(CUT_OFF)]) == 8
    assert "push log recover" in capsys.readouterr().err
    log = tmp_path / "saved.mcap"
    assert told(capsys, "log", "recover", CUT_OFF, "--out", log)["messages"] == SAVED.messages
    assert told(capsys, "log", "info", log)["messages"] == SAVED.messages
    assert len(cat(capsys, log, "/control/tick")) == SAVED.ticks
    check_events(capsys, log, SAVED)
    files = told(capsys, "log", "export", log, "--out", tmp_path / "tables")["files"]
    assert files["control_tick.csv"] == SAVED.ticks
    assert Path(told(capsys, "report", log, "--out", tmp_path)["report"]).stat().st_size > 10_000
    check_replay(capsys, log, SAVED, complete=False)
