"""The loop's own handlers, one at a time: what the operator's pipe means, and a flood of packets."""

import os
from types import SimpleNamespace

import pytest

from control.loop import ControlLoop, Watch
from robot_io.messages import DeviceHealth, LinkState, SensorWrench, Stamped
from robot_io.tick import Operator, TickState


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
        ring=SimpleNamespace(dropped=0),
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
