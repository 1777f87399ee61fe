"""Every row of the fault table: noticed in time, reacted to as it says, cleared only as it says; no row untested."""

import math
from functools import cache

import pytest
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import ControlState, Mode
from safety.checks import task_checks
from safety.faults import FAULTS, Clears, strongest
from tests.safety.fault_scenarios import BY_THE_GATE, SCENARIOS, Scenario
from tests.safety.fold_bench import FoldBench, pushing
from tests.safety.removed_checks import install, places, remove, without
from tools.faults.judgement import judged
from tools.faults.lockstep_round import run_lockstep
from tools.faults.scenarios import SCENARIOS as PROVED

ids = [str(s) for s in SCENARIOS]


def size(twist: BodyTwist) -> float:
    return math.hypot(twist.vx, twist.vy)


@cache
def begun(scenario: Scenario) -> FoldBench:
    return scenario.start()


def ticks_to(scenario: Scenario, most: int) -> tuple[FoldBench, int | None, float]:
    """Return the bench at the first tick that names the row, how many ticks that took, and the speed before."""
    bench = begun(scenario).copy()
    n = 0
    for n in range(scenario.warm):
        scenario.before(bench)
        bench.fold(scenario.alter, n)
        assert scenario.row not in bench.output.faults, f"already after {n} ticks"
    speed = size(bench.output.command_body) if bench.output else 0.0
    for n in range(most + 1):
        scenario.before(bench)
        bench.fold(scenario.alter, scenario.warm + n)
        if scenario.row in bench.output.faults:
            return bench, n, speed
    return bench, None, speed


def family(row: str) -> str:
    return row.partition("-")[0]


@pytest.mark.parametrize("scenario", SCENARIOS, ids=ids)
def test_the_row_is_noticed_in_time_and_reacted_to(scenario):
    row = FAULTS[scenario.row]
    patience = row.bound_ticks if row.mode != Mode.SILENT else 300  # a warning has no bound
    bench, ticks, speed = ticks_to(scenario, patience)
    assert ticks is not None, f"not noticed within {patience} ticks: {bench.output.faults}"
    others = {f for f in bench.output.faults if family(f) != family(scenario.row)} - scenario.also
    assert not others
    command = bench.output.command_body
    if row.mode == Mode.SILENT:
        assert bench.output.mode <= Mode.PUSHING
        assert size(command) == pytest.approx(speed, abs=0.011)
    else:
        assert bench.output.mode >= row.mode
    if row.mode >= Mode.STOP:
        assert command == BodyTwist()
    elif row.mode >= Mode.SLOW:
        assert size(command) < speed or command == BodyTwist()


EVIDENCE = {
    "F01-slow": 5, "F01-hold": 8, "F01-stop": 16, "F06": 30, "F21": 1, "F24-hold": 4, "F25-hold": 4, "F25-stop": 10,
    "F31-hold": 10, "F31-stop": 25, "F33": 30, "F34": 34, "F35": 3, "F38-late": 300, "F40-slow": 5, "F40-stop": 12,
    "F41": 2, "F49": 3, "F56": 20, "F63": 100, "F63 records lost": 0, "F73-hold": 50, "F73-stop": 200,
    "F67-late": 10, "F24-stop no record": 10, "F60-slow three in a row": 2, "R01": 1,
    "F04 half of the packets": 8, "F04 one in four": 16, "F08": 1, "F11": 19, "F11 pulls": 18, "F12-low": 86,
    "F12-hold": 86, "F52": 1, "F52-hold": 1, "F54-stop": 48,
}  # fmt: skip
"""Ticks of bad input without which a row must not be raised; all others speak in the first tick."""
WITHOUT_EVIDENCE = ("F09", "F09-before", "F36", "F53-early")
"""Rows whose scenario begins before there can be anything to see."""


BY_WAY = ("F33-way", "F37", "F43", "F56-way", "F59")
"""Rows that go by the way, not by the time: see the tests of these checks."""


@pytest.mark.parametrize("scenario", [s for s in SCENARIOS if s.row not in (*WITHOUT_EVIDENCE, *BY_WAY)], ids=str)
def test_the_row_is_not_raised_before_there_is_evidence(scenario):
    expected = EVIDENCE.get(str(scenario), EVIDENCE.get(scenario.row, 0))
    assert ticks_to(scenario, 300)[1] == expected


@pytest.mark.parametrize("scenario", [s for s in SCENARIOS if FAULTS[s.row].clears == Clears.LATCHED], ids=str)
def test_a_latched_row_ends_the_run_although_all_is_well_again(scenario):
    row = FAULTS[scenario.row]
    bench, _, _ = ticks_to(scenario, 300)
    bench.odometry = BodyTwist()  # the base stands in the end
    last = size(bench.output.command_body)
    for _ in range(300):
        if bench.output.finished:
            break
        bench.fold()
        assert scenario.row in bench.output.faults
        assert bench.output.mode >= row.mode
        assert size(bench.output.command_body) <= last
        last = size(bench.output.command_body)
    assert bench.output.finished
    assert bench.output.command_body == BodyTwist()
    assert bench.output.exit_code == row.exit_code


CLEARING = [
    s for s in SCENARIOS if FAULTS[s.row].clears == Clears.AUTO and FAULTS[s.row].mode in (Mode.SLOW, Mode.HOLD)
]


@pytest.mark.parametrize("scenario", [s for s in CLEARING if not s.row.startswith(("F52", "F53"))], ids=str)
def test_a_passing_row_clears_after_one_clean_second_one_mode_a_tick(scenario):
    row = FAULTS[scenario.row]
    bench, _, speed = ticks_to(scenario, 300)
    modes = [Mode(bench.output.mode)]
    for _ in range(240):  # the clean second, and a second to ramp up again
        bench.fold()
        modes.append(Mode(bench.output.mode))
    assert bench.output.faults == ()
    assert modes[0] == row.mode
    assert modes[1 : 1 + 100] == [row.mode] * 100  # a whole clean second
    assert modes[-1] == Mode.PUSHING
    after = [m for m in modes if m < row.mode]
    assert [modes[101 + i] for i in range(row.mode - Mode.PUSHING)] == [
        Mode(row.mode - 1 - i) for i in range(row.mode - Mode.PUSHING)
    ]
    assert after
    assert size(bench.output.command_body) == pytest.approx(speed, abs=1e-3)


def test_every_row_has_a_scenario_or_a_reason():
    assert set(FAULTS) == {s.row for s in SCENARIOS} | set(BY_THE_GATE)
    assert not {s.row for s in SCENARIOS} & set(BY_THE_GATE)


def test_the_table_says_what_it_means():
    for key, row in FAULTS.items():
        assert key == row.id
        assert (row.mode == Mode.SILENT) == (row.bound_ticks == 0 and key != "F68")
        assert row.exit_code in (1, 2, 4, 5, 6, 130)
        if row.mode >= Mode.STOP:
            assert row.clears == Clears.LATCHED
    assert strongest(()) == Mode.SILENT
    assert strongest(("F50-slow", "F23", "F64")) == Mode.DEAD


# --- the test of the tests: without its check, a row goes unnoticed -----------------------------------------------

PLACES = places()


@pytest.mark.parametrize(("row", "module", "index"), PLACES, ids=[f"{r} in {m} {i}" for r, m, i in PLACES])
def test_without_its_check_a_row_goes_unnoticed(row, module, index, monkeypatch):
    scenarios = [s for s in SCENARIOS if s.row == row]
    for scenario in scenarios:
        begun(scenario)  # with all checks in place
    install(without(row, module, index), module, monkeypatch)
    missed = []
    for scenario in scenarios:
        try:
            missed.append(ticks_to(scenario, max(FAULTS[row].bound_ticks, 40))[1] is None)
        except AssertionError:  # a scenario that can no longer even begin
            missed.append(True)
    assert any(missed)


def test_every_row_has_a_check_to_remove():
    by_give_up = {"F68"}  # raised by the fold itself
    rows = {row for row, _, _ in PLACES}
    assert set(FAULTS) - rows - set(BY_THE_GATE) - by_give_up == set()


@pytest.mark.long
@pytest.mark.parametrize("row", FAULTS)
def test_without_its_checks_a_row_is_not_proved(row, monkeypatch):
    """`push faults --run` notices, in each of the row's scenarios, although other rows may stop the base instead."""
    remove(row, monkeypatch)
    for scenario in (one for one in PROVED if one.row == row):
        assert not judged(scenario, run_lockstep(scenario)).passed, scenario.what


def test_one_jump_told_again_and_again_is_one_jump():
    """A pose message is judged once, however many ticks see it; the next good one clears it."""
    bench = pushing()
    jumped = bench.good_input().base.pose

    def same_message(inp, _):
        pose = replace(jumped, x=jumped.x + 0.2)
        return replace(inp, base=replace(inp.base, pose=pose, pose_seq=bench_seq))

    bench_seq = bench.tick + 1
    for n in range(4):
        bench.fold(same_message, n)
        assert bench.state.safety.pose_jumps == 1
    bench.fold()
    assert bench.state.safety.pose_jumps == 0
    assert bench.output.faults == ()


def test_a_wanted_velocity_that_is_no_number_is_a_fault_by_itself():
    inp = FoldBench().good_input()
    for bad in (BodyTwist(math.nan, 0.0, 0.0), BodyTwist(0.0, math.inf, 0.0), BodyTwist(0.0, 0.0, -math.inf)):
        assert task_checks.check(inp, ControlState(phase=3), bad, inp.now_ns) == ["F58"]
    assert task_checks.check(inp, ControlState(phase=3), BodyTwist(), inp.now_ns) == []
    assert task_checks.check(replace(inp, tick=1), ControlState(phase=9), BodyTwist(), inp.now_ns) == []
