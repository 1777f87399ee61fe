"""Every derived topic is derived again: what was edited, lost, doubled or added is found, though the log is sealed."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.records import Message

from robot_io.log.channels import BY_TOPIC
from robot_io.log.log_format import FORMAT_FACT, LOG_FORMAT
from robot_io.log.messages import SAFETY_EVENT, SafetyEvent
from robot_io.log.ros_messages import Header, ros_time
from robot_io.rig.config import load_rig, rig_to_toml
from robot_io.tick import TICK_CDR
from tests.how_many import mostly_long
from tests.replay.conftest import short_push
from tests.replay.runs import Messages, changed, places, replayed, resealed, rewritten, with_data
from tools.cli import main
from tools.log.run_log import RunLog
from tools.replay import derived
from tools.replay.fold import replay

DIFFERS, DAMAGED = 7, 8
TOPICS = (
    "/ft/wrench_raw", "/ft/wrench", "/arm/joint_states", "/arm/status", "/control/signals", "/base/cmd_vel_raw",
    "/base/cmd_vel", "/loop/timing", "/diagnostics", "/tf", "/tf_static", "/robot_description", "/path",
    "/safety/event", "/rosout",
)  # fmt: skip
FACTS = {FORMAT_FACT: str(LOG_FORMAT)}


def first_of(log: Path, capsys) -> tuple[int, dict]:
    code, told = replayed(capsys, log)
    assert told["identical"] == told["ticks"]
    assert told["first_difference"] is None
    return code, told["derived"]


def last_byte(data: bytes) -> bytes:
    return data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:]


@pytest.mark.parametrize("topic", mostly_long(TOPICS, "/ft/wrench", "/tf", "/control/signals", "/safety/event"))
def test_an_edited_message_of_any_derived_topic_is_found_and_named(topic, sim_log, tmp_path, capsys):
    code, told = first_of(resealed(sim_log, tmp_path / "run.mcap", changed(topic, -1, last_byte)), capsys)
    assert code == DIFFERS
    assert told["identical"] == told["messages"] - 1
    assert told["first_difference"]["field"].split()[0] == topic
    assert told["first_difference"]["tick"] > 10**18


@pytest.mark.long
def test_every_wrench_set_to_zero_is_found(sim_log, tmp_path, capsys):
    wrench = BY_TOPIC["/ft/wrench"].cdr_type

    def edit(messages: Messages) -> Messages:
        def zero(message: Message) -> Message:
            value = wrench.decode(message.data)
            force = type(value.wrench.force)(0.0, 0.0, 0.0)
            return with_data(message, wrench.encode(type(value)(value.header, type(value.wrench)(force, force))))

        return [(topic, zero(m) if topic == "/ft/wrench" else m) for topic, m in messages]

    log = resealed(sim_log, tmp_path / "run.mcap", edit)
    code, told = first_of(log, capsys)
    assert code == DIFFERS
    assert told["first_difference"]["field"].startswith("/ft/wrench wrench.")
    assert 0.0 in (told["first_difference"]["logged"],)
    assert main(["replay", str(log)]) == DIFFERS
    assert "first difference: message at 1" in capsys.readouterr().out


@pytest.mark.parametrize("topic", mostly_long(TOPICS, "/safety/event"))
def test_a_lost_and_a_doubled_message_are_found(topic, sim_log, tmp_path, capsys):
    def lost(messages: Messages) -> Messages:
        at = places(messages, topic)[-1]
        return messages[:at] + messages[at + 1 :]

    def doubled(messages: Messages) -> Messages:
        at = places(messages, topic)[-1]
        return [*messages[:at], messages[at], *messages[at:]]

    for n, (edit, logged) in enumerate(((lost, "no message"), (doubled, "a message"))):
        code, told = first_of(resealed(sim_log, tmp_path / f"{n}.mcap", edit), capsys)
        assert code == DIFFERS
        assert (told["first_difference"]["field"], told["first_difference"]["logged"]) == (topic, logged)


def test_a_message_at_another_time_is_found(sim_log, tmp_path, capsys):
    def late(messages: Messages) -> Messages:
        at = places(messages, "/base/cmd_vel")[7]
        topic, m = messages[at]
        moved = Message(m.channel_id, m.log_time + 1, m.data, m.publish_time, m.sequence)
        return [*messages[:at], (topic, moved), *messages[at + 1 :]]

    assert first_of(resealed(sim_log, tmp_path / "run.mcap", late), capsys)[0] == DIFFERS


def test_an_invented_event_is_found_and_the_gate_s_own_word_is_none(sim_ticks, sim_run, tmp_path, capsys):
    def log_with(name: str, text: str) -> Path:
        config = (sim_run / "config.toml").read_text()
        log = RunLog(tmp_path / name, config_text=config, metadata=FACTS, wall_offset_ns=10**18)
        for tick in sim_ticks[:50]:
            log.tick(tick.input.now_ns, TICK_CDR.encode(tick), tick)
        at_ns = sim_ticks[20].input.now_ns
        header = Header(ros_time(at_ns + 10**18), "base_link")
        log.record(31, at_ns, SAFETY_EVENT.encode(SafetyEvent(header, 20, "fault", "F36", text, 5, 5)))
        log.finish({"dropped_gate": "1"})
        return tmp_path / name

    assert first_of(log_with("gate.mcap", "gate: no frame in time"), capsys)[0] == 0
    code, told = first_of(log_with("other.mcap", "no frame in time"), capsys)
    assert code == DIFFERS
    assert told["first_difference"]["field"] == "/safety/event"


def by_topic(messages: Messages) -> Messages:
    """Grouped by topic, but for the world's records, which are of one time line."""
    return sorted(messages, key=lambda one: "/world" if one[0].startswith("/world/") else one[0])


def test_a_log_sorted_by_topic_replays_and_an_edit_in_it_is_found(sim_log, tmp_path, capsys, monkeypatch):
    assert replayed(capsys, rewritten(sim_log, tmp_path / "sorted.mcap", by_topic))[0] == 0
    edit = changed("/ft/wrench", 50, last_byte)
    log = resealed(sim_log, tmp_path / "edited.mcap", lambda messages: by_topic(edit(messages)))
    assert first_of(log, capsys)[0] == DIFFERS


def test_what_waits_is_bounded_and_a_log_beyond_it_differs(sim_log, tmp_path, monkeypatch):
    assert derived.MOST_WAITING == 100_000
    monkeypatch.setattr(derived, "MOST_WAITING", 100)
    assert not replay(sim_log).different
    log = rewritten(sim_log, tmp_path / "sorted.mcap", by_topic)
    found = replay(log).derived.first_difference
    assert found is not None
    assert "far from" in found.logged


def test_a_log_as_it_was_written_needs_no_room_to_wait(sim_log, monkeypatch):
    """However long a log is: memory is that of one tick's messages."""
    monkeypatch.setattr(derived, "MOST_WAITING", 15)
    assert not replay(sim_log).different


def test_of_a_world_without_cameras_the_object_s_pose_is_derived(tmp_path, capsys):
    run = short_push(tmp_path, "sim", "--fast", "--set", 'base.topics.slider_pose=""')
    log = run / "run.mcap"
    code, told = first_of(log, capsys)
    assert code == 0
    for topic in ("/slider/pose", "/tf"):
        edited = resealed(log, tmp_path / f"{topic[1:3]}.mcap", changed(topic, 20, last_byte))
        code, edited_told = first_of(edited, capsys)
        assert code == DIFFERS
        assert edited_told["messages"] == told["messages"]
        assert edited_told["first_difference"]["field"].startswith(topic)


def flipped(data: bytes, index: int) -> bytes:
    at = index % len(data)
    return data[:at] + bytes((data[at] ^ 1,)) + data[at + 1 :]


def test_with_a_tolerance_rounding_of_a_derived_topic_passes_and_more_does_not(sim_log, tmp_path, capsys):
    """The last eight bytes of a path are the w of a quaternion: 1.0, its last bit, and a bit of 0.06."""
    last_bit = resealed(sim_log, tmp_path / "bit.mcap", changed("/path", 0, lambda data: flipped(data, -8)))
    assert first_of(last_bit, capsys)[0] == DIFFERS
    assert replayed(capsys, last_bit, "--tolerance", "1e-9")[0] == 0
    far = resealed(sim_log, tmp_path / "far.mcap", changed("/path", 0, lambda data: flipped(data, -2)))
    assert replayed(capsys, far, "--tolerance", "1e-9")[0] == DIFFERS


def test_what_cannot_be_derived_is_a_difference_and_no_traceback(sim_ticks, tmp_path):
    """A tick of a far future has no ROS time; the recorder would not have written it."""
    rig = rig_to_toml(load_rig("sim"))
    path = tmp_path / "run.mcap"
    log = RunLog(path, config_text=rig, metadata=FACTS, wall_offset_ns=0)
    tick = sim_ticks[0]
    log.tick(tick.input.now_ns, TICK_CDR.encode(tick), tick)
    log.finish({})
    found = replay(path)
    assert not found.derived.first_difference
    core = derived.DerivedReplayer(load_rig("sim"), 2**63 - 1, (), LOG_FORMAT)
    core.tick(tick, 5)
    first = core.result(complete=True).first_difference
    assert first is not None
    assert first.field == "derived from /control/tick"
