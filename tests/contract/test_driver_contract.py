"""The contract of `robot_io/driver.py`, one suite for every device at every level."""

from __future__ import annotations

import contextlib
import itertools
import time

import pytest

from robot_io.clock import monotonic_ns
from robot_io.errors import DeviceError
from robot_io.messages import BodyTwist, DeviceHealth, DeviceInfo, LinkState, Stamped
from tests.contract.levels import DEVICES, OWN_DEVICE, OWN_KIND, Simulated, emulated, hardware

STOP_WITHIN_S = 2.0
HANG_GUARD_S = 3.0
"""A thousand calls of a method that never blocks take a few milliseconds; this only tells it from one that waits."""
SLOW_S = 0.02
COMMANDED = ([OWN_KIND] if OWN_DEVICE == "base" else []) if OWN_KIND else ["ridgeback"]
"""Devices that take commands."""
BASE_FORWARD = BodyTwist(0.05, -0.02, 0.01)

LEVELS = [
    pytest.param("sim", id="sim"),
    pytest.param("emulated", id="emulated"),
    pytest.param("hardware", id="hardware", marks=pytest.mark.hardware),
]
ON_THE_WIRE_ONLY = (("ur10e", "sim"), ("ur-tool-force", "sim"))
"""At level sim they are the arm and the sensor that every rig has."""
LONG = ("ur10e",)
"""Driven by the class that drives a UR10; what is its own is in tests/robot_io/ur10."""
if OWN_KIND:
    LEVELS = LEVELS[1:2]


def opened_level(level, device):
    if level == "sim":
        return contextlib.nullcontext(Simulated(device))
    return emulated(device) if level == "emulated" else contextlib.nullcontext(hardware(device))


def cases(devices=DEVICES):
    return [
        pytest.param(
            (device, level.values[0]),
            id=f"{device}-{level.id}",
            marks=[*level.marks, *([pytest.mark.long] if device in LONG else [])],
        )
        for device in devices
        for level in LEVELS
        if (device, level.values[0]) not in ON_THE_WIRE_ONLY
    ]


@pytest.fixture(scope="module", params=cases())
def level(request):
    device, name = request.param
    with opened_level(name, device) as found:
        found.name = name
        yield found


@pytest.fixture
def driver(level):
    made = level.driver()
    yield made
    made.close()


def gather(level, driver, wanted=30, within_s=10.0):
    """Drain every 20 ms until there are `wanted` samples."""
    samples = []
    for _ in range(round(within_s / SLOW_S)):
        level.let_pass(SLOW_S)
        samples += driver.drain()
        if len(samples) >= wanted:
            return samples
    raise AssertionError(f"{len(samples)} samples in {within_s} s")


def test_open_identifies_the_device(level, driver):
    info = driver.open()
    assert isinstance(info, DeviceInfo)
    assert info.device == level.device
    assert info.where
    assert driver.health().state in (LinkState.UP, LinkState.OPENING)


def test_a_driver_that_is_up_and_gives_nothing_says_that_it_was_not_started(level, driver):
    driver.open()
    level.let_pass(SLOW_S)
    health = driver.health()
    assert driver.drain() or health.state == LinkState.OPENING or "call start()" in health.cause
    driver.start()
    assert driver.health().cause == ""


def test_samples_flow_after_start_oldest_first(level, driver):
    driver.open()
    driver.start()
    assert driver.health().state == LinkState.UP
    samples = gather(level, driver)
    assert all(isinstance(sample, Stamped) for sample in samples)
    stamps = [sample.received_ns for sample in samples]
    assert stamps == sorted(stamps)
    kinds = {type(sample.value) for sample in samples}
    for kind in kinds:
        own = [sample.seq for sample in samples if type(sample.value) is kind]
        assert all(before < after for before, after in itertools.pairwise(own)), kind


def test_health_counts_and_names_its_rate(level, driver):
    driver.open()
    driver.start()
    gather(level, driver)
    health = driver.health()
    assert isinstance(health, DeviceHealth)
    assert (health.state, health.cause) == (LinkState.UP, "")
    assert health.rate_hz > 20.0
    assert all(isinstance(value, int) for value in health.counters.values())
    gather(level, driver, wanted=10)
    grown = driver.health().counters
    assert all(grown[name] >= value for name, value in health.counters.items())
    assert sum(grown.values()) > sum(health.counters.values())


def test_drain_of_a_silent_device_gives_nothing_at_once(level, driver):
    driver.open()
    driver.start()
    gather(level, driver, wanted=3)
    with level.freeze():
        if level.name != "sim":
            time.sleep(0.1)  # what was on its way is there now
        driver.drain()
        began_s = time.monotonic()
        assert [driver.drain() for _ in range(1000)] == [()] * 1000
        assert time.monotonic() - began_s < HANG_GUARD_S


@pytest.mark.parametrize("level", cases(COMMANDED), indirect=True)
def test_the_base_says_what_it_really_sent(level, driver):
    wanted = BodyTwist() if level.name == "hardware" else BASE_FORWARD
    assert driver.command(wanted) == BodyTwist(), "closed: nothing is sent"
    driver.open()
    driver.start()
    gather(level, driver, wanted=1)
    assert driver.command(wanted) == wanted
    for bad in (float("nan"), float("inf")):
        with pytest.raises(ValueError):
            driver.command(BodyTwist(bad, 0.0, 0.0))
    driver.stop()


def test_start_needs_an_open_device(driver):
    with pytest.raises(DeviceError):
        driver.start()


@pytest.mark.parametrize("order", ["stop close", "close stop", "stop stop close close", "close close", "stop"])
def test_stop_and_close_in_any_order_before_open(driver, order):
    for name in order.split():
        getattr(driver, name)()
    assert driver.health().state == LinkState.CLOSED
    assert driver.drain() == ()


def test_stop_and_close_in_any_order_and_it_opens_again(level, driver):
    for order in ("stop close", "close stop", "stop stop close close"):
        driver.open()
        driver.start()
        gather(level, driver, wanted=3)
        for name in order.split():
            began_s = time.monotonic()
            getattr(driver, name)()
            assert time.monotonic() - began_s < STOP_WITHIN_S, name
        assert driver.health().state == LinkState.CLOSED
        assert driver.drain() == ()


def test_close_without_start(driver):
    driver.open()
    driver.close()
    assert driver.health().state == LinkState.CLOSED


def test_with_opens_starts_and_closes(level, driver):
    with driver as same:
        assert same is driver
        gather(level, driver, wanted=3)
    assert driver.health().state == LinkState.CLOSED


def test_with_closes_after_an_exception(driver):
    with pytest.raises(ZeroDivisionError), driver:
        raise ZeroDivisionError
    assert driver.health().state == LinkState.CLOSED


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("level_name", [level for level in LEVELS if level.id != "sim"])
def test_a_lost_link_is_said_and_never_raised(level_name, device):
    with opened_level(level_name, device) as level:
        driver = level.driver()
        driver.open()
        driver.start()
        gather(level, driver, wanted=3)
        level.break_link()
        try:
            deadline_s = time.monotonic() + 5.0
            while driver.health().state != LinkState.LOST:
                assert time.monotonic() < deadline_s, driver.health()
                level.let_pass(SLOW_S)
                driver.drain()
            assert driver.health().cause
            noticed_ns = monotonic_ns()
            came_before = driver.drain()
            assert all(sample.received_ns <= noticed_ns for sample in came_before)
            assert driver.drain() == ()
            if device in COMMANDED:
                assert driver.command(BASE_FORWARD) == BodyTwist(), "nothing was sent"
        finally:
            began_s = time.monotonic()
            driver.stop()
            driver.close()
            driver.stop()
            assert time.monotonic() - began_s < STOP_WITHIN_S
        assert driver.health().state == LinkState.CLOSED
