"""The operator's pause: the base holds, no deadline of the push runs out by it, and every check goes on."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from msgspec.structs import replace

from control import push_law
from control.notes.run_notes import RunNotes
from robot_io.messages import BodyTwist
from robot_io.tick import Mode, Operator, Phase
from tests.control.closed_loop import ClosedLoop
from tests.safety.fold_bench import FoldBench, pushing, ran_to, with_force, without_contact

MINUTE = 6000
"""Ticks of 10 ms."""
LONG_ENOUGH = pytest.mark.parametrize("ticks", [1000, pytest.param(MINUTE, marks=pytest.mark.long)])
"""Ten seconds are longer than any deadline that these tests could let run out."""
CLEAN = 102
"""The second that HOLD takes to clear, and a tick for each mode on the way down."""


def paused(inp, _=0):
    return replace(inp, paused=True)


def paused_without_contact(inp, _=0):
    return replace(without_contact(inp), paused=True)


def pause(bench, ticks, alter=paused):
    """Fold paused ticks; return the commands."""
    return [bench.fold(alter, n).command_body for n in range(ticks)]


def resting(commands):
    return [command for command in commands if command != BodyTwist()]


# --- what holds, what goes on, phase by phase --------------------------------------------------------------------


@LONG_ENOUGH
def test_a_push_holds_at_once_within_its_acceleration_limit_and_goes_on_from_rest(ticks):
    bench = pushing()
    commands = pause(bench, ticks)
    most = bench.rig.limits.max_acceleration_m_per_s2 * 0.01
    speeds = [0.1, *(math.hypot(command.vx, command.vy) for command in commands)]
    assert max(a - b for a, b in pairwise(speeds)) <= most + 1e-9
    assert resting(commands[round(0.1 / most) + 1 :]) == []
    assert (bench.output.mode, bench.output.faults, bench.state.control.phase) == (Mode.HOLD, (), Phase.PUSH)
    bench.run_until(lambda b: b.output.mode == Mode.PUSHING, most=CLEAN)
    ramp = [bench.fold().command_body.vx for _ in range(110)]
    assert ramp[0] < 0.003
    assert ramp[-1] == pytest.approx(0.1)
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0
    assert (bench.state.control.resumes, bench.state.control.lost_count) == (0, 0)


def test_the_law_is_not_asked_while_the_base_is_held(monkeypatch):
    asked = []
    law = push_law.push_angle
    monkeypatch.setattr(push_law, "push_angle", lambda *args: asked.append(args) or law(*args))
    bench = pushing()
    bench.fold()
    assert len(asked) == 1
    kept = bench.state.control
    pause(bench, 200)
    after = bench.state.control
    assert len(asked) == 1
    assert (after.theta_p, after.theta_f, after.contact.samples) == (kept.theta_p, kept.theta_f, kept.contact.samples)
    bench.run_until(lambda b: b.output.mode == Mode.PUSHING, most=CLEAN)
    bench.fold()
    assert len(asked) >= 2


@LONG_ENOUGH
def test_a_tare_goes_on_and_the_base_holds_before_the_approach(ticks):
    bench = ran_to(Phase.TARE)
    commands = pause(bench, ticks)
    assert resting(commands) == []
    assert bench.state.control.phase == Phase.APPROACH
    assert bench.state.control.tared
    assert bench.output.mode == Mode.HOLD
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0


def test_a_run_paused_before_its_devices_have_spoken_holds_before_the_approach_too():
    bench = FoldBench()
    assert resting(pause(bench, 400)) == []
    assert bench.state.control.phase == Phase.APPROACH


def test_an_approach_holds_and_neither_its_way_nor_its_time_is_used_up():
    bench = ran_to(Phase.APPROACH)
    bench.run_until(lambda b: b.output.command_body.vx >= 0.02)
    commands = pause(bench, 1000)
    assert resting(commands[20:]) == []
    motion = bench.state.safety.motion
    again = pause(bench, MINUTE)
    assert resting(again) == []
    assert bench.state.safety.motion.moving_ns == motion.moving_ns
    assert bench.state.safety.motion.sent_m == motion.sent_m
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0


def test_a_hand_on_the_ball_in_a_paused_approach_is_no_contact():
    bench = ran_to(Phase.APPROACH)
    hand = lambda inp, n: paused(with_force(inp, (30.0, 0.0, 0.0)) if n < 300 else inp)  # noqa: E731
    pause(bench, 600, hand)
    assert bench.state.control.phase == Phase.APPROACH
    assert not bench.state.control.contact_seen


def lost():
    bench = pushing(("control.force_filter_tau_s=0", "control.lost_distance_m=2"))
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST, without_contact)
    return bench


@LONG_ENOUGH
def test_no_time_and_no_way_of_a_lost_contact_runs_out(ticks):
    """2 of the 3 s of the search, a pause, and the last second of it is still there."""
    bench = lost()
    for n in range(200):
        bench.fold(without_contact, n)
    before = bench.state.control
    pause(bench, ticks, paused_without_contact)
    assert bench.state.control.phase == Phase.LOST
    assert bench.state.control.lost_ns == before.lost_ns
    bench.run_until(lambda b: b.output.mode < Mode.HOLD, without_contact, most=CLEAN)
    left = bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, without_contact)
    assert 95 <= left <= 101


@LONG_ENOUGH
def test_the_wait_for_the_operator_after_a_loss_does_not_run_out(ticks):
    """1 of its 2 s, a pause: it is still waiting, and a resume still finds it."""
    bench = lost()
    bench.run_until(lambda b: b.state.control.phase == Phase.LOST_HOLD, without_contact)
    bench.run_until(lambda b: b.state.control.rest_since_ns > 0, without_contact)
    for n in range(100):
        bench.fold(without_contact, n)
    pause(bench, ticks, paused_without_contact)
    assert bench.state.control.phase == Phase.LOST_HOLD
    for n in range(90):
        bench.fold(without_contact, n)
    assert bench.state.control.phase == Phase.LOST_HOLD
    bench.fold(lambda inp, _: replace(without_contact(inp), operator=int(Operator.RESUME)))
    assert bench.state.control.phase == Phase.LOST
    assert bench.state.control.resumes == 1, "of the three, a resume counts and a pause does not"


@LONG_ENOUGH
def test_a_retreat_holds_and_ramps_up_again(ticks):
    bench = ran_to(Phase.RETREAT, ("control.distance_m=0.1",))
    bench.run_until(lambda b: b.output.command_body.vx <= -0.02)
    commands = pause(bench, ticks)
    assert resting(commands[20:]) == []
    assert bench.state.control.phase == Phase.RETREAT
    bench.run_until(lambda b: b.output.mode == Mode.PUSHING, most=CLEAN)
    assert -0.003 < bench.fold().command_body.vx <= 0.0
    bench.run_until(lambda b: b.output.finished)
    assert bench.output.exit_code == 0


def test_coming_to_rest_and_the_last_look_go_on_and_the_base_holds_before_the_retreat():
    bench = ran_to(Phase.REST, ("control.distance_m=0.1",))
    pause(bench, 400)
    assert (bench.state.control.phase, bench.output.mode) == (Phase.RETREAT, Mode.HOLD)
    bench = ran_to(Phase.CHECK, ("control.distance_m=0.1",))
    assert bench.run_until(lambda b: b.output.finished, paused) < 1000
    assert (bench.output.exit_code, bench.state.control.phase) == (0, Phase.DONE)


# --- what still stops it -----------------------------------------------------------------------------------------


def too_much(inp, _=0):
    return paused(with_force(inp, (200.0, 0.0, 0.0)))


def silent_sensor(inp, n=0):
    return paused(replace(inp, ft=replace(inp.ft, readings=())))


def stop_key(inp, _=0):
    return paused(replace(inp, operator=int(Operator.STOP)))


@pytest.mark.parametrize(
    ("alter", "row", "within"), [(too_much, "F50-stop", 1), (silent_sensor, "F01-stop", 17), (stop_key, "F64", 1)]
)
def test_every_check_goes_on_and_is_the_first_cause(alter, row, within):
    bench = pushing()
    pause(bench, 300)
    ticks = bench.run_until(lambda b: b.output.mode == Mode.STOP, alter, most=within)
    assert ticks < within
    assert row in bench.output.faults
    assert bench.state.safety.first_fault.split("-")[0] == row.split("-")[0]
    bench.run_until(lambda b: b.output.finished, alter)
    assert bench.output.exit_code == (130 if row == "F64" else 5)


def test_a_base_that_creeps_while_it_is_paused_is_stopped():
    bench = pushing()
    pause(bench, 300)

    def creeps(inp, _):
        return paused(replace(inp, base=replace(inp.base, odometry=BodyTwist(0.05, 0.0, 0.0))))

    bench.run_until(lambda b: b.output.mode == Mode.STOP, creeps, most=40)
    assert "F33" in bench.output.faults


# --- a whole push in the world -----------------------------------------------------------------------------------


@pytest.mark.long
def test_a_push_with_many_pauses_reaches_its_end_as_without():
    """Ten pauses, six of ten seconds and one of five minutes: no fault, no loss, no resume, and the same end."""
    plain, broken = ClosedLoop(("control.distance_m=1.0",)), ClosedLoop(("control.distance_m=1.0",))
    plain.run()
    at_m = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]
    left = dict(zip(at_m, [10, 1000, 1000, 3, 1000, 30_000, 1000, 50, 1000, 1000], strict=True))
    while not broken.output or not broken.output.finished:
        due = next((m for m in at_m if broken.state.control.progress_m >= m and left[m]), None)
        broken.paused = due is not None
        if due is not None:
            left[due] -= 1
        broken.step()
    assert not any(left.values())
    assert broken.output.exit_code == plain.output.exit_code == 0
    assert broken.faults_seen == plain.faults_seen == {}
    control = broken.state.control
    assert (control.resumes, control.lost_count) == (0, 0)
    assert control.end_progress_m == pytest.approx(plain.state.control.end_progress_m, abs=0.01)
    assert control.end_lateral_m == pytest.approx(plain.state.control.end_lateral_m, abs=0.02)


def test_the_notes_of_a_run_count_pauses_and_their_length():
    bench, notes = pushing(), RunNotes()
    for n in range(400):
        bench.fold(paused if 50 <= n < 150 or 300 <= n < 350 else None, n)
        notes.note(bench.inp, bench.state, bench.output)
    assert notes.figures()["pauses"] == 2
    assert notes.figures()["paused_s"] == pytest.approx(1.5, abs=0.03)
