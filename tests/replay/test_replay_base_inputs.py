"""What a tick holds of the base stands in the log as the gate wrote it; an edited or lost one is found."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.how_many import mostly_long
from tests.replay.older import derived_as
from tests.replay.runs import Messages, changed, places, replayed, resealed, rewritten, with_data
from tools.cli import main
from tools.replay import base_inputs
from tools.replay.fold import replay

DIFFERS = 7
TOPICS = ("/base/pose", "/base/odom", "/base/status", "/gate/sent")
LOW_BYTE = {"/base/pose": -8, "/base/odom": -8 * (36 + 6), "/gate/sent": -8}
"""Where the lowest byte of the field is, counted from the end; odometry has a twist and its covariance there."""
LEVELS = ("sim_log", "emulated_log")


@pytest.fixture(scope="session")
def emulated_log(emulated_run) -> Path:
    return emulated_run / "run.mcap"


def every_other_bit(messages: Messages, topic: str, byte: int) -> Messages:
    """Every message of a topic but the last ten, whose ticks may have come too late, with one bit changed."""
    at = set(places(messages, topic)[:-10])
    edited = []
    for i, (name, m) in enumerate(messages):
        data = m.data[:byte] + bytes((m.data[byte] ^ 1,)) + m.data[byte + 1 :] if i in at else m.data
        edited.append((name, type(m)(m.channel_id, m.log_time, data, m.publish_time, m.sequence)))
    return edited


@pytest.mark.parametrize("level", mostly_long(LEVELS, "sim_log"))
@pytest.mark.parametrize(("topic", "field"), [
    ("/base/pose", "pose.orientation.w"), ("/base/odom", "twist.twist.linear.x"), ("/gate/sent", "twist.angular.z"),
])  # fmt: skip
def test_an_edited_input_is_found_and_named_though_the_log_is_sealed(level, topic, field, request, tmp_path, capsys):
    log = request.getfixturevalue(level)
    out = resealed(log, tmp_path / "run.mcap", lambda messages: every_other_bit(messages, topic, LOW_BYTE[topic]))
    code, told = replayed(capsys, out)
    assert code == DIFFERS
    assert told["identical"] == told["ticks"]
    assert told["derived"]["first_difference"] is None
    assert told["arrived"]["identical"] < told["arrived"]["messages"]
    assert told["arrived"]["first_difference"]["field"] == f"{topic} {field}"
    assert main(["replay", str(out)]) == DIFFERS
    assert f"first difference: message at {told['arrived']['first_difference']['tick']}, {topic} {field}" in (
        capsys.readouterr().out
    )


def test_of_messages_that_came_in_one_read_the_last_is_compared(sim_log, tmp_path, capsys):
    topic = "/base/odom"

    def edit(messages: Messages) -> Messages:
        at = places(messages, topic)[20]
        name, last = messages[at]
        earlier = with_data(last, last.data[:8] + bytes((last.data[8] ^ 1,)) + last.data[9:])  # its stamp
        edited = every_other_bit([(name, last)] * 11, topic, LOW_BYTE[topic])[0]
        return [*messages[:at], (name, earlier), edited, *messages[at + 1 :]]

    code, told = replayed(capsys, resealed(sim_log, tmp_path / "run.mcap", edit))
    assert code == DIFFERS
    assert told["arrived"]["first_difference"]["field"] == "/base/odom twist.twist.linear.x"


def test_one_edited_command_that_was_really_sent_is_found(sim_log, sim_ticks, pushing_at, tmp_path, capsys):
    sent_ns = sim_ticks[pushing_at].input.base.sent_ns
    offset_ns = 1_600_000_000 * 10**9 - 10**9
    found = []

    def edit(messages: Messages) -> Messages:
        sent = [m.log_time for topic, m in messages if topic == "/gate/sent"]
        found.append(sent.index(sent_ns + offset_ns))
        return changed("/gate/sent", found[0], lambda data: data[:-1] + bytes((data[-1] ^ 128,)))(messages)

    code, told = replayed(capsys, resealed(sim_log, tmp_path / "run.mcap", edit))
    assert code == DIFFERS
    assert told["arrived"]["messages"] - told["arrived"]["identical"] == 1
    assert told["arrived"]["first_difference"]["tick"] == sent_ns + offset_ns


@pytest.mark.parametrize("topic", TOPICS)
def test_lost_inputs_are_found(topic, sim_log, tmp_path, capsys):
    def lost(messages: Messages) -> Messages:
        at = set(places(messages, topic)[2:6])
        return [one for i, one in enumerate(messages) if i not in at]

    code, told = replayed(capsys, resealed(sim_log, tmp_path / "run.mcap", lost))
    assert code == DIFFERS
    assert told["arrived"]["first_difference"]["field"] == topic
    assert told["arrived"]["first_difference"]["logged"] == "no message"


def test_in_a_log_of_an_earlier_format_and_with_a_full_ring_they_are_not_compared(
    sim_log, tmp_path, capsys, monkeypatch
):
    earlier = derived_as(sim_log, tmp_path / "1.mcap", 1, monkeypatch)
    dropped = rewritten(
        sim_log, tmp_path / "2.mcap", metadata=lambda name, v: v | {"dropped_gate": "1"} if name == "run_end" else v
    )
    for log in (earlier, dropped):
        code, told = replayed(capsys, log)
        assert (code, told["arrived"]) == (0, None)


@pytest.mark.parametrize("level", mostly_long(LEVELS, "sim_log"))
def test_memory_is_bounded_and_what_was_forgotten_is_no_difference(level, request, tmp_path, monkeypatch):
    """With room for 50, a log as it was written has all; one sorted by topic can be compared in part only."""
    log = request.getfixturevalue(level)
    whole = replay(log).arrived
    monkeypatch.setattr(base_inputs, "MOST_KEPT", 50)
    assert replay(log).arrived == whole

    def by_topic(messages: Messages) -> Messages:
        return sorted(messages, key=lambda one: "/world" if one[0].startswith("/world/") else one[0])

    found = replay(rewritten(log, tmp_path / "sorted.mcap", by_topic))
    assert not found.different
    assert found.arrived is not None
    assert whole is not None
    assert 0 < found.arrived.messages < whole.messages
