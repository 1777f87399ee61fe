"""Logs as they were written replay to the last bit, at both levels, and say so for people and for scripts."""

from __future__ import annotations

import json

import pytest
from mcap.reader import make_reader

from robot_io.log.log_format import LOG_FORMAT
from tests.replay.runs import replayed, rewritten
from tools.cli import main

DERIVED = (
    "/ft/wrench_raw", "/ft/wrench", "/arm/joint_states", "/arm/status", "/control/signals", "/base/cmd_vel_raw",
    "/base/cmd_vel", "/loop/timing",
    "/diagnostics", "/tf", "/tf_static", "/robot_description", "/path", "/safety/event", "/rosout",
)  # fmt: skip


@pytest.mark.parametrize("level", ["sim_run", "emulated_run"])
def test_every_tick_and_every_state_of_the_world_is_identical(level, request, capsys):
    folder = request.getfixturevalue(level)
    code, told = replayed(capsys, folder)
    assert code == 0
    assert told["ticks"] > 300
    assert told["world"]["states"] > 300
    assert told == {
        "schema": 1,
        "ticks": told["ticks"],
        "identical": told["ticks"],
        "gaps": 0,
        "first_difference": None,
        "world": {"states": told["world"]["states"], "identical": told["world"]["states"], "first_difference": None},
        "derived": {
            "messages": told["derived"]["messages"],
            "identical": told["derived"]["messages"],
            "first_difference": None,
        },
        "arrived": {
            "messages": told["arrived"]["messages"],
            "identical": told["arrived"]["messages"],
            "first_difference": None,
        },
        "complete": True,
        "made_by": told["made_by"] | {"format": LOG_FORMAT},
        "notes": [],
        "machine_differences": [],
    }
    with (folder / "run.mcap").open("rb") as file:
        counts = make_reader(file).get_summary()
    topics = {counts.channels[n].topic: count for n, count in counts.statistics.channel_message_counts.items()}
    assert told["ticks"] == topics["/control/tick"]
    assert told["world"]["states"] == topics["/world/state"]
    assert told["arrived"]["messages"] > 300
    assert told["derived"]["messages"] == sum(topics.get(topic, 0) for topic in DERIVED)


def test_people_read_one_line_for_the_ticks(sim_log, capsys):
    assert main(["replay", str(sim_log)]) == 0
    lines = capsys.readouterr().out.splitlines()
    count = lines[0].split()[1]
    assert lines[0] == f"replay: {count} of {count} ticks identical"
    assert main(["replay", str(sim_log), "--json"]) == 0
    out, err = capsys.readouterr()
    assert out.count("\n") == 1
    assert json.loads(out)["ticks"] == int(count)
    assert err.splitlines()[0] == lines[0]


def test_a_log_copied_by_another_tool_or_sorted_by_time_still_replays(sim_log, emulated_run, tmp_path, capsys):
    assert replayed(capsys, rewritten(sim_log, tmp_path / "copy.mcap"))[0] == 0
    for n, log in enumerate((sim_log, emulated_run / "run.mcap")):
        by_time = rewritten(log, tmp_path / f"{n}.mcap", lambda found: sorted(found, key=lambda one: one[1].log_time))
        code, told = replayed(capsys, by_time)
        assert (code, told["identical"]) == (0, told["ticks"])
        assert told["world"]["identical"] == told["world"]["states"]
