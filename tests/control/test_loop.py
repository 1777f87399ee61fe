"""The loop's own handlers, one at a time: what the operator's pipe means, a flood of packets, and its deadlines."""

import os
from types import SimpleNamespace

import pytest

from control.loop import ControlLoop, Watch
from robot_io.messages import DeviceHealth, LinkState, SensorWrench, Stamped
from robot_io.tick import TICK_CDR, Operator, TickState
from tests.safety.fold_bench import FoldBench
from tools.replay.difference import difference


class Sensor:
    """Gives what the test has put into it."""

    def __init__(self) -> None:
        self.arrived: list[Stamped[SensorWrench]] = []

    def fileno(self) -> int:
        return -1

    def drain(self) -> tuple[Stamped[SensorWrench], ...]:
        arrived, self.arrived = tuple(self.arrived), []
        return arrived

    def health(self) -> DeviceHealth:
        return DeviceHealth(LinkState.UP, "", {"packets_ok": 0}, 100.0)


@pytest.fixture
def bench():
    heard, told = os.pipe()
    os.set_blocking(heard, False)
    sensor = Sensor()
    loop = ControlLoop(
        lambda state, inp: (state, None),
        TickState(),
        rate_hz=100.0,
        sensor_rate_hz=100.0,
        sensor=sensor,
        arm=SimpleNamespace(read=lambda: None),
        base=SimpleNamespace(alive=True, read=lambda: None),
        ring=SimpleNamespace(dropped=0, consumed=0, unread=0),
        watch=Watch(),
        operator_fd=heard,
        on_status=lambda *_: None,
    )
    bench = SimpleNamespace(loop=loop, sensor=sensor, told=told)
    yield bench
    loop._loop.close()
    os.close(heard)
    if bench.told >= 0:
        os.close(bench.told)


@pytest.mark.parametrize(
    ("typed", "operator"),
    [(b"S", Operator.STOP), (b"R", Operator.RESUME), (b"RS", Operator.STOP), (b"SR", Operator.STOP), (b"?", 0)],
)
def test_the_next_tick_hears_the_operator_once_and_a_stop_above_all(bench, typed, operator):
    os.write(bench.told, typed)
    bench.loop._on_operator(0)
    heard = [bench.loop._input(0, 0, 0).operator for _ in range(2)]
    assert heard == [operator, Operator.NONE]


@pytest.mark.parametrize(("typed", "paused"), [(b"P", True), (b"PC", False), (b"PCP", True), (b"HPR", True)])
def test_a_pause_lasts_until_it_is_taken_back(bench, typed, paused):
    os.write(bench.told, typed)
    bench.loop._on_operator(0)
    assert [bench.loop._input(0, 0, 0).paused for _ in range(3)] == [paused] * 3


def test_a_launcher_that_is_gone_is_a_stop(bench):
    bench.loop._loop.add_fd(bench.loop._operator_fd, bench.loop._on_operator)
    os.close(bench.told)
    bench.told = -1
    bench.loop._loop.run_once(1000)
    assert bench.loop._input(0, 0, 0).operator == Operator.STOP


def test_a_log_that_cannot_be_written_is_a_recorder_that_is_gone(bench):
    assert bench.loop._input(0, 0, 0).host.recorder_alive
    os.write(bench.told, b"L")
    bench.loop._on_operator(0)
    inp = bench.loop._input(0, 0, 0)
    assert (inp.host.recorder_alive, inp.operator) == (False, Operator.NONE)


def test_of_a_flood_the_newest_packets_stay(bench):
    wrench = SensorWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for first in (0, 50, 100):
        bench.sensor.arrived = [Stamped(wrench, first + i, 0) for i in range(50)]
        bench.loop._collect()
    seqs = [reading.seq for reading in bench.loop._input(0, 0, 0).ft.readings]
    assert seqs == list(range(150 - 64, 150))
    assert bench.loop._input(0, 0, 0).ft.readings == ()


def late_by(bench, *lates_ms):
    """Let the loop's deadlines, of 10 ms each, be served so late; return number and skipped periods of each tick."""
    loop, now_ns = bench.loop, [5_000_000_000]
    loop._clock = lambda: now_ns[0]
    ticks = []
    loop._one_tick = lambda inp: ticks.append((inp.tick, inp.host.skipped, inp.host.late_ns))
    deadline_ns = now_ns[0]
    for late_ms in lates_ms:
        now_ns[0] = deadline_ns + round(late_ms * 1e6)
        loop._on_deadline(deadline_ns)
        deadline_ns = loop._timer.deadline_ns
        loop._timer.cancel()
    return ticks


def test_ticks_count_from_zero_and_every_skipped_period_is_one(bench):
    """A tick's number tells its time: 25 ms late is two periods skipped and 5 ms late, and the grid stays."""
    assert late_by(bench, 0, 0, 25, 0, 10, 0) == [
        (0, 0, 0),
        (1, 0, 0),
        (4, 2, 5_000_000),
        (5, 0, 0),
        (7, 1, 0),
        (8, 0, 0),
    ]


def test_the_loop_wakes_early_and_waits_awake_for_its_deadline(bench, monkeypatch):
    """150 us before each deadline; the tick begins on it, and the grid of 10 ms stays."""
    loop, now_ns = bench.loop, [5_000_000_000]

    def clock():
        now_ns[0] += 40_000
        return now_ns[0]

    monkeypatch.setattr(loop, "_clock", clock)
    monkeypatch.setattr(loop._loop, "run", lambda: None)
    sensor_in, sensor_out = os.pipe()
    monkeypatch.setattr(bench.sensor, "fileno", lambda: sensor_in)
    lates = []
    monkeypatch.setattr(loop, "_one_tick", lambda inp: lates.append((inp.host.late_ns, inp.host.skipped)))
    loop.run(150.0)
    assert loop._timer.deadline_ns == loop.first_ns - 150_000
    loop._timer.cancel()
    now_ns[0] = loop.first_ns - 150_000  # the clock then reads 110, 70 and 30 us before, and 10 us after
    loop._on_deadline(loop.first_ns - 150_000)
    assert lates == [(10_000, 0)]
    assert loop._timer.deadline_ns == loop.first_ns + 10_000_000 - 150_000
    os.close(sensor_in)
    os.close(sensor_out)


@pytest.mark.parametrize(
    ("alive", "gone", "seen"),
    [(True, (), True), (False, (), False), (True, ("gate",), False), (True, ("arm", "recorder"), True)],
)
def test_the_gate_is_alive_while_its_link_and_its_process_are(bench, alive, gone, seen):
    """A socket that is closed is enough: the process may live on."""
    bench.loop._base.alive = alive
    bench.loop._watch.gone.update(gone)
    assert bench.loop._input(0, 0, 0).host.gate_alive is seen


def silences(bench, *steps):
    """Let ticks of 10 ms pass and return what each says of launcher and recorder, in ms.

    Each step is (late by ms, bytes from the launcher, bytes consumed, bytes unread).
    """
    loop, now_ns = bench.loop, [5_000_000_000]
    loop._clock = lambda: now_ns[0]
    loop._launcher.heard(now_ns[0])
    loop._recorder.heard(now_ns[0])
    seen = []
    loop._one_tick = lambda inp: seen.append((inp.host.launcher_silent_ns / 1e6, inp.host.recorder_silent_ns / 1e6))
    deadline_ns = now_ns[0]
    for late_ms, typed, consumed, unread in steps:
        now_ns[0] = deadline_ns + round(late_ms * 1e6)
        os.write(bench.told, typed)
        loop._ring.consumed, loop._ring.unread = consumed, unread
        loop._on_deadline(deadline_ns)
        deadline_ns = loop._timer.deadline_ns
        loop._timer.cancel()
    return seen


def test_the_launcher_is_silent_since_its_last_byte(bench):
    beats = (b"", b"", b"H", b"", b"HH", b"", b"R")
    assert [launcher for launcher, _ in silences(bench, *((0, beat, 0, 0) for beat in beats))] == [
        0,
        10,
        0,
        10,
        0,
        10,
        0,
    ]


def test_the_recorder_is_silent_while_records_wait_and_it_takes_none(bench):
    steps = [
        (0, b"", 100, 0),
        (0, b"", 100, 50),
        (0, b"", 100, 90),
        (0, b"", 150, 90),
        (0, b"", 150, 99),
        (0, b"", 150, 0),
    ]
    assert [recorder for _, recorder in silences(bench, *steps)] == [0, 10, 20, 0, 10, 0]


def test_a_pause_of_the_loop_itself_is_nobodys_silence(bench):
    steps = [(0, b"", 100, 50), (0, b"", 100, 50), (300, b"", 100, 50), (0, b"", 100, 50)]
    assert silences(bench, *steps) == [(0, 0), (10, 10), (20, 20), (30, 30)]


def test_a_launcher_that_is_gone_is_read_no_more(bench):
    bench.loop._loop.add_fd(bench.loop._operator_fd, bench.loop._on_operator)
    os.close(bench.told)
    bench.told = -1
    bench.loop._on_operator(0)
    bench.loop._on_operator(0)
    assert bench.loop._input(0, 0, 0).operator == Operator.STOP


def recorded(bench, *fits):
    """Let one tick after another end, of which each fits into the ring or not; return the number of states in each."""
    pushed, outcomes = [], iter(fits)

    def push(_kind, _time_ns, payload):
        pushed.append(TICK_CDR.decode(payload))
        return next(outcomes)

    bench.loop._ring.push = push
    pushing = FoldBench()
    for _ in fits:
        pushing.fold()
        bench.loop._record(pushing.inp, pushing.state, pushing.output)
        bench.loop._state = pushing.state
    return pushed


def test_the_state_before_a_tick_is_in_the_log_once(bench):
    first, *others = recorded(bench, True, True, True)
    assert difference(0, first.before, (TickState(),), None) is None
    assert [tick.before for tick in others] == [(), ()]


def test_behind_records_that_did_not_fit_the_state_is_written_again(bench):
    """Replay starts from there: the state after the tick that is missing."""
    ticks = recorded(bench, True, False, False, True, True)
    assert [len(tick.before) for tick in ticks] == [1, 0, 1, 1, 0]
    for one, last in ((ticks[2], ticks[1]), (ticks[3], ticks[2])):
        assert difference(0, one.before, (last.after,), None) is None


def test_a_tick_that_failed_holds_the_state_before_it(bench):
    """Its own record may have been written before it failed, so that nobody knows which state came last."""
    good = FoldBench()
    good.fold()
    bench.loop._fold = lambda state, inp: (state, good.output)
    bench.loop._base.command = lambda *_, **__: None
    bench.loop._on_status = lambda *_: 1 / 0
    pushed = []
    bench.loop._ring.push = lambda _kind, _time_ns, payload: pushed.append(TICK_CDR.decode(payload)) or True
    with pytest.raises(ZeroDivisionError):
        bench.loop._one_tick(good.inp)
    bench.loop._give_up(good.inp, ZeroDivisionError())
    assert [len(tick.before) for tick in pushed] == [1, 1]
    assert [tick.input.host.loop_error for tick in pushed] == [False, True]


def test_how_long_a_tick_took_is_told_to_the_next(bench):
    loop, now_ns, told = bench.loop, [5_000_000_000], []
    loop._clock = lambda: now_ns[0]

    def one_tick(inp):
        told.append(inp.host.last_tick_ns)
        now_ns[0] += 1_250_000 * (len(told))

    loop._one_tick = one_tick
    deadline_ns = now_ns[0]
    for _ in range(3):
        now_ns[0] = deadline_ns
        loop._on_deadline(deadline_ns)
        deadline_ns = loop._timer.deadline_ns
        loop._timer.cancel()
    assert told == [0, 1_250_000, 2_500_000]
