"""Bytes of the sensor and of the arm, spoilt: each is read, or refused in its driver's own words, and no more.

Each function prepares a codec and returns its turn: take in one spoilt frame. A turn raises whatever is wrong.
"""

from __future__ import annotations

import math
import random
import struct
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import crcmod.predefined
import serial

from robot_io.errors import DeviceError
from robot_io.ft300.codec import StreamParser
from robot_io.ft300.modbus import Ft300Registers
from robot_io.ft300.serial_link import LINE_ERRORS
from robot_io.messages import ArmState
from robot_io.ur10.generation import CB3, E_SERIES
from robot_io.ur10.preflight import preflight
from robot_io.ur10.reader import ArmReader
from sim_backend.ft300 import wire
from tests.robot_io.mutated.bytes_changed import Turn, changed

_crc = crcmod.predefined.mkPredefinedCrcFun("modbus")


def ft300_stream(_folder: Path) -> Turn:
    """Return a turn of the stream: each packet found is there with its checksum, and at most 15 bytes are kept."""
    parser, kept = StreamParser(), b""
    sound = [wire.stream_packet([v, -v, 3 * v, 20_000, -1, 0x4E20]) for v in (0, 1, 255, 9_999)]

    def turn(draw: random.Random) -> None:
        nonlocal kept
        data = changed(draw, sound[int(draw.random() * len(sound))], sound)
        seen = kept + data
        for counts in parser.feed(data):
            packet = b"\x20\x4e" + struct.pack("<6h", *counts)
            assert packet + struct.pack("<H", _crc(packet)) in seen
        assert parser.pending_bytes <= 15
        kept = seen[-15:]

    return turn


class _Port(serial.Serial):
    """A port on which anything may be the answer."""

    def __init__(self) -> None:
        super().__init__(baudrate=19_200)
        self.is_open, self.answer = True, b""

    def read(self, size: int = 1) -> bytes:
        return self.answer[:size]

    def write(self, b: bytes, /) -> int:
        return len(b)

    def reset_input_buffer(self) -> None:
        pass

    reset_output_buffer = flush = close = reset_input_buffer


class _Line:
    """An open, quiet line."""

    port = "here"

    def __init__(self) -> None:
        self.serial = _Port()

    def is_silent(self) -> bool:
        return True

    def make_quiet(self, _limit_s: float) -> bool:
        return True

    def echoes(self) -> bool:
        return False

    def wait_sent(self) -> None:
        pass

    flush_input = wait_sent


def ft300_registers(_folder: Path) -> Turn:
    """Return a turn of Modbus RTU answers: what is believed has the right checksum, whatever else is its own error."""
    line: Any = _Line()
    port, registers = line.serial, Ft300Registers(line)
    words = wire.identity_words("FTS-1.2.3", "FTA-12345", 2016)
    sound = [
        wire.read_answer([0xF7F4, 3000, 12, 65535, 0x8000, 0x7FFF]),
        wire.read_answer([words[500 + i] for i in range(3)]),
        wire.read_answer([words[510 + i] for i in range(4)]),
        wire.read_answer([2016]),
        wire.write_answer(410, 1),
        wire.refusal(3, 2),
    ]
    asked: list[tuple[Callable[[], object], int]] = [
        (registers.wrench, 15),
        (registers.wrench, 15),
        (registers.acceleration_g, 9),
        (registers.identify, 9),
    ]
    """What is asked, and how many bytes of its answer stand before the checksum."""

    def turn(draw: random.Random) -> None:
        port.answer = changed(draw, sound[int(draw.random() * len(sound))], sound)
        ask, size = asked[int(draw.random() * len(asked))]
        try:
            found = ask()
        except (DeviceError, *LINE_ERRORS):
            return
        if not (isinstance(found, tuple) and math.isnan(found[0])):
            assert _crc(port.answer[:size]) == int.from_bytes(port.answer[size : size + 2], "little")

    return turn


class _Wheel:
    """Stands for the wheel's receive interface: it shows one packet, whatever is in it."""

    packet = b""

    def __init__(self, *_: object) -> None:
        pass

    def isConnected(self) -> bool:  # noqa: N802 - the wheel's own name
        return True

    def __getattr__(self, name: str) -> Callable[[], Any]:
        values = UR_PACKET.unpack(self.packet[: UR_PACKET.size].ljust(UR_PACKET.size, b"\0"))
        q, qd, modes = list(values[1:7]), list(values[7:13]), list(values[13:19])
        kept = len(self.packet) * 6 // UR_PACKET.size  # a short packet has too few joints
        shown = {
            "getTimestamp": values[0], "getActualQ": q[:kept], "getActualQd": qd, "getJointMode": modes,
            "getRobotMode": values[19], "getSafetyMode": values[20], "getSafetyStatusBits": values[21],
            "getRobotStatus": values[22], "getRuntimeState": values[23],
        }  # fmt: skip
        return lambda: shown[name]


UR_PACKET = struct.Struct(">13d6i2i2I1I")


def ur_state(_folder: Path) -> Turn:
    """Return a turn of the arm's state: an arm that holds has every mode right, and no number passes unnamed."""
    module: Any = types.ModuleType("rtde_receive")
    module.RTDEReceiveInterface = _Wheel
    with mock.patch.dict(sys.modules, {"rtde_receive": module}):
        reader = ArmReader("here", CB3)
    wheel: Any = reader._rtde
    sound = [
        UR_PACKET.pack(t, *(0.1,) * 6, *(0.0,) * 6, *(253,) * 6, 7, safety, 1, 1, 1)
        for t, safety in ((1.0, 1), (2.0, 2), (3.0, 1))
    ]

    def turn(draw: random.Random) -> None:
        wheel.packet = changed(draw, sound[int(draw.random() * 3)], sound)
        if not reader.poll(5):
            return
        joints, modes = reader.joints, reader.modes
        assert joints is not None
        numbers = (*joints.position, *joints.velocity, joints.controller_time_s)
        assert len(numbers) == 13
        assert reader.error or all(map(math.isfinite, numbers))
        assert 0 <= joints.device_state < 2**63
        if joints.state == ArmState.HOLDING:
            assert modes.robot_mode == 7
            assert modes.safety_mode in (1, 2)
            assert set(modes.joint_modes) == {253}
            assert modes.runtime_state == 1

    return turn


class _Socket:
    """A connection to something that answers anything."""

    def __init__(self, answers: bytes) -> None:
        self._answers = answers

    def recv(self, count: int) -> bytes:
        data, self._answers = self._answers[:count], self._answers[count:]
        return data

    def sendall(self, _data: bytes) -> None:
        pass

    settimeout = sendall

    def close(self) -> None:
        pass


def ur_handshake(_folder: Path) -> Turn:
    """Return a turn of the first look at the arm: RTDE's two answers and the dashboard's lines, or a device's error."""
    rtde = bytes.fromhex("0004560100137600000003000000100000000200000003")
    text = bytes.fromhex("00084d04") + b"text"
    lines = b"Connected: Universal Robots Dashboard Server\nUR10\n2014300001\nRobotmode: RUNNING\nSafetymode: NORMAL\n"
    sound = [rtde, text + rtde, lines]

    answers: list[bytes] = []

    def connect(*_: object, **__: object) -> _Socket:
        return _Socket(answers.pop(0))

    def turn(draw: random.Random) -> None:
        answers[:] = [rtde, lines]
        spoilt = int(draw.random() * 2)
        answers[spoilt] = changed(draw, (sound[int(draw.random() * 2)], lines)[spoilt], sound)
        with mock.patch("socket.create_connection", connect):
            try:
                info, _ = preflight("here")
            except DeviceError:
                return
        # A changed byte may make it another arm, but never one of no generation.
        assert info.model in ({"3": CB3, "5": E_SERIES}[info.version[0]].models)
        assert info.serial == "" or info.serial.isdigit()

    return turn
