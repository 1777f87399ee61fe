"""Logs whose messages had other fields: replay folds them again, compares what both have, and says what it cannot."""

from __future__ import annotations

import zlib
from pathlib import Path

import pytest
from msgspec.structs import replace

from robot_io.log import log_format
from robot_io.log.log_format import ChangedTopic, EarlierValue, RenamedField
from robot_io.log.world_messages import STATE_CDR
from robot_io.mcap.read import read_log, read_summary
from robot_io.rig.config import rig_from_toml
from robot_io.tick import ControlTick
from tests.replay.older import EditText, as_older, derived_as, instead, older_type, without, write_older
from tests.replay.runs import Edit, Messages, changed, replayed, resealed, rewritten, with_input
from tools.cli import main
from tools.run.tick_core import TickCore

DIFFERS, DAMAGED = 7, 8
PID, LATERAL = "int64 child_pid", "float64 lateral_m"


@pytest.fixture(autouse=True)
def only_the_tables_of_the_test(monkeypatch):
    """The older logs here are made of today's types, so that what really was otherwise in format 1 is not in them."""
    for table in ("RENAMED_FIELDS", "EARLIER_VALUES", "COMPUTED_VALUES", "NOW_OPTIONAL", "CHANGED_TOPICS"):
        monkeypatch.setattr(log_format, table, ())


@pytest.fixture
def older_log(sim_run, tmp_path, monkeypatch):
    """Return a function that writes ticks with an older type, as a log of format 1."""
    config = (sim_run / "config.toml").read_text()

    def write(ticks: list[ControlTick], edit: EditText, **more: object) -> Path:
        facts = {"in_contact": "False", "program": "single-point-push 0.0.9", "format": "1"}
        return write_older(tmp_path / "run.mcap", config, ticks, edit, monkeypatch, facts=facts, more=more)

    return write


@pytest.fixture
def some_ticks(sim_ticks, pushing_at) -> list[ControlTick]:
    return sim_ticks[pushing_at : pushing_at + 30]


def verified(capsys, log: Path, ticks: int = 30) -> list[str]:
    code, told = replayed(capsys, log)
    assert code == 0, told
    assert (told["ticks"], told["identical"]) == (ticks, ticks)
    assert told["derived"]["identical"] == told["derived"]["messages"] > 5 * ticks
    return [note for note in told["notes"] if "world" not in note]


def test_a_log_of_before_a_field_was_added_replays(older_log, some_ticks, capsys):
    log = older_log(some_ticks, without(PID))
    assert verified(capsys, log) == ["not compared, the log's /control/tick does not hold it: input.arm.child_pid"]


def test_from_its_first_tick_a_log_without_a_field_of_the_state_replays(older_log, sim_ticks, capsys):
    log = older_log(sim_ticks, without(LATERAL))
    (note,) = verified(capsys, log, len(sim_ticks))
    assert note.endswith(": after.control.lateral_m, before.control.lateral_m")


def test_what_both_have_is_compared_to_the_bit(older_log, some_ticks, capsys):
    at = some_ticks[7]
    other = replace(at.after, control=replace(at.after.control, end_progress_m=-0.0))
    assert str(at.after.control.end_progress_m) == "0.0"
    log = older_log([*some_ticks[:7], replace(at, after=other), *some_ticks[8:]], without(PID))
    code, told = replayed(capsys, log)
    assert code == DIFFERS
    assert told["first_difference"]["tick"] == at.input.tick
    assert told["first_difference"]["field"] == "after.control.end_progress_m"
    assert main(["replay", str(log)]) == DIFFERS
    assert "made by other code (an unknown commit of single-point-push 0.0.9" in capsys.readouterr().out


def test_a_changed_input_of_an_older_log_is_found_by_the_fold(older_log, some_ticks, capsys):
    def harder(tick: ControlTick) -> ControlTick:
        readings = tuple(replace(r, force=(r.force[0] * 1.01, *r.force[1:])) for r in tick.input.ft.readings)
        return replace(tick, input=replace(tick.input, ft=replace(tick.input.ft, readings=readings)))

    log = older_log([harder(some_ticks[0]), *some_ticks[1:]], without(PID))
    assert replayed(capsys, log)[0] == DIFFERS


def test_a_count_that_is_told_as_a_measured_value_is_no_difference(older_log, sim_ticks, pushing_at, sim_log, capsys):
    """A frozen sensor (F06) is told by its number of equal readings, which a log holds as a float."""
    core = TickCore.of(rig_from_toml(read_summary(sim_log).attachments["config.toml"].decode()))
    given = sim_ticks[pushing_at : pushing_at + 40]
    state, reading, frozen = given[0].before[0], given[0].input.ft.readings[-1], []
    for tick in given:
        ft = tick.input.ft
        same = tuple(replace(one, force=reading.force, torque=reading.torque) for one in ft.readings)
        tick = with_input(tick, ft=replace(ft, readings=same))
        after, output = core.fold(state, tick.input)
        frozen.append(replace(tick, before=(state,), after=after, output=output))
        state = after
    assert "F06" in frozen[-1].output.faults
    assert len(verified(capsys, older_log(frozen, without(PID)), 40)) == 1


def test_damage_of_an_older_log_is_damage(older_log, some_ticks, tmp_path, capsys):
    log = older_log(some_ticks, without(PID))
    for n, byte in enumerate((4, 200, -1)):
        edit = changed(
            "/control/tick", 5, lambda d, at=byte: d[: at % len(d)] + bytes((d[at] ^ 1,)) + d[at % len(d) + 1 :]
        )
        assert replayed(capsys, resealed(log, tmp_path / f"{n}.mcap", edit))[0] == DAMAGED


def test_a_field_that_has_gone_is_passed_over_with_a_note(older_log, some_ticks, capsys):
    log = older_log(some_ticks, instead(PID, f"{PID}\nfloat64 temperature_c"), temperature_c=31.5)
    assert verified(capsys, log) == ["not compared, today's /control/tick does not hold it: input.arm.temperature_c"]


def test_a_renamed_field_keeps_its_value(older_log, some_ticks, capsys, monkeypatch):
    servo = {tick.input.arm.servo for tick in some_ticks}
    assert len(servo) == 1
    log = older_log(some_ticks, instead("bool servo", "bool actively_held"), actively_held=servo.pop())
    assert len(verified(capsys, log)) == 2
    table = (RenamedField("push_msgs/msg/ArmRecord", "actively_held", "servo", 1),)
    monkeypatch.setattr(log_format, "RENAMED_FIELDS", table)
    assert verified(capsys, log) == []


def test_a_missing_field_means_what_it_meant_then(older_log, some_ticks, capsys, monkeypatch):
    """Without the arm's link every tick would see a lost arm."""
    link = {tick.input.arm.link for tick in some_ticks}
    assert len(link) == 1
    edit = lambda text: text.replace("int64 changed_ns\nuint8 link\n", "int64 changed_ns\n")  # noqa: E731
    log = older_log(some_ticks, edit)
    assert replayed(capsys, log)[0] == DIFFERS
    monkeypatch.setattr(log_format, "EARLIER_VALUES", (EarlierValue("push_msgs/msg/ArmRecord", "link", link.pop(), 1),))
    assert verified(capsys, log) == ["not compared, the log's /control/tick does not hold it: input.arm.link"]


def test_a_topic_that_was_derived_in_another_way_is_said_and_not_compared(
    older_log, some_ticks, tmp_path, capsys, monkeypatch
):
    log = older_log(some_ticks, without(PID))
    edited = resealed(
        log, tmp_path / "edited.mcap", changed("/diagnostics", 0, lambda d: d[:-9] + bytes((d[-9] ^ 1,)) + d[-8:])
    )
    assert replayed(capsys, edited)[0] == DIFFERS
    monkeypatch.setattr(log_format, "CHANGED_TOPICS", (ChangedTopic("/diagnostics", 1),))
    code, told = replayed(capsys, edited)
    assert code == 0
    assert "not compared, because they are derived differently today: /diagnostics" in told["notes"]


def test_a_world_with_another_state_is_run_again_and_compared_by_what_both_have(sim_log, tmp_path, capsys):
    """Every state without the contact's mode; the log sealed as such a program would have."""
    older = older_type(STATE_CDR, without("uint8 contact_mode"))

    def strip(data: bytes) -> bytes:
        return older.encode(as_older(older.shape, STATE_CDR.decode(data), {}))

    def write(name: str, change=lambda state: state) -> Path:
        def edit(messages):
            return [
                (topic, m if topic != "/world/state" else type(m)(
                    m.channel_id, m.log_time, strip(STATE_CDR.encode(change(STATE_CDR.decode(m.data)))),
                    m.publish_time, m.sequence,
                ))
                for topic, m in messages
            ]  # fmt: skip

        def schema(text: str) -> str:
            return older.schema_text if text == STATE_CDR.schema_text else text

        return resealed(sim_log, tmp_path / name, edit, schema=schema)

    log = write("run.mcap")
    assert {c.topic: c.schema_text for c in read_summary(log).channels}["/world/state"] == older.schema_text
    code, told = replayed(capsys, log)
    assert code == 0
    assert told["world"]["identical"] == told["world"]["states"] > 300
    assert told["notes"] == ["not compared, the log's /world/state does not hold it: contact_mode"]
    code, told = replayed(capsys, write("edited.mcap", lambda state: replace(state, force_x=state.force_x + 1e-9)))
    assert code == DIFFERS
    assert told["world"]["first_difference"]["field"] == "force_x"


@pytest.mark.parametrize(
    "edit", [without(PID), pytest.param(instead(PID, f"{PID}\nfloat64 child_pid_then"), marks=pytest.mark.long)]
)
def test_an_older_log_is_read_by_the_other_commands(edit, older_log, some_ticks, tmp_path, capsys):
    log = older_log(some_ticks, edit, child_pid_then=1.0)
    assert sum(message.topic == "/control/tick" for message in read_log(log)) == 30
    assert main(["log", "info", str(log)]) == 0
    capsys.readouterr()
    assert main(["log", "cat", str(log), "--topics", "/control/tick"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 30
    assert ("child_pid_then" in lines[0]) == ('"child_pid"' in lines[0])
    assert main(["log", "export", str(log), "--out", str(tmp_path / "tables")]) == 0
    assert main(["report", str(log), "--out", str(tmp_path)]) == 0
    assert "</html>" in (tmp_path / "report.html").read_text()


def test_a_tick_of_another_type_is_no_log_of_ours(older_log, some_ticks, tmp_path, capsys):
    log = older_log(some_ticks, without(PID))
    for n, edit in enumerate((lambda _: "wstring x\n", lambda _: "not a schema", lambda _: "int64 x\n")):
        out = resealed(
            log, tmp_path / f"{n}.mcap", lambda m: m, schema=lambda t, e=edit: e(t) if "crc32_before" in t else t
        )
        assert replayed(capsys, out)[0] == DAMAGED


def payload_sum(messages: Messages) -> str:
    """The seal of early logs, as they were written: CRC-32 of each topic and payload, summed up."""
    return f"{sum(zlib.crc32(topic.encode() + m.data) for topic, m in messages) % 2**32:08x}"


@pytest.mark.parametrize("seal", ["payloads", pytest.param("none", marks=pytest.mark.long)])
def test_the_seals_of_early_logs_cover_what_they_covered(seal, sim_log, tmp_path, capsys, monkeypatch):
    kept: Messages = []
    early_log = derived_as(sim_log, tmp_path / "early.mcap", 1, monkeypatch)

    def write(name: str, edit: Edit, *, later: Edit = lambda messages: messages) -> Path:
        def sealed_then_edited(messages: Messages) -> Messages:
            kept[:] = edit(messages)
            return later(kept)

        def facts(name: str, values: dict[str, str]) -> dict[str, str]:
            ours = ("message_sum", "config_crc32", "format", "commit", "dirty")
            early = {key: value for key, value in values.items() if key not in ours}
            return {**early, "payload_sum": payload_sum(kept)} if (name, seal) == ("run_end", "payloads") else early

        return rewritten(early_log, tmp_path / name, sealed_then_edited, metadata=facts)

    code, told = replayed(capsys, write("whole.mcap", lambda messages: messages))
    assert (code, told["identical"]) == (0, told["ticks"])
    uncovered = "types and times of messages" if seal == "payloads" else "messages but ticks"
    assert told["notes"] == [f"the log's seal does not cover its config.toml, nor {uncovered}"]
    status = changed("/base/status", 2, lambda data: data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:])
    assert replayed(capsys, write("edited.mcap", lambda m: m, later=status))[0] == (
        DAMAGED if seal == "payloads" else 0
    )
    wrench = changed("/ft/wrench", 50, lambda data: data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:])
    assert replayed(capsys, write("derived.mcap", wrench))[0] == DIFFERS
    tick = changed("/control/tick", 50, lambda data: data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:])
    assert replayed(capsys, write("tick.mcap", tick))[0] == DAMAGED


def test_a_log_of_today_never_passes_with_an_early_seal(sim_log, tmp_path, capsys):
    def drop(name: str, values: dict[str, str]) -> dict[str, str]:
        return {key: value for key, value in values.items() if key not in ("message_sum", "config_crc32")}

    assert replayed(capsys, rewritten(sim_log, tmp_path / "run.mcap", metadata=drop))[0] == DAMAGED
