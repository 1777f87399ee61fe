"""The simulated FT 300 on its virtual clock, and the constant wrench of the emulator running alone."""

from __future__ import annotations

import itertools

import pytest

from robot_io.clock import VirtualClock
from robot_io.errors import DeviceNotReady, UsageError
from robot_io.messages import LinkState
from sim_backend.ft300.standalone import ConstantWrench, parse_wrench
from sim_backend.sim.ft300 import SimFt300

MS = 1_000_000


class TimeOfDay:
    """A source whose Fx is the time asked for, in units of 10 ms."""

    def __init__(self):
        self.asked = []

    def read_ft(self, t_ns):
        self.asked.append(t_ns)
        return (t_ns / (10 * MS), 0.0, 0.0, 0.0, 0.0, 0.0)


def test_samples_lie_on_the_sensors_grid_and_arrive_a_line_time_later():
    clock, source = VirtualClock(), TimeOfDay()
    with SimFt300(source, clock, rate_hz=100.0, phase=0.37, latency_ms=1) as sensor:
        arrivals = []
        for now_ms in range(101):
            clock.advance_to(now_ms * MS)
            for sample in sensor.drain():
                assert sample.received_ns <= clock()  # never from the future
                arrivals.append(sample)
        # Sampled at 3.7, 13.7, ... ms; 16 bytes at 1920 a second and 1 ms later they are here.
        assert [sample.received_ns for sample in arrivals] == [
            3_700_000 + k * 10 * MS + 8_333_333 + MS for k in range(9)
        ]
        assert [sample.value.fx for sample in arrivals] == [round(0.37 + k, 2) for k in range(9)]
        assert [sample.seq for sample in arrivals] == list(range(9))
        assert source.asked == [3_700_000 + k * 10 * MS for k in range(10)]


def test_a_real_rate_error_moves_the_phase():
    clock, source = VirtualClock(), TimeOfDay()
    sensor = SimFt300(source, clock)
    sensor.open()
    sensor.start()
    clock.advance_to(1_000 * MS)
    samples = sensor.drain()
    steps = {after.received_ns - before.received_ns for before, after in itertools.pairwise(samples)}
    assert steps <= {9_998_400, 9_998_401}  # 1 / 100.016 Hz
    assert len(samples) == 99
    assert sensor.health().counters == {"packets_ok": 99, "overflow": 0}


def first_reading(wrench, **declared):
    class Constant:
        def read_ft(self, _t_ns):
            return wrench

    clock = VirtualClock()
    with SimFt300(Constant(), clock, **declared) as sensor:
        clock.advance_to(100 * MS)
        return sensor.drain()[0].value


def test_values_are_counted_in_hundredths_and_thousandths_and_clipped():
    wrench = first_reading((12.344, -0.006, 400.0, 0.0004, -0.0006, -40.0))
    assert (wrench.fx, wrench.fy, wrench.fz) == (12.34, -0.01, 327.67)
    assert (wrench.mx, wrench.my, wrench.mz) == (0.0, -0.001, -32.767)


def test_another_sensor_counts_in_its_own_steps_to_its_own_range():
    declared = {"resolution": (0.5,) * 3 + (0.25,) * 3, "limit": (100.0,) * 3 + (10.0,) * 3}
    wrench = first_reading((12.4, -12.2, 120.0, 0.4, -0.1, -40.0), **declared)
    assert (wrench.fx, wrench.fy, wrench.fz) == (12.5, -12.0, 100.0)
    assert (wrench.mx, wrench.my, wrench.mz) == (0.5, 0.0, -10.0)


def test_lifecycle_and_bounds():
    clock = VirtualClock(5 * MS)
    sensor = SimFt300(TimeOfDay(), clock)
    assert sensor.health().state is LinkState.CLOSED
    with pytest.raises(DeviceNotReady):
        sensor.start()
    assert sensor.open().device == "ft300"
    assert sensor.drain() == ()
    sensor.start()
    sensor.start()
    clock.advance_to(100_000 * MS)
    samples = sensor.drain()
    assert len(samples) <= 512
    health = sensor.health()
    assert health.counters["overflow"] == samples[0].seq > 9_000
    assert health.state is LinkState.UP
    sensor.stop()
    sensor.stop()
    clock.advance_to(101_000 * MS)
    assert sensor.drain() == ()
    sensor.start()
    clock.advance_to(101_050 * MS)
    restarted = sensor.drain()
    assert [sample.seq - samples[-1].seq > 0 for sample in restarted] == [True] * len(restarted) != []
    sensor.close()
    sensor.close()
    assert sensor.health().state is LinkState.CLOSED


def test_a_constant_wrench_and_its_step():
    before, after = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3), (-1.0, -2.0, -3.0, -0.1, -0.2, -0.3)
    source = ConstantWrench(before, step_after_s=0.5, step_wrench=after, started_ns=1_000 * MS)
    assert source.read_ft(1_499 * MS) == before
    assert source.read_ft(1_500 * MS) == after
    assert ConstantWrench(before).read_ft(2**62) == before
    assert ConstantWrench().read_ft(0) == (0.0,) * 6


def test_half_a_step_is_a_usage_error():
    with pytest.raises(UsageError, match="both its time and its wrench"):
        ConstantWrench(step_after_s=1.0)
    with pytest.raises(UsageError, match="both its time and its wrench"):
        ConstantWrench(step_wrench=(0.0,) * 6)
    for seconds in (-1.0, float("nan"), float("inf"), 1e300):
        with pytest.raises(UsageError, match="is impossible"):
            ConstantWrench(step_after_s=seconds, step_wrench=(0.0,) * 6)


def test_a_wrench_is_read_from_text():
    assert parse_wrench("-1,2.5,3e1,0,-0.1,32.767") == (-1.0, 2.5, 30.0, 0.0, -0.1, 32.767)
    for text in ("", "1,2,3", "1,2,3,4,5,6,7", "a,0,0,0,0,0", "nan,0,0,0,0,0", "328,0,0,0,0,0", "0,0,0,0,0,inf"):
        with pytest.raises(UsageError):
            parse_wrench(text)
