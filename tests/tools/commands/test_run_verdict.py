"""`done` means done: pushes that reach their distance and are not done, and stops that name their first cause."""

from __future__ import annotations

import json
import math
import os
import signal

import pytest
from msgspec.structs import replace

from robot_io.geometry import StraightPath
from robot_io.log.world_messages import STATE_CDR
from robot_io.rig.config import load_rig
from sim_backend.sim.ft300 import SimFt300
from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import FAST_TARE, QUICK, messages, started
from tests.replay.runs import push
from tools.run import lockstep
from tools.run.lockstep import Lockstep, simulated_sensor
from tools.verdict.evidence import gather
from tools.verdict.judgement import judge
from tools.verdict.witness import Witness

SIM = ("run", "sim", "--fast", "--json", *FAST_TARE)
MOCAP_M, MOCAP_RAD = 0.0005, math.radians(0.2)
"""Noise of the simulated motion capture, 1 sigma; an angle turned is the difference of two."""
TURNED = (
    *("--set", "control.k_y_rad_per_m=0"),
    *("--set", "world.start.spread=0"),
    *("--set", "world.start.heading_deg=40"),
)
"""An object that stands turned, pushed without the term that brings the ball back to the path."""


def ran(tmp_path, *words):
    """Push at level sim; return exit code, summary and what was said to people."""
    done = push(*SIM, *words, "--out", tmp_path / "run", state=tmp_path / "state")
    summary = json.loads(done.stdout.splitlines()[-1])
    assert json.loads((tmp_path / "run" / "summary.json").read_text()) == summary
    assert done.returncode == summary["exit_code"]
    return done.returncode, summary, done.stderr


def says(summary):
    return {item["id"]: item["says"] for item in summary["trust"]}


def test_a_good_push_is_done_and_nothing_speaks_against_it(tmp_path):
    code, summary, said = ran(tmp_path, "--distance-m", "0.3", "--no-report")
    assert (code, summary["verdict"], summary["first_fault"]) == (0, "done", None)
    assert set(says(summary).values()) == {"for"}
    assert {"corridor", "end", "residual", "contact_lost_m", "contact_lost_times", "log", "log_dropped"} <= set(
        says(summary)
    )
    for item in summary["trust"]:
        assert set(item) == {"id", "says", "value", "limit", "unit", "text"}
    assert f"pushed {summary['distance_m']:.2f} m, lateral error {summary['lateral_error_m']:+.3f} m" in said


def test_a_push_that_ends_off_its_line_is_not_done(tmp_path):
    code, summary, said = ran(tmp_path, *TURNED, "--distance-m", "1")
    assert (code, summary["verdict"], summary["first_fault"]) == (9, "off the line", None)
    end = next(item for item in summary["trust"] if item["id"] == "end")
    assert end["says"] == "against"
    assert end["value"] == abs(summary["lateral_error_m"]) > end["limit"] == 0.3
    assert ", but off the line: " in said
    assert end["text"] in said
    page = (tmp_path / "run" / "report.html").read_text()
    assert '<h1 class="bad">Pushed 1.00 m, off the line</h1>' in page
    assert end["text"] in page


@pytest.mark.long
def test_a_wider_tolerance_of_the_rig_lets_the_same_push_be_done(tmp_path):
    words = ("--set", "goal.end_tolerance_m=1.0", "--set", "goal.corridor_m=1.0", "--no-report")
    code, summary, _ = ran(tmp_path, *TURNED, *words, "--distance-m", "4")
    assert abs(summary["lateral_error_m"]) > 0.3
    assert (code, summary["verdict"]) == (0, "done")


@pytest.mark.long
def test_a_lost_object_is_told_where_it_stands_not_where_the_pusher_is(tmp_path):
    code, summary, said = ran(tmp_path, "--distance-m", "6", "--law", "open-loop", "--no-report")
    assert (code, summary["verdict"]) == (6, "contact lost")
    assert summary["first_fault"]["id"] == "F52-hold"
    states = [STATE_CDR.decode(m.payload).slider for m in messages(tmp_path / "run" / "run.mcap", "/world/state")]
    rig = load_rig("sim")
    path = StraightPath.of(rig.path.origin_m, rig.path.direction_deg)
    assert summary["object_lateral_error_m"] == pytest.approx(path.lateral(states[-1].x, states[-1].y), abs=5 * MOCAP_M)
    turned = math.remainder(states[-1].yaw - states[0].yaw, math.tau)
    assert summary["object_turned_rad"] == pytest.approx(turned, abs=5 * math.sqrt(2) * MOCAP_RAD)
    assert abs(summary["object_lateral_error_m"] - summary["lateral_error_m"]) > 0.1
    assert f"the object: {summary['object_lateral_error_m']:+.3f} m" in said


def test_a_stop_names_its_first_cause_with_number_and_limit(tmp_path):
    code, summary, said = ran(
        tmp_path, "--distance-m", "1", "--set", "limits.max_force_N=14", "--set", "limits.slow_force_N=13"
    )
    first = summary["first_fault"]
    assert (code, summary["verdict"]) == (5, "safety stop")
    assert (first["id"], first["limit"], first["unit"]) == ("F50-stop", 14.0, "N")
    assert first["value"] > 14.0
    event = next(event for event in summary["safety_events"] if "F50-stop" in event["faults"])
    assert first["at_s"] == pytest.approx(event["t_s"], abs=0.001)
    words = f"F50-stop the force is above the limit: {first['value']:.4g} N at {first['at_s']:.1f} s, limit 14 N"
    assert words in said
    assert words in (tmp_path / "run" / "report.html").read_text()


class Drifting:
    """A world whose sensor drifts along its own z axis, which points along the push: N for each second."""

    def __init__(self, world, newton_per_s):
        self._world, self._rate = world, newton_per_s

    def read_ft(self, t_ns):
        wrench = list(self._world.read_ft(t_ns))
        wrench[2] -= self._rate * (t_ns - lockstep.START_NS) * 1e-9
        return tuple(wrench)


def test_a_sensor_that_drifts_into_contact_is_never_done(monkeypatch):
    """Nothing was touched: the object stands 1.2 m away, and the drift alone counts as contact for 0.2 m."""
    made = simulated_sensor

    def drifting(rig, world, clock):
        kept = made(rig, world, clock)
        assert isinstance(kept, SimFt300)
        return made(rig, Drifting(world, 0.25), clock)

    monkeypatch.setattr(lockstep, "simulated_sensor", drifting)
    rig = load_rig("sim")
    start = replace(rig.world, start=replace(rig.world.start, gap_m=1.2))
    rig = replace(
        rig,
        world=start,
        path=replace(rig.path, expected_contact_m=1.2),
        control=replace(rig.control, distance_m=0.2),
    )
    figures = Lockstep(rig, 0, None).run(lambda *_: None)
    trust = gather(rig, figures, Witness())
    verdict = judge(figures["exit_code"], trust)
    assert verdict.exit_code in (4, 5, 6, 9), "refused, stopped or not trusted, and never done"
    if verdict.exit_code == 9:
        assert verdict.verdict == "not trusted"
        assert "residual" in {item.id for item in trust if item.says == "against"}


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@repeated_when_the_host_stalls
def test_no_run_is_done_whose_recorder_was_lost_near_the_end(state, tmp_path, host, number):
    """Too late for F63, which waits for a second, or in time for it: never `done`, never exit 0."""
    out = tmp_path / "run"
    words = ("run", "emulated", "--distance-m", "0.3", "--out", str(out), "--json", *QUICK)
    with started(state, *words, host=host) as run:
        run.wait_for(r"(PUSH|REST) +0\.(2|3)\d/")
        recorder = json.loads((out / "processes.json").read_text())["recorder"]
        os.kill(recorder, number)
        ended = run.wait()
    summary = ended.last_object
    assert ended.code == summary["exit_code"]
    assert (ended.code, summary["verdict"]) in ((9, "not trusted"), (5, "safety stop"))
    assert says(summary)["log"] == "against"
    assert "the log is not complete: the recorder process was killed by SIGKILL" in ended.err
