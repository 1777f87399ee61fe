"""The supervisor by itself: the strongest reaction wins at once, lets go slowly, and STOP and DEAD never let go."""

import math
from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import ControlState, Mode, Operator, Phase, SafetyState
from safety import supervisor
from safety.faults import FAULTS, Clears, strongest
from safety.supervisor import give_up, supervise
from tests.safety.fault_scenarios import base, old, operator
from tests.safety.fold_bench import PERIOD_NS, FoldBench, pushing

MODES = list(Mode)
RAISED = [row for row in FAULTS if row not in ("F65", "F66")]
GOOD = FoldBench().good_input()
SETTINGS = FoldBench().core.safety
PUSHING = ControlState(phase=int(Phase.PUSH), speed=0.1)


@pytest.fixture
def say(monkeypatch):
    """Return a way to run one tick of the supervisor with given faults and nothing else."""
    found = []
    monkeypatch.setattr(supervisor, "_gather", lambda s, state, inp, *rest: (state, list(found)))

    def one_tick(state, faults, *, now_ns=GOOD.now_ns, control=PUSHING, inp=GOOD):
        found[:] = faults
        return supervise(SETTINGS, state, replace(inp, now_ns=now_ns), control, BodyTwist(), False)

    return one_tick


def test_every_mode_with_every_fault_and_every_pair(say):
    """From any mode, any set of up to two faults: never below the strongest, never two steps down, STOP for ever."""
    sets = [(), *((row,) for row in RAISED), *combinations(RAISED, 2)]
    for mode in MODES:
        cause = {Mode.STOP: ("F69",), Mode.DEAD: ("F23",)}.get(mode, ())
        state = SafetyState(mode=int(mode), latched=cause)
        for faults in sets:
            after, verdict = say(state, faults)
            asked = strongest(faults)
            assert verdict.mode >= asked
            assert verdict.mode == after.mode
            if mode >= Mode.STOP:
                assert verdict.mode == max(mode, asked)
            elif mode > Mode.PUSHING:
                assert verdict.mode == max(mode, asked)  # escalates at once; clean for no time at all, so stays
            else:
                assert verdict.mode == max(asked, Mode.PUSHING)
            assert set(verdict.faults) == {*cause, *faults}
            assert set(after.latched) == {*cause, *(f for f in faults if FAULTS[f].clears == Clears.LATCHED)}


def test_letting_go_takes_a_clean_second_and_one_mode_a_tick(say):
    state, now = SafetyState(mode=int(Mode.PUSHING)), GOOD.now_ns
    state, verdict = say(state, ["F01-hold"], now_ns=now)
    assert verdict.mode == Mode.HOLD
    modes = []
    for k in range(1, 110):
        state, verdict = say(state, [], now_ns=now + k * PERIOD_NS)
        modes.append(verdict.mode)
    assert modes[:100] == [Mode.HOLD] * 100
    assert modes[100:103] == [Mode.SLOW, Mode.PUSHING, Mode.PUSHING]


def test_a_new_fault_restarts_the_second_and_a_weaker_one_does_not_let_go(say):
    state, now = SafetyState(mode=int(Mode.PUSHING)), GOOD.now_ns
    state, _ = say(state, ["F01-hold"], now_ns=now)
    for k in range(1, 90):
        state, verdict = say(state, [], now_ns=now + k * PERIOD_NS)
    state, verdict = say(state, ["F40-slow"], now_ns=now + 90 * PERIOD_NS)
    assert verdict.mode == Mode.HOLD
    for k in range(91, 191):
        state, verdict = say(state, ["F52", "F36"], now_ns=now + k * PERIOD_NS)  # warnings do not count
        assert verdict.mode == Mode.HOLD
    _, verdict = say(state, [], now_ns=now + 191 * PERIOD_NS)
    assert verdict.mode == Mode.SLOW


@settings(deadline=None, max_examples=150)
@given(st.data())
def test_over_any_sequence_of_faults(data):
    sequence = data.draw(st.lists(st.lists(st.sampled_from(RAISED), max_size=2), max_size=60))
    phases = data.draw(st.lists(st.sampled_from(list(Phase)), min_size=len(sequence), max_size=len(sequence)))
    gaps = data.draw(st.lists(st.sampled_from([1, 1, 1, 50, 101]), min_size=len(sequence), max_size=len(sequence)))
    state, now, found = SafetyState(), GOOD.now_ns, []
    original = supervisor._gather
    supervisor._gather = lambda s, state, inp, *rest: (state, list(found))
    try:
        for faults, phase, gap in zip(sequence, phases, gaps, strict=True):
            now += gap * PERIOD_NS
            found[:] = faults
            before = state
            state, verdict = supervise(
                SETTINGS, state, replace(GOOD, now_ns=now), ControlState(phase=int(phase)), BodyTwist(), False
            )
            working = phase not in (Phase.SETTLE, Phase.TARE, Phase.DONE, Phase.FAILED)
            asked = strongest((*faults, *state.latched))
            assert set(before.latched) <= set(state.latched)
            assert set(faults) <= set(verdict.faults)
            if before.mode >= Mode.STOP:
                assert verdict.mode >= before.mode
            if asked >= Mode.STOP or working:
                assert verdict.mode >= asked
            if working and before.mode > Mode.PUSHING:
                assert verdict.mode >= before.mode - 1
            if verdict.mode < before.mode and working and before.mode > Mode.PUSHING:
                assert now - before.clean_since_ns >= 10**9
    finally:
        supervisor._gather = original


# --- modes of a run without faults -----------------------------------------------------------------------------


@pytest.mark.parametrize("phase", list(Phase))
def test_the_working_mode_of_each_phase(say, phase):
    _, verdict = say(SafetyState(), [], control=ControlState(phase=int(phase)))
    expected = {
        Phase.SETTLE: Mode.SILENT, Phase.TARE: Mode.READY, Phase.DONE: Mode.READY, Phase.FAILED: Mode.READY,
    }  # fmt: skip
    assert verdict.mode == expected.get(phase, Mode.PUSHING)
    assert verdict.finished == (phase in (Phase.DONE, Phase.FAILED))
    assert verdict.exit_code == (6 if phase == Phase.FAILED else 0)


def test_a_fault_before_anything_moves_does_not_leave_the_mode_of_its_phase(say):
    for phase, mode in ((Phase.SETTLE, Mode.SILENT), (Phase.TARE, Mode.READY)):
        _, verdict = say(SafetyState(mode=int(mode)), ["F40-slow"], control=ControlState(phase=int(phase)))
        assert verdict.mode == mode


@pytest.mark.parametrize("phase", list(Phase))
@pytest.mark.parametrize(("fault", "mode"), [("F50-stop", Mode.STOP), ("F23", Mode.DEAD)])
def test_a_stop_is_a_stop_in_every_phase(say, phase, fault, mode):
    control = ControlState(phase=int(phase))
    state, verdict = say(SafetyState(), [fault], control=control)
    assert verdict.mode == mode
    state, verdict = say(state, [], control=control, now_ns=GOOD.now_ns + 5 * 10**9)
    assert verdict.mode == mode


def test_without_faults_a_push_stays_in_its_mode(say):
    state = SafetyState(mode=int(Mode.PUSHING))
    for k in range(300):
        state, verdict = say(state, [], now_ns=GOOD.now_ns + k * PERIOD_NS)
        assert verdict.mode == Mode.PUSHING


# --- the end of a run --------------------------------------------------------------------------------------------


def test_a_stop_ends_the_run_300_ms_after_when_the_base_rests():
    bench = pushing()
    ticks = bench.run_until(lambda b: b.output.finished, operator(Operator.STOP))
    assert ticks == 30
    assert bench.output.exit_code == 130
    assert bench.output.mode == Mode.STOP


@pytest.mark.parametrize("twist", [BodyTwist(0.01, 0.0, 0.0), BodyTwist(0.0, -0.01, 0.0), BodyTwist(float("nan"))])
def test_a_stop_waits_for_rest_but_not_for_ever(twist):
    bench = pushing()
    rolling = base(odometry=twist)
    bench.fold(operator(Operator.STOP))
    ticks = bench.run_until(lambda b: b.output.finished, rolling)
    assert ticks == 149


def test_the_first_of_equal_causes_gives_the_exit_code_and_a_stronger_one_overrules_it(say):
    state, now = SafetyState(), GOOD.now_ns
    state, _ = say(state, ["F64"], now_ns=now)
    state, verdict = say(state, ["F50-stop", "F68"], now_ns=now + PERIOD_NS)
    assert verdict.exit_code == 130
    _, verdict = say(state, ["F34"], now_ns=now + 2 * PERIOD_NS)
    assert verdict.exit_code == 5  # the base rolled on: that was no clean end


def test_a_hold_that_cannot_clear_ends_the_run_after_two_seconds_at_zero():
    bench = pushing()
    bad = lambda inp, _: replace(inp, host=replace(inp.host, recorder_alive=False))  # noqa: E731
    bench.run_until(lambda b: b.output.mode == Mode.HOLD, bad)
    assert "F63" in bench.output.faults
    rest = bench.run_until(lambda b: b.output.command_body == BodyTwist(), bad)
    ticks = bench.run_until(lambda b: b.output.finished)
    assert rest < 12
    assert ticks == 199
    assert bench.output.exit_code == 5
    assert bench.output.mode == Mode.HOLD


# --- an exception in the loop --------------------------------------------------------------------------------------


def test_an_exception_in_a_tick_ends_it_without_computing_anything_of_it():
    bench = pushing()
    before = bench.state
    failed = lambda inp, _: replace(  # noqa: E731
        inp, host=replace(inp.host, loop_error=True), base=replace(inp.base, pose=None)
    )
    bench.fold(failed)  # a pose of None would fail in any of the checks
    output = bench.output
    assert (output.finished, output.exit_code, output.faults) == (True, 1, ("F68",))
    assert output.mode == FAULTS["F68"].mode
    assert output.command_body == output.wanted_body == BodyTwist()
    assert bench.state.control == before.control
    assert bench.state.envelope.last == BodyTwist()
    assert "F68" in bench.state.safety.latched
    assert bench.state.safety.stop_since_ns == bench.inp.now_ns


def test_an_exception_after_a_stop_keeps_what_came_first():
    stopped = SafetyState(mode=int(Mode.DEAD), latched=("F23",), stop_since_ns=123)
    state, verdict = give_up(stopped, GOOD)
    assert verdict.mode == Mode.DEAD
    assert verdict.faults == ("F23", "F68")
    assert state.stop_since_ns == 123


def test_an_exception_is_the_first_cause_of_a_run_that_had_none():
    state, verdict = give_up(SafetyState(mode=int(Mode.PUSHING)), GOOD)
    assert (verdict.finished, verdict.exit_code) == (True, 1)
    assert (state.first_fault, state.first_fault_ns) == ("F68", GOOD.now_ns)
    assert state.mode == FAULTS["F68"].mode == Mode.STOP


# --- the first cause -----------------------------------------------------------------------------------------------


def test_what_held_the_run_is_the_first_cause_until_it_goes_on(say):
    state, _ = say(SafetyState(mode=int(Mode.PUSHING)), ("F24-hold",))
    assert (state.first_fault, state.first_fault_ns) == ("F24-hold", GOOD.now_ns)
    for n in range(1, 100):  # held, and clean for less than a second
        state, verdict = say(state, (), now_ns=GOOD.now_ns + n * PERIOD_NS)
        assert (verdict.mode, state.first_fault, state.first_fault_ns) == (Mode.HOLD, "F24-hold", GOOD.now_ns)
    while verdict.mode >= Mode.HOLD:
        n += 1
        state, verdict = say(state, (), now_ns=GOOD.now_ns + n * PERIOD_NS)
    assert (state.first_fault, state.first_fault_ns) == ("", 0)
    assert math.isnan(state.first_value)


def test_a_first_cause_that_the_run_went_on_from_is_forgotten_with_its_number(say):
    for mode in (Mode.PUSHING, Mode.SLOW):
        before = SafetyState(mode=int(mode), first_fault="F24-hold", first_value=41.0, first_fault_ns=123)
        slow = ("F40-slow",) if mode == Mode.SLOW else ()
        state, verdict = say(before, slow)
        assert verdict.mode == mode
        assert (state.first_fault, state.first_fault_ns) == ("", 0)
        assert math.isnan(state.first_value)


# --- a pause of the host -----------------------------------------------------------------------------------------

EVERYONE_SILENT = lambda inp, n: replace(  # noqa: E731
    old("arm", "published_ns", "changed_ns")(
        old("base", "published_ns", "odometry_received_ns", "pose_received_ns", "newest_inbound_ns")(inp, n), n
    ),
    ft=replace(inp.ft, readings=()),
)


def paused(periods: int):
    """Skip `periods` ticks, then fold the first tick after, in which no device has said anything new."""
    bench = pushing()
    bench.skip(periods)
    bench.fold(
        lambda inp, _: replace(
            EVERYONE_SILENT(inp, periods), host=replace(inp.host, skipped=periods, late_ns=1_000_000)
        )
    )
    return bench


def test_a_pause_of_the_host_is_not_taken_for_dead_devices():
    bench = paused(30)  # 300 ms: long enough for every stop of every device
    # F52: the newest force is too old for the law; that is no judgement on the sensor and ends with its next packet.
    assert bench.output.faults == ("F60-late", "F60-slow", "F52")
    assert bench.output.mode == Mode.SLOW
    bench.fold()
    assert bench.output.faults == ()


def test_one_skipped_tick_is_a_pause():
    """After 20 ms without a tick an arm that was silent for 80 ms is judged by its next chance to speak."""
    bench = pushing()
    bench.skip(1)
    bench.fold(
        lambda inp, n: replace(old("arm", "published_ns", "changed_ns")(inp, 7), host=replace(inp.host, skipped=1))
    )
    assert bench.output.faults == ("F60-late",)
    bench.fold(lambda inp, n: old("arm", "published_ns", "changed_ns")(inp, 8))
    assert bench.output.faults == ("F24-hold",)


def test_devices_still_silent_a_tick_later_are_held_and_after_that_stopped():
    bench = paused(30)
    bench.fold(lambda inp, _: EVERYONE_SILENT(inp, 31))
    assert set(bench.output.faults) == {"F01-hold", "F24-hold", "F31-hold", "F40-slow", "F52"}
    assert bench.output.mode == Mode.HOLD
    assert bench.state.safety.latched == ()
    bench.fold(lambda inp, _: EVERYONE_SILENT(inp, 32))
    assert {"F01-stop", "F24-stop", "F31-stop", "F40-stop", "F67-late"} <= set(bench.output.faults)
    assert bench.output.mode == Mode.STOP


def test_a_soft_row_after_a_pause_stays_what_it_is():
    bench = paused(4)
    bench.fold(lambda inp, _: EVERYONE_SILENT(inp, 5))
    assert set(bench.output.faults) == {"F01-slow", "F24-hold", "F40-slow"}
    assert bench.output.mode == Mode.HOLD


def test_a_device_that_comes_back_in_that_tick_lets_the_run_go_on():
    bench = paused(30)
    bench.fold(lambda inp, _: EVERYONE_SILENT(inp, 31))
    modes = set()
    for _ in range(130):
        bench.fold()
        modes.add(Mode(bench.output.mode))
    assert bench.output.faults == ()
    assert bench.output.mode == Mode.PUSHING
    assert modes == {Mode.HOLD, Mode.SLOW, Mode.PUSHING}


def test_a_pause_excuses_no_fault_that_is_not_of_age():
    bench = pushing()
    bench.skip(5)
    bench.fold(
        lambda inp, _: replace(
            inp, host=replace(inp.host, skipped=5), ft=replace(inp.ft, link=3), operator=int(Operator.STOP)
        )
    )
    assert {"F02", "F64"} <= set(bench.output.faults)


def test_a_loop_that_skips_every_other_period_still_sees_a_dead_sensor():
    """A slow machine has no pause to excuse: the second skipping tick in a row is judged as usual."""
    bench = pushing()

    def slow(inp, n):
        return replace(inp, host=replace(inp.host, skipped=1), ft=replace(inp.ft, readings=()))

    for n in range(12):
        bench.skip(1)
        bench.fold(slow, n)
        if bench.output.mode >= Mode.STOP:
            break
    assert "F01-stop" in bench.output.faults
    assert n <= 8  # 160 ms at 20 ms a tick


def test_a_second_skipping_tick_in_a_row_is_no_pause_any_more():
    """One pause is forgiven for one tick; where the next tick skips as well, silent devices are held."""
    bench = paused(30)
    bench.skip(1)
    bench.fold(lambda inp, _: replace(EVERYONE_SILENT(inp, 32), host=replace(inp.host, skipped=1)))
    assert {"F01-hold", "F24-hold", "F31-hold"} <= set(bench.output.faults)
    assert bench.output.mode == Mode.HOLD
    bench.skip(1)
    bench.fold(lambda inp, _: replace(EVERYONE_SILENT(inp, 34), host=replace(inp.host, skipped=1)))
    assert {"F01-stop", "F24-stop", "F31-stop"} <= set(bench.output.faults)
    assert bench.output.mode == Mode.STOP


# --- a start in the middle of the sensor's rhythm ----------------------------------------------------------------


@pytest.mark.parametrize("quiet_ticks", [1, 2])
def test_a_tick_without_a_packet_is_no_dead_sensor_when_everyone_has_just_spoken(quiet_ticks):
    """The last device to speak may do so between two packets of the sensor (bursts of 16 ms do that)."""
    bench = FoldBench()
    for _ in range(19):
        bench.fold()
    for n in range(quiet_ticks):
        bench.fold(lambda inp, _: replace(inp, ft=replace(inp.ft, readings=())), n)
        assert bench.output.faults == ()
    assert bench.state.control.phase == Phase.TARE
    bench.run_to(Phase.APPROACH)


def test_note_command_counts_from_the_first_zero():
    state = supervisor.note_command(SafetyState(), BodyTwist(0.1, 0.0, 0.0), 5)
    assert state.zero_since_ns == 0
    state = supervisor.note_command(state, BodyTwist(), 6)
    state = supervisor.note_command(state, BodyTwist(), 7)
    assert state.zero_since_ns == 6
    assert supervisor.note_command(state, BodyTwist(0.0, 0.0, 0.01), 8).zero_since_ns == 0
