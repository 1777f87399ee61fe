"""Clocks: monotonic inside, one offset to the wall, and a virtual one that never goes back."""

import time

import pytest

from robot_io import clock
from robot_io.clock import VirtualClock, monotonic_ns, wall_offset_ns


def test_the_monotonic_clock_is_that_of_the_machine():
    before = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
    now = monotonic_ns()
    assert before <= now <= time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def test_the_offset_is_taken_in_the_middle_of_two_reads(monkeypatch):
    reads = iter([1_000, 1_200])
    monkeypatch.setattr(clock.time, "monotonic_ns", lambda: next(reads))
    monkeypatch.setattr(clock.time, "time_ns", lambda: 5_000_000)
    assert wall_offset_ns() == 5_000_000 - 1_100


def test_a_virtual_clock_moves_only_when_told_and_never_back():
    virtual = VirtualClock(100)
    assert virtual() == 100
    virtual.advance_to(100)
    virtual.advance_to(250)
    assert virtual() == 250
    with pytest.raises(ValueError, match="back"):
        virtual.advance_to(249)
    assert virtual() == 250
