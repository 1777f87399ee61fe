"""Emulators of several devices opened together."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest

from robot_io.clock import monotonic_ns
from robot_io.errors import ConfigError
from robot_io.ipc.event_loop import EventLoop
from robot_io.rig.config import load_rig
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.world.world import World
from tools.rig import resolve_rig
from tools.run.emulated.emulators import addresses_of, open_emulators


@pytest.fixture
def loop():
    with contextlib.closing(EventLoop()) as loop:
        yield loop


def descriptors() -> set[Path]:
    return set(Path("/proc/self/fd").iterdir())


def test_each_device_is_reached_at_an_address_of_its_own(loop):
    rig = load_rig("emulated")
    opened = open_emulators(loop, World(rig, 0, monotonic_ns()), rig, ("ft", "arm", "base"), "")
    try:
        addresses = addresses_of(opened)
        assert addresses["ft"].startswith("/dev/pts/")
        assert addresses["arm"].startswith("127.0.0.")
        assert addresses["base"].startswith("ws://127.0.0.1:")
    finally:
        for emulator in opened.values():
            emulator.close()


def test_an_arms_own_sensor_is_the_arms_emulator(loop):
    rig = resolve_rig("ur10e-emulated")
    opened = open_emulators(loop, World(rig, 0, monotonic_ns()), rig, ("ft", "arm", "base"), "")
    try:
        addresses = addresses_of(opened)
        assert addresses["ft"] == addresses["arm"]
        arm = opened["arm"]
        assert isinstance(arm, UrEmulator)
        assert arm.controller.model.name == "UR10e"
    finally:
        for emulator in opened.values():
            emulator.close()


def test_where_one_cannot_be_opened_none_is_left(loop):
    rig = load_rig("emulated", ["base.kind=nowhere_at_all:Robot"])
    world = World(rig, 0, monotonic_ns())
    before = descriptors()
    with pytest.raises(ConfigError, match="nowhere_at_all"):
        open_emulators(loop, world, rig, ("ft", "arm", "base"), "")
    assert descriptors() == before
