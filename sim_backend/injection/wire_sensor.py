"""An emulated FT 300 that does something wrong from the start."""

from __future__ import annotations

import fcntl
import math
import os
import subprocess
import sys
from collections.abc import Sequence
from typing import cast

from msgspec.structs import astuple, replace

from robot_io.messages import DeviceHealth, LinkState, SensorWrench, Stamped, Vector6
from robot_io.rig.config import RigConfig
from sim_backend.ft300.emulator import Ft300Emulator
from sim_backend.injection.injection import Injection
from sim_backend.injection.sensor import InjectedSensor
from sim_backend.injection.wire_words import WireFault
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.world.plant import FtSource

FOR_GOOD_S = 1e6
GARBAGE_N = 100.0
"""What has no number cannot be sent on this wire: random ones up to this are."""

OTHER_PROGRAM = "import os, sys; os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY); print(flush=True); sys.stdin.read()"
_others: list[subprocess.Popen[bytes]] = []
"""Their standard input stays open as long as this process lives."""


def spoil_sensor(emulator: Ft300Emulator, faults: Sequence[WireFault], rig: RigConfig) -> None:
    """Let the emulator do wrong what `faults` of ft say."""
    values = [fault for fault in faults if not _spoil_line(emulator, fault)]
    if values:
        emulator.source = AlteredSource(emulator.source, values, rig)


LINE_KINDS = (
    "silent", "off", "lost", "streaming", "latency", "other-device", "crc", "junk", "echo", "busy", "shared",
)  # fmt: skip
"""What concerns an FT 300's line, or the device at its end."""


def spoil_tool_force(emulator: UrEmulator, faults: Sequence[WireFault], rig: RigConfig) -> None:
    """Let an arm's own sensor read what `faults` of ft say; it has no line of its own."""
    sensor = emulator.controller.force_sensor
    if faults and sensor.source is not None:
        sensor.source = AlteredSource(sensor.source, faults, rig)


def _spoil_line(emulator: Ft300Emulator, fault: WireFault) -> bool:
    """Do what concerns the line or the device; return whether it does."""
    kind, knobs = fault.kind, emulator.knobs
    if kind in ("silent", "off"):
        emulator.stall(FOR_GOOD_S)
    elif kind == "lost":
        emulator.hang_up()
    elif kind == "streaming":
        emulator.keep_streaming()
    elif kind == "latency":
        emulator.latency_ms = round(fault.value[0])
    elif kind == "other-device":
        emulator.become("GRP-3.0.1")
    elif kind in ("crc", "junk"):
        every = max(1, round(fault.value[0]))
        torn = {"corrupt_every" if kind == "crc" else "insert_byte_every": every}
        emulator.knobs = replace(knobs, corrupt_answer_every=every, **torn)
    elif kind == "echo":
        emulator.knobs = replace(knobs, echo=True)
    elif kind == "busy":
        fd = os.open(emulator.port, os.O_RDWR | os.O_NOCTTY)  # stays open as long as this process
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    elif kind == "shared":
        _share(emulator.port)
    else:
        return False
    return True


def _share(port: str) -> None:
    """Let another program have the port open, without a lock, until this process ends."""
    words = [sys.executable, "-c", OTHER_PROGRAM, port]
    other = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert other.stdout is not None
    other.stdout.readline()  # it is open
    _others.append(other)


class AlteredSource:
    """A source whose wrenches are changed as the faults say; where nothing arrives, the last one stays."""

    def __init__(self, source: FtSource, faults: Sequence[WireFault], rig: RigConfig) -> None:
        self._source = source
        self._now_ns = 0
        words = [f"{fault.device}.{fault.kind}{_spelled(fault)} at 0 s" for fault in faults]
        self._injection = Injection(words, lambda: self._now_ns, lambda _word, _ns: None)
        self._sensor = InjectedSensor(self, self._injection, rig)
        self._last: Vector6 | None = None

    def read_ft(self, t_ns: int) -> Vector6:
        """Return the wrench at `t_ns`."""
        self._now_ns = t_ns
        self._injection.begin(t_ns)
        arrived = self._sensor.drain()
        if arrived:
            self._last = cast(Vector6, astuple(arrived[-1].value))
        return self._last or self._source.read_ft(t_ns)

    def drain(self) -> tuple[Stamped[SensorWrench], ...]:
        """Return the one sample of now."""
        return (Stamped(SensorWrench(*self._source.read_ft(self._now_ns)), 0, self._now_ns),)

    def health(self) -> DeviceHealth:
        """Return that all is well."""
        return DeviceHealth(LinkState.UP, "", {}, 0.0)


def _spelled(fault: WireFault) -> str:
    numbers = [GARBAGE_N if math.isnan(value) else value for value in fault.value]
    return "=" + ",".join(map(repr, numbers)) if numbers else ""
