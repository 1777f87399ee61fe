"""Modbus programs written in C against the emulated FT 300: libmodbus through ctypes, and mbpoll.

Debian: apt-get install libmodbus5 mbpoll. Skipped where they are not installed.
"""

import ctypes
import ctypes.util
import os
import re
import select
import shutil
import subprocess
import termios

import pytest

from tests.wire.ft300_process import ft300_process

FORCE_AND_TORQUE = [1234, -5678, 10000, 100, -1230, 3210]
IDENTITY = {500: [0x4654, 0x5301, 0x0203], 510: [0x4654, 0x4100, 12345, 0], 514: [2018]}
PACKET = bytes.fromhex("20 4E D2 04 D2 E9 10 27 64 00 32 FB 8A 0C 0C 17")


def test_libmodbus_reads_everything_and_starts_the_stream():
    name = ctypes.util.find_library("modbus")
    if name is None:
        pytest.skip("libmodbus is not installed")
    library = ctypes.CDLL(name)
    library.modbus_new_rtu.restype = ctypes.c_void_p
    words = (ctypes.c_uint16 * 8)()
    with ft300_process() as emulator:
        context = ctypes.c_void_p(library.modbus_new_rtu(emulator.port.encode(), 19200, ctypes.c_char(b"N"), 8, 1))
        library.modbus_set_slave(context, 9)
        library.modbus_set_response_timeout(context, 1, 0)
        assert library.modbus_connect(context) == 0
        assert library.modbus_read_registers(context, 180, 6, words) == 6
        assert [ctypes.c_int16(word).value for word in words[:6]] == FORCE_AND_TORQUE
        for address, wanted in IDENTITY.items():
            assert library.modbus_read_registers(context, address, len(wanted), words) == len(wanted)
            assert words[: len(wanted)] == wanted
        assert library.modbus_read_registers(context, 9999, 1, words) == -1  # an exception, not a timeout
        words[0] = 0x0200
        assert library.modbus_write_registers(context, 410, 1, words) == 1
        library.modbus_close(context)
        library.modbus_free(context)
        # libmodbus leaves the port as it found it, at 9600 baud.
        descriptor = os.open(emulator.port, os.O_RDWR | os.O_NOCTTY)
        attributes = termios.tcgetattr(descriptor)
        attributes[4] = attributes[5] = termios.B19200
        termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
        data = b""
        while PACKET * 2 not in data:
            assert select.select([descriptor], [], [], 2)[0], "no stream"
            data += os.read(descriptor, 4096)
            assert len(data) < 4096
        os.close(descriptor)


def test_mbpoll_reads_force_and_torque():
    if shutil.which("mbpoll") is None:
        pytest.skip("mbpoll is not installed")
    line = [
        "mbpoll",
        "-m",
        "rtu",
        "-a",
        "9",
        "-b",
        "19200",
        "-P",
        "none",
        "-t",
        "4",
        "-0",
        "-r",
        "180",
        "-c",
        "6",
        "-1",
    ]
    with ft300_process() as emulator:
        done = subprocess.run([*line, emulator.port], capture_output=True, text=True, timeout=10)
    assert done.returncode == 0, done.stdout + done.stderr
    values = [int(value) & 0xFFFF for value in re.findall(r"^\[18\d\]:\s+(-?\d+)", done.stdout, re.MULTILINE)]
    assert values == [value & 0xFFFF for value in FORCE_AND_TORQUE]
