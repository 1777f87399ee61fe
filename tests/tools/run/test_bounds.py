"""What is known of a run's motion before it: refused where it cannot be, and said where it can."""

from __future__ import annotations

import json

import pytest

from robot_io.errors import UsageError
from robot_io.mcap.read import read_summary
from robot_io.tick import Phase
from safety.motion_bounds import total_bounds
from tests.how_many import mostly_long
from tests.replay.runs import push
from tools.commands.run import blind_words
from tools.rig import resolve_rig
from tools.run.facts.bounds import bounds_lines, check_room
from tools.run.lockstep import Lockstep

ROOM = ("workspace.x_m=[-2, 3]", "workspace.y_m=[-2, 2]")


def refused(rig, *overrides, seed=0):
    with pytest.raises(UsageError) as caught:
        check_room(resolve_rig(rig, overrides), seed)
    assert caught.value.exit_code == 2
    return caught.value.what


def test_a_distance_that_does_not_fit_a_given_workspace_is_refused():
    """The base's front starts 0.52 m behind the ball, and it slows 0.064 m before the edge; the approach is 0.05 m.

    Without the object's pose 3 m of room leave 3.41 m of push, with it 2.4 m less the object.
    """
    blind = (*ROOM, 'base.topics.slider_pose=""')
    check_room(resolve_rig("sim", [*blind, "control.distance_m=3.40"]), 0)
    assert "3.42 m" in refused("sim", *blind, "control.distance_m=3.42")
    assert "missing" in refused("sim", *ROOM, "control.distance_m=3.40")
    check_room(resolve_rig("sim", ROOM), 0)
    assert "does not fit" in refused("sim", "workspace.polygon_m=[[-2,-2],[1,-2],[1,2],[-2,2]]")


def test_with_odometry_it_starts_where_its_frame_starts():
    """The base itself is at 0, its front at 0.48 m: 2.40 m of push fit before 3 m."""
    check_room(resolve_rig("sim", [*ROOM, "base.pose_source=odometry", "control.distance_m=2.40"]), 0)
    refused("sim", *ROOM, "base.pose_source=odometry", "control.distance_m=2.41")


def test_a_real_base_is_judged_when_it_is_seen_but_for_what_fits_nowhere():
    check_room(resolve_rig("thing", [*ROOM, "control.distance_m=5"]), 0)
    refused("thing", *ROOM, "control.distance_m=7")


def test_more_than_10_m_without_a_workspace_is_for_simulated_bases():
    check_room(resolve_rig("emulated", ["control.distance_m=11"]), 0)
    check_room(resolve_rig("thing", ["control.distance_m=10"]), 0)
    assert "10 m" in refused("thing", "control.distance_m=10.1")
    check_room(resolve_rig("thing", ["control.distance_m=15", "workspace.x_m=[-9, 90]", "workspace.y_m=[-9, 9]"]), 0)


def test_a_real_base_beside_emulated_devices_is_blind():
    assert blind_words(resolve_rig("thing")) == ""
    assert blind_words(resolve_rig("emulated")) == ""
    assert blind_words(resolve_rig("emulated", ["ft.level=hardware", "ft.port=/dev/null"])) == ""
    assert "ft of its rig is only emulated" in blind_words(resolve_rig("thing", ["ft.level=emulated"]))
    both = resolve_rig("thing", ["ft.level=emulated", "arm.level=emulated"])
    assert "ft and arm of its rig are only emulated" in blind_words(both)


def test_blind_is_refused_unless_it_is_asked_for(tmp_path):
    words = ("run", "thing", "--dry-run", "--json", "--set", "arm.level=emulated")
    done = push(*words, state=tmp_path)
    assert done.returncode == 2
    assert "--drive-blind" in json.loads(done.stdout)["error"]["do"]
    done = push(*words, "--drive-blind", state=tmp_path)
    assert done.returncode == 0
    assert "moves blind: arm" in done.stderr


def test_what_is_said_at_the_start():
    motion, phases, workspace, stopping = bounds_lines(resolve_rig("sim"))
    assert "at most 0.66 m or 28 s of approach" in phases  # 1.1 times the approach, and 0.05 m
    assert "at most, whatever is measured (F47, F48)" in motion
    assert "1 m beyond its path" in workspace
    assert "at 0.1 m/s" in stopping
    assert "3.2 cm if this computer dies" in stopping
    _, _, workspace, _, pose = bounds_lines(resolve_rig("sim", [*ROOM, "base.pose_source=odometry"]))
    assert "x -2 to 3 m, y -2 to 2 m" in workspace
    assert pose == "the pose is odometry, so it cannot be checked against it"
    assert "4 corners" in bounds_lines(resolve_rig("sim", ["workspace.polygon_m=[[0,0],[9,0],[9,9],[0,9]]"]))[2]


def test_the_same_bounds_are_in_log_summary_and_dry_run(tmp_path):
    settings = [word for setting in ROOM for word in ("--set", setting)]
    words = ("run", "sim", "--distance-m", "0.1", "--json", *settings)
    done = push(*words, "--fast", "--no-report", "--out", tmp_path / "run", state=tmp_path)
    assert done.returncode == 0, done.stderr
    dry = push(*words, "--dry-run", state=tmp_path)
    bounds = json.loads(done.stdout)["bounds"]
    assert bounds == json.loads(dry.stdout)["bounds"]
    assert bounds == json.loads((tmp_path / "run" / "summary.json").read_text())["bounds"]
    facts = next(iter(read_summary(tmp_path / "run" / "run.mcap").metadata.values()))
    assert bounds == json.loads(facts["bounds"])
    assert bounds["workspace"]["corners_m"] == [[-2.0, -2.0], [3.0, -2.0], [3.0, 2.0], [-2.0, 2.0]]
    assert bounds["stopping"]["alone_m"] == pytest.approx(0.032)
    most = total_bounds(resolve_rig("sim", ["control.distance_m=0.1"]))
    assert bounds["motion"]["distance_m"] == most.distance_m
    assert bounds["motion"]["moving_s"] == most.moving_s
    assert bounds["motion"]["phases"]["retreat_m"] == pytest.approx(1.1 * 0.05 + 0.05)
    assert bounds["pose"] == {"source": "mocap", "checked_against_odometry": True}
    for line in ("workspace: x -2 to 3 m", "stopping distance at 0.1 m/s"):
        assert line in done.stderr
        assert line in dry.stderr


# --- whole runs ---------------------------------------------------------------------------------------------------


def run(*overrides, seed=0):
    """Return the figures of a run at level sim, and its ticks."""
    rig = resolve_rig("sim", overrides)
    ticks = []
    figures = Lockstep(rig, seed, None).run(lambda inp, state, output: ticks.append((inp, state, output)))
    return figures, ticks


def test_an_object_that_is_met_late_does_not_lead_out_of_the_workspace():
    """Met 0.4 m later than expected, the push would end beyond the edge: slower, stopped, never outside."""
    edge = 1.35
    figures, ticks = run(
        f"workspace.x_m=[-2, {edge}]",
        "workspace.y_m=[-2, 2]",
        "world.start.gap_m=0.45",
        "world.start.spread=0",
        'base.topics.slider_pose=""',
        "control.distance_m=1.7",
    )
    assert figures["exit_code"] == 5
    assert ticks[-1][1].safety.first_fault == "F55-stop"
    assert "F55-slow" in figures["fault_counts"]
    furthest = max(inp.base.pose.x for inp, _, _ in ticks if inp.base.pose_valid) + 0.48
    assert edge - 0.04 < furthest < edge
    stopped = [output for _, _, output in ticks if "F55-stop" in output.faults]
    assert {(o.command_body.vx, o.command_body.vy) for o in stopped} == {(0.0, 0.0)}


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
@pytest.mark.parametrize("more", mostly_long((("path.direction_deg=137",), ("base.pose_source=odometry",), ROOM), ROOM))
def test_a_normal_push_does_not_notice_it(seed, more):
    figures, ticks = run("control.distance_m=1.5", *more, seed=seed)
    assert figures["exit_code"] == 0
    assert figures["fault_counts"] == {}
    assert ticks[-1][1].control.phase == Phase.DONE


@pytest.mark.long
@pytest.mark.parametrize("seed", range(200))
def test_200_normal_pushes_do_not_notice_it(seed):
    figures, _ = run(seed=seed)
    assert figures["exit_code"] == 0
    assert not [fault for fault in figures["fault_counts"] if fault.startswith(("F55", "R06"))]
