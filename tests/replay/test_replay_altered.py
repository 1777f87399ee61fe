"""No altered log passes: changed settings and inputs come out as differences, changed records as an altered log."""

from __future__ import annotations

import itertools
import math
import struct
from pathlib import Path

import pytest
from msgspec.structs import replace

from robot_io.errors import LogDamaged
from robot_io.log.world_messages import COMMAND_CDR, START_CDR, STATE_CDR
from robot_io.mcap.read import read_summary
from robot_io.messages import BodyTwist, LinkState, Pose2D, WorldTwist
from robot_io.tick import ControlTick, Operator
from tests.how_many import mostly_long
from tests.replay.runs import Messages, changed, places, replayed, resealed, rewritten, with_data, with_input
from tools.cli import main
from tools.replay import verified_log
from tools.replay.fold import replay

DIFFERS, DAMAGED = 7, 8


def test_a_changed_gain_differs_from_the_first_tick_that_it_acts_on(sim_log, sim_ticks, tmp_path, capsys):
    def other_gain(text: str) -> str:
        assert "k_f = 0.3" in text
        return text.replace("k_f = 0.3", "k_f = 0.300001")

    log = rewritten(sim_log, tmp_path / "gain.mcap", config=other_gain)
    code, told = replayed(capsys, log)
    first = told["first_difference"]
    assert code == DIFFERS
    assert told["identical"] < told["ticks"]
    assert "theta_p" in first["field"]
    logged = next(tick for tick in sim_ticks if tick.input.tick == first["tick"])
    assert first["logged"] == logged.after.control.theta_p != first["replayed"]
    assert first["logged"] == pytest.approx(first["replayed"], abs=1e-5)
    assert main(["replay", str(log)]) == DIFFERS
    line = [line for line in capsys.readouterr().out.splitlines() if line.startswith("first difference")]
    assert line == [
        f"first difference: tick {first['tick']}, {first['field']}: "
        f"logged {first['logged']!r}, now {first['replayed']!r}"
    ]


def pushed_harder(tick: ControlTick) -> ControlTick:
    readings = tuple(replace(one, force=tuple(f * 1.01 for f in one.force)) for one in tick.input.ft.readings)
    return with_input(tick, ft=replace(tick.input.ft, readings=readings))


INPUTS = {
    "force": pushed_harder,
    "force not a number": lambda tick: with_input(
        tick, ft=replace(tick.input.ft, readings=(replace(tick.input.ft.readings[0], force=(math.nan,) * 3),))
    ),
    "time": lambda tick: with_input(tick, now_ns=tick.input.now_ns + 200_000_000),
    "operator": lambda tick: with_input(tick, operator=int(Operator.STOP)),
    "base pose": lambda tick: with_input(tick, base=replace(tick.input.base, pose=Pose2D(0.3, 0.1, 0.0))),
    "arm": lambda tick: with_input(tick, arm=replace(tick.input.arm, link=int(LinkState.LOST))),
    "gate": lambda tick: with_input(tick, host=replace(tick.input.host, gate_alive=False)),
    "loop error": lambda tick: with_input(tick, host=replace(tick.input.host, loop_error=True)),
    "state before": lambda tick: replace(
        tick, before=(replace(tick.before[0], control=replace(tick.before[0].control, theta_p=0.5)),)
    ),
    "impossible phase": lambda tick: replace(
        tick, before=(replace(tick.before[0], control=replace(tick.before[0].control, phase=77)),)
    ),
    "endless number": lambda tick: with_input(tick, base=replace(tick.input.base, pose=Pose2D(math.inf, 0.0, 0.0))),
    "state after": lambda tick: replace(
        tick, after=replace(tick.after, control=replace(tick.after.control, lateral_m=0.5))
    ),
    "wanted": lambda tick: replace(tick, output=replace(tick.output, wanted_world=WorldTwist(0.1, 0.0, 0.0))),
    "command": lambda tick: replace(tick, output=replace(tick.output, command_body=BodyTwist(0.0, 0.0, 0.0))),
    "exit code": lambda tick: replace(tick, output=replace(tick.output, exit_code=6)),
}


@pytest.mark.parametrize("name", INPUTS)
def test_whoever_mends_the_checksums_too_is_found_by_the_fold(name, sim_ticks, pushing_at, write_log, tmp_path, capsys):
    at = pushing_at
    ticks = [INPUTS[name](sim_ticks[at]), *sim_ticks[at + 1 : at + 4]]
    if name.startswith(("state before", "impossible")):
        ticks = [sim_ticks[at - 1], *ticks]  # the first tick's state is the seed, and cannot be compared
    code, told = replayed(capsys, write_log(tmp_path / "run.mcap", ticks))
    assert code == DIFFERS
    assert told["first_difference"]["tick"] in (sim_ticks[at].input.tick, sim_ticks[at + 1].input.tick)
    assert told["first_difference"]["field"]
    assert told["first_difference"]["logged"] != told["first_difference"]["replayed"]


def test_a_bit_of_a_nan_and_the_sign_of_a_zero_are_differences(sim_ticks, pushing_at, write_log, tmp_path, capsys):
    at = pushing_at
    assert math.isnan(sim_ticks[at].after.control.residual_N)
    for n, (old, new) in enumerate(((math.nan, -math.nan), (math.nan, 0.0), (0.0, -0.0))):
        after = sim_ticks[at].after
        if math.isnan(old):
            control = replace(after.control, residual_N=new)
        else:
            assert after.control.end_progress_m == old
            control = replace(after.control, end_progress_m=new)
        tick = replace(sim_ticks[at], after=replace(after, control=control))
        log = write_log(tmp_path / f"{n}.mcap", [tick])
        code, told = replayed(capsys, log)
        assert code == DIFFERS
        assert told["first_difference"]["field"] in ("after.control.residual_N", "after.control.end_progress_m")


@pytest.fixture(scope="module")
def three_ticks(sim_ticks, pushing_at, write_log, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("three")
    return write_log(folder / "run.mcap", sim_ticks[pushing_at : pushing_at + 3])


def verdict(log: Path) -> int:
    try:
        return DIFFERS if replay(log).different else 0
    except LogDamaged:
        return DAMAGED


def flipped(data: bytes, index: int, mask: int) -> bytes:
    return data[:index] + bytes((data[index] ^ mask,)) + data[index + 1 :]


@pytest.mark.parametrize("step", [41, *(pytest.param(step, marks=pytest.mark.long) for step in (7, 1))])
def test_no_flipped_byte_of_a_tick_passes(step, three_ticks, monkeypatch):
    """Every `step`th byte of the first, a middle and the last tick, one bit each; the file's checksums are right."""
    messages = list(verified_log.read_log(three_ticks))
    summary = verified_log.read_summary(three_ticks)
    rig = verified_log.rig_of_log(summary.attachments["config.toml"].decode(), 2)
    given = messages
    monkeypatch.setattr(verified_log, "read_log", lambda path: iter(given))
    monkeypatch.setattr(verified_log, "read_summary", lambda path: summary)
    monkeypatch.setattr(verified_log, "rig_of_log", lambda *_: rig)
    assert verdict(three_ticks) == 0
    at = [i for i, message in enumerate(messages) if message.topic == "/control/tick"]
    for place in at:
        data = messages[place].payload
        for index in range(place % step, len(data), step):
            altered = messages[place]._replace(payload=flipped(data, index, 1 << (index * 5 % 8)))
            given = [*messages[:place], altered, *messages[place + 1 :]]
            assert verdict(three_ticks) == DAMAGED, f"byte {index} of tick {place}"


@pytest.mark.long
@pytest.mark.timeout(900)
def test_no_flipped_byte_passes_in_a_file_with_right_checksums(three_ticks, tmp_path):
    out = tmp_path / "flipped.mcap"
    size = {}
    rewritten(
        three_ticks, out, lambda found: size.update(n=len(found[places(found, "/control/tick")[0]][1].data)) or []
    )
    for tick, index, mask in itertools.product((0, 1, 2), range(size["n"]), (0x01, 0xFF)):
        edit = changed("/control/tick", tick, lambda data, i=index, m=mask: flipped(data, i % len(data), m))
        rewritten(three_ticks, out, edit)
        assert verdict(out) == DAMAGED, (tick, index, mask)


@pytest.mark.parametrize("tick", [0, 1, -1])
@pytest.mark.parametrize("byte", [0, 4, 5, 8, 11, 200, -1])
def test_a_flipped_byte_is_named_by_its_tick_in_a_rewritten_file(
    three_ticks, sim_ticks, pushing_at, tick, byte, tmp_path
):
    def flip(data: bytes) -> bytes:
        return flipped(data, byte % len(data), 0x40)

    log = rewritten(three_ticks, tmp_path / "run.mcap", changed("/control/tick", tick, flip))
    number = sim_ticks[pushing_at].input.tick + tick % 3
    with pytest.raises(LogDamaged) as caught:
        replay(log)
    named = (f"tick {number}", f"tick {number - 1} or {number}", "the first tick" if tick == 0 else "?")
    assert any(words in caught.value.what for words in named)


def ticks_edited(edit_indexes):
    """Return an edit that takes the places of the ticks and gives the order of messages back."""

    def edit(messages: Messages) -> Messages:
        return edit_indexes(messages, places(messages, "/control/tick"))

    return edit


def swapped(messages: Messages, at: list[int]) -> Messages:
    result = list(messages)
    result[at[3]], result[at[4]] = result[at[4]], result[at[3]]
    return result


ORDERS = {
    "first removed": lambda m, at: [one for i, one in enumerate(m) if i != at[0]],
    "one removed": lambda m, at: [one for i, one in enumerate(m) if i != at[9]],
    "last removed": lambda m, at: m[: at[-1]] + m[at[-1] + 1 :],
    "second half removed": lambda m, at: [one for i, one in enumerate(m) if i not in at[len(at) // 2 :]],
    "everything after a tick removed": lambda m, at: m[: at[-5]],
    "two swapped": swapped,
    "one doubled": lambda m, at: [*m[: at[4]], m[at[4]], *m[at[4] :]],
    "last doubled": lambda m, at: [*m, m[at[-1]]],
    "none left": lambda m, at: [one for i, one in enumerate(m) if i not in at],
}


@pytest.mark.parametrize(
    "name",
    mostly_long(ORDERS, "first removed", "one removed", "last removed", "two swapped", "one doubled", "none left"),
)
def test_ticks_removed_swapped_or_doubled_are_an_altered_log(name, sim_log, tmp_path, capsys):
    log = rewritten(sim_log, tmp_path / "run.mcap", ticks_edited(ORDERS[name]))
    code, told = replayed(capsys, log)
    assert code == DAMAGED
    assert told["error"]["code"] == DAMAGED
    assert told["error"]["what"]


def test_a_tick_at_another_time_of_the_log_is_an_altered_log(three_ticks, tmp_path, capsys):
    def edit(messages: Messages) -> Messages:
        at = places(messages, "/control/tick")[1]
        m = messages[at][1]
        late = type(m)(m.channel_id, m.log_time + 1, m.data, m.publish_time, m.sequence)
        return [*messages[:at], (messages[at][0], late), *messages[at + 1 :]]

    assert replayed(capsys, rewritten(three_ticks, tmp_path / "run.mcap", edit))[0] == DAMAGED


def one_ulp(value: float) -> float:
    return math.nextafter(value, math.inf)


WORLD = {
    "seed": ("/world/start", 0, lambda data: START_CDR.encode(replace(START_CDR.decode(data), seed=7))),
    "start": ("/world/start", 0, lambda data: START_CDR.encode(replace(START_CDR.decode(data), start_ns=0))),
    "start at the end of times": (
        "/world/start", 0, lambda data: START_CDR.encode(replace(START_CDR.decode(data), start_ns=2**63 - 1)),
    ),
    "first state": ("/world/state", 0, lambda data: flipped(data, 20, 1)),
    "a state's force": (
        "/world/state", 250, lambda d: STATE_CDR.encode(replace(s := STATE_CDR.decode(d), force_x=one_ulp(s.force_x))),
    ),
    "last state": ("/world/state", -1, lambda data: flipped(data, len(data) - 8, 1)),
    "a state's endless time": ("/world/state", 5, lambda data: data[:4] + struct.pack("<q", 2**62) + data[12:]),
    "a command": (
        "/world/command", 101, lambda d: COMMAND_CDR.encode(replace(COMMAND_CDR.decode(d), twist=BodyTwist(0.1, 0, 0))),
    ),
    "a command's arrival": ("/world/command", 101, lambda data: flipped(data, 7, 1)),
    "the last command, which nothing follows": ("/world/command", -1, lambda data: flipped(data, 12, 1)),
    "padding": ("/world/command", 90, lambda data: data + b"\x00"),
}  # fmt: skip


@pytest.mark.parametrize(
    "name",
    mostly_long(WORLD, "seed", "start at the end of times", "a state's force", "last state", "a command", "padding"),
)
def test_a_changed_record_of_the_world_does_not_pass(name, sim_log, tmp_path, capsys):
    topic, index, change = WORLD[name]
    log = rewritten(sim_log, tmp_path / "run.mcap", changed(topic, index, change))
    assert replayed(capsys, log)[0] in (DIFFERS, DAMAGED)


@pytest.mark.parametrize(
    "name",
    mostly_long(
        ("a state's force", "a command", "a state's endless time", "start", "start at the end of times", "last state"),
        *("a state's force", "a command", "a state's endless time"),
    ),
)
def test_whoever_mends_the_seal_too_is_found_by_the_world_itself(name, sim_log, tmp_path, capsys):
    topic, index, change = WORLD[name]
    log = resealed(sim_log, tmp_path / "run.mcap", changed(topic, index, change))
    code, told = replayed(capsys, log)
    assert code == DIFFERS
    assert told["first_difference"] is None
    assert told["world"]["first_difference"]["field"]
    assert not told["notes"]


@pytest.mark.parametrize(
    "topic",
    mostly_long(
        ("/world/state", "/world/command", "/world/start", "/gate/sent", "/ft/wrench_raw"), "/world/state", "/gate/sent"
    ),
)
def test_a_removed_record_of_any_topic_does_not_pass(topic, sim_log, tmp_path, capsys):
    def edit(messages: Messages) -> Messages:
        at = places(messages, topic)[-1]
        return messages[:at] + messages[at + 1 :]

    assert replayed(capsys, rewritten(sim_log, tmp_path / "run.mcap", edit))[0] == DAMAGED


def test_a_changed_plot_topic_does_not_pass(sim_log, tmp_path, capsys):
    edit = changed("/ft/wrench", 50, lambda data: flipped(data, 30, 1))
    assert replayed(capsys, rewritten(sim_log, tmp_path / "run.mcap", edit))[0] == DAMAGED


def at_another_time(messages: Messages, at: list[int]) -> Messages:
    m = messages[at[1]][1]
    moved = type(m)(m.channel_id, m.log_time + 1, m.data, m.publish_time, m.sequence)
    return [*messages[: at[1]], (messages[at[1]][0], moved), *messages[at[1] + 1 :]]


def payloads_exchanged(messages: Messages, at: list[int]) -> Messages:
    result = list(messages)
    (topic, first), (_, second) = result[at[50]], result[at[51]]
    assert first.data != second.data
    result[at[50]], result[at[51]] = (topic, with_data(first, second.data)), (topic, with_data(second, first.data))
    return result


@pytest.mark.parametrize(
    "topic", mostly_long(("/ft/wrench_raw", "/gate/sent", "/base/odom", "/world/state"), "/gate/sent", "/world/state")
)
@pytest.mark.parametrize("edit", [at_another_time, payloads_exchanged])
def test_what_was_at_one_time_cannot_be_moved_to_another(edit, topic, sim_log, tmp_path, capsys):
    log = rewritten(sim_log, tmp_path / "run.mcap", lambda messages: edit(messages, places(messages, topic)))
    assert replayed(capsys, log)[0] in (DIFFERS, DAMAGED)


IDLE_SETTINGS = {
    "turn that was not needed": ("lost_turn_rate_rad_per_s = 0.2", "lost_turn_rate_rad_per_s = 0.21"),
    "limit that was not reached": ("max_force_N = 150.0", "max_force_N = 149.0"),
    "patience": ("lost_rest_s = 2.0", "lost_rest_s = 2.1"),
    "noise": ("noise_torque_Nm = 0.03", "noise_torque_Nm = 0.04"),
    "name": ('name = "sim"', 'name = "sim2"'),
}


@pytest.mark.parametrize("name", mostly_long(IDLE_SETTINGS, "limit that was not reached", "name"))
def test_a_changed_setting_that_changes_no_tick_is_an_altered_log(name, sim_log, tmp_path, capsys):
    old, new = IDLE_SETTINGS[name]
    assert old in read_summary(sim_log).attachments["config.toml"].decode()
    log = rewritten(sim_log, tmp_path / "run.mcap", config=lambda text: text.replace(old, new))
    for more in ((), ("--what-if", "control.k_f=0.31")):
        code, told = replayed(capsys, log, *more)
        assert code == DAMAGED
        assert "config.toml" in told["error"]["what"]


def test_a_changed_definition_of_a_type_is_an_altered_log(sim_log, tmp_path, capsys):
    """Readers would show the force as the torque."""

    def other(text: str) -> str:
        return text.replace("Vector3 force", "Vector3 other").replace("Vector3 torque", "Vector3 force")

    assert replayed(capsys, rewritten(sim_log, tmp_path / "run.mcap", schema=other))[0] == DAMAGED


@pytest.mark.parametrize("lost", ["run_end", "run"])
def test_a_log_without_its_facts_does_not_pass(lost, sim_log, tmp_path, capsys):
    log = rewritten(sim_log, tmp_path / "run.mcap", metadata=lambda name, values: None if name == lost else values)
    assert replayed(capsys, log)[0] == DAMAGED


@pytest.mark.long
def test_a_log_written_again_as_the_library_does_by_default_replays_and_a_change_is_found(sim_log, tmp_path, capsys):
    out = tmp_path / "run.mcap"
    assert replayed(capsys, rewritten(sim_log, out, data_crc=False))[0] == 0
    for topic in ("/control/tick", "/ft/wrench_raw"):
        edit = changed(topic, 7, lambda data: flipped(data, len(data) // 2, 1))
        assert replayed(capsys, rewritten(sim_log, out, edit, data_crc=False))[0] == DAMAGED
    log = rewritten(sim_log, out, config=lambda text: text.replace("k_f = 0.3", "k_f = 0.31"), data_crc=False)
    assert replayed(capsys, log)[0] == DIFFERS
