"""Modbus clients nobody here wrote, against the emulated FT 300: they read everything and start the stream."""

from __future__ import annotations

import struct

import libscrc
import minimalmodbus
import pytest
import serial
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusException

from tests.wire.ft300_process import ft300_process, until

WRENCH_WORDS = [0x04D2, 0xE9D2, 0x2710, 0x0064, 0xFB32, 0x0C8A]
REGISTERS = {
    180: WRENCH_WORDS,
    190: [0, 0, 0xFC18],
    500: [0x4654, 0x5301, 0x0203],
    510: [0x4654, 0x4100, 12345, 0],
    514: [2018],
}


def packets_of(port: serial.Serial) -> list[tuple[int, ...]]:
    """Return the packets in 20 packets' worth of bytes; found and checked without our codec."""
    data = port.read(16 * 20)
    found, at = [], 0
    while at + 16 <= len(data):
        packet = data[at : at + 16]
        if packet[:2] == b"\x20\x4e" and libscrc.modbus(packet[:14]) == struct.unpack("<H", packet[14:])[0]:
            found.append(struct.unpack("<6h", packet[2:14]))
            at += 16
        else:
            at += 1
    return found


@pytest.fixture
def instrument(request):
    with ft300_process(**getattr(request, "param", {})) as emulator:
        port = serial.Serial(emulator.port, 19200, timeout=0.5)
        yield minimalmodbus.Instrument(port, 9)
        port.close()


@pytest.fixture
def client():
    with ft300_process() as emulator:
        client = ModbusSerialClient(emulator.port, baudrate=19200, timeout=1, retries=0)
        assert client.connect()
        yield client
        client.close()


def test_minimalmodbus_reads_every_register(instrument):
    for address, words in REGISTERS.items():
        assert instrument.read_registers(address, len(words)) == words
    assert instrument.read_register(180, 2, signed=True) == 12.34
    assert instrument.read_register(184, 3, signed=True) == -1.23
    with pytest.raises(minimalmodbus.IllegalRequestError):
        instrument.read_register(0)


def test_minimalmodbus_starts_and_stops_the_stream(instrument):
    instrument.write_register(410, 0x0200)  # raises without a valid acknowledgement
    assert packets_of(instrument.serial)[-10:] == [(1234, -5678, 10000, 100, -1230, 3210)] * 10
    with pytest.raises(minimalmodbus.InvalidResponseError):
        instrument.read_registers(180, 6)  # it answers nothing now
    instrument.serial.write(b"\xff" * 50)
    assert until(lambda: not instrument.serial.read(256))
    assert instrument.read_registers(180, 6) == WRENCH_WORDS


@pytest.mark.parametrize("instrument", [{"streaming": True}], indirect=True)
def test_minimalmodbus_alone_cannot_talk_to_a_streaming_sensor(instrument):
    with pytest.raises(minimalmodbus.ModbusException):
        instrument.read_registers(500, 3)


def test_pymodbus_reads_every_register(client):
    for address, words in REGISTERS.items():
        answer = client.read_holding_registers(address, count=len(words), device_id=9)
        assert not answer.isError()
        assert answer.registers == words
    refused = client.read_holding_registers(0, count=1, device_id=9)
    assert refused.isError()
    assert refused.exception_code == 2
    with pytest.raises(ModbusException):
        client.read_holding_registers(180, count=6, device_id=8)  # nobody there


def test_pymodbus_starts_the_stream(client):
    answer = client.write_registers(410, [0x0200], device_id=9)
    assert not answer.isError()
    assert (answer.address, answer.count) == (410, 1)
    assert packets_of(client.socket)[-10:] == [(1234, -5678, 10000, 100, -1230, 3210)] * 10
