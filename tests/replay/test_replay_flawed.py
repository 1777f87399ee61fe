"""Runs in which devices send no numbers: nothing of it is logged as if it were sound, and the log replays."""

from __future__ import annotations

import functools
import re

import pytest

from robot_io.log.channels import BY_TOPIC
from robot_io.mcap.read import read_log
from tests.forked_push import forked
from tests.push_runs import QUICK
from tests.replay.runs import changed, replayed, resealed

STOPPED, DIFFERS = 5, 7


@pytest.fixture(scope="module")
def run_with(tmp_path_factory):
    @functools.cache
    def run(fault: str):
        folder = tmp_path_factory.mktemp("flawed")
        out = folder / "run"
        argv = ("run", "sim", "--fast", *QUICK, "--distance-m", "0.2", "--fault", f"{fault} at 2 s", "--out", str(out))
        done = forked(folder / "state", *argv)
        assert done.code == STOPPED, done.err
        return out / "run.mcap"

    return run


@pytest.mark.parametrize(("fault", "topic"), [
    ("ft.garbage", ""), pytest.param("arm.garbage", "", marks=pytest.mark.long), ("base.pose.garbage", "/base/pose"),
    pytest.param("base.odometry.garbage", "/base/odom", marks=pytest.mark.long),
])  # fmt: skip
def test_no_standard_message_holds_a_nan_and_what_is_flawed_is_said(fault, topic, run_with, capsys):
    log = run_with(fault)
    flawed = []
    for message in read_log(log):
        value = BY_TOPIC[message.topic].cdr_type.decode(message.payload)
        if message.topic == "/base/flawed":
            flawed.append((value.topic, value.flaw, message.log_time_ns))
        elif not message.schema_name.startswith("push_msgs"):
            assert not re.search(r"=-?(nan|inf)\b", str(value)), message.topic
    assert {(where, flaw) for where, flaw, _ in flawed} == ({(topic, "a number is not finite")} if topic else set())
    if topic:
        first_ns = flawed[0][2]
        after = [m for m in read_log(log) if m.topic == topic and m.log_time_ns > first_ns]
        assert not after, "the fault lasts to the end"
    code, told = replayed(capsys, log)
    assert (code, told["identical"]) == (0, told["ticks"])
    assert told["arrived"]["identical"] == told["arrived"]["messages"]
    assert told["derived"]["identical"] == told["derived"]["messages"]


def test_a_flawed_pose_that_was_edited_away_is_found(run_with, tmp_path, capsys):
    log = run_with("base.pose.garbage")
    gone = resealed(log, tmp_path / "gone.mcap", lambda found: [one for one in found if one[0] != "/base/flawed"])
    code, told = replayed(capsys, gone)
    assert (code, told["arrived"]["first_difference"]["field"]) == (DIFFERS, "/base/flawed")
    moved = resealed(log, tmp_path / "moved.mcap", changed("/base/flawed", 0, lambda d: d[:8] + b"\x01" + d[9:]))
    code, told = replayed(capsys, moved)
    assert (code, told["arrived"]["first_difference"]["field"]) == (DIFFERS, "/base/flawed header.stamp.nanosec")
