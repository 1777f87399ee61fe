"""Bytes of a Robotiq FT 300 and what they mean. Pure: no port, no clock.

A stream packet is 16 bytes: `20 4E`, six little-endian int16 (Fx Fy Fz Mx My Mz), CRC low byte, CRC high byte
(Robotiq FT 300 manual, "data stream"). Forces count 0.01 N, torques 0.001 N*m. Registers are big-endian words
read by Modbus RTU. The header is not reserved: it is also the force 200.00 N and may arise across two fields,
so only the CRC decides.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from robot_io.messages import SensorWrench

Counts = tuple[int, int, int, int, int, int]
"""Six raw int16: Fx, Fy, Fz in 0.01 N, Mx, My, Mz in 0.001 N*m, SENSOR frame."""

HEADER = b"\x20\x4e"
PACKET_BYTES = 16
_CRC_AT = 14
_FIELDS = struct.Struct("<6h")

COUNTS_PER_N = 100.0
COUNTS_PER_NM = 1000.0
RANGE_FORCE_COUNTS = 30_000
RANGE_TORQUE_COUNTS = 30_000
"""Measuring range of the product sheet: 300 N and 30 N*m."""


def _crc_table() -> tuple[int, ...]:
    table = []
    for value in range(256):
        for _ in range(8):
            value = (value >> 1) ^ 0xA001 if value & 1 else value >> 1
        table.append(value)
    return tuple(table)


_TABLE = _crc_table()


def crc16_modbus(data: bytes | bytearray | memoryview) -> int:
    """Return the CRC-16/MODBUS of `data` (polynomial 0x8005 reflected, start 0xFFFF; sent low byte first)."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc


class StreamParser:
    """Finds the packets in a stream that may be joined, split, cut or corrupted anywhere.

    What is found depends on the bytes only, never on how they were chunked. On a bad CRC it drops one byte and
    searches again, so a header inside a payload costs nothing but that. It never keeps more than 15 bytes.

    Counters: `packets_ok`; `crc_fail` (candidates that failed); `junk_bytes` (bytes that belong to no packet);
    `resyncs` (runs of junk, however many candidates failed in one).
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._in_junk = False
        self.packets_ok = 0
        self.crc_fail = 0
        self.junk_bytes = 0
        self.resyncs = 0

    @property
    def pending_bytes(self) -> int:
        """Bytes kept because a packet may begin with them: 0..15."""
        return len(self._buffer)

    def clear(self) -> None:
        """Forget the bytes kept (after a flush of the port); they count as junk."""
        self._skip(len(self._buffer))
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Counts]:
        """Return the packets completed by `data`, oldest first."""
        buffer = self._buffer
        buffer += data
        found: list[Counts] = []
        start = 0
        while True:
            at = buffer.find(HEADER, start)
            if at < 0:
                # The last byte may be the first half of a header.
                end = len(buffer) - 1 if buffer.endswith(HEADER[:1]) else len(buffer)
                end = max(end, start)
                self._skip(end - start)
                start = end
                break
            self._skip(at - start)
            start = at
            if len(buffer) - at < PACKET_BYTES:
                break
            crc = buffer[at + _CRC_AT] | buffer[at + _CRC_AT + 1] << 8
            if crc16_modbus(buffer[at : at + _CRC_AT]) == crc:
                found.append(_FIELDS.unpack_from(buffer, at + len(HEADER)))
                self.packets_ok += 1
                self._in_junk = False
                start = at + PACKET_BYTES
            else:
                self.crc_fail += 1
                self._skip(1)
                start = at + 1
        del buffer[:start]
        return found

    def _skip(self, count: int) -> None:
        if count:
            self.junk_bytes += count
            if not self._in_junk:
                self._in_junk = True
                self.resyncs += 1


def wrench_from_counts(counts: Counts) -> SensorWrench:
    """Return the wrench (N, N*m, SENSOR frame, bias and tool weight in it) of six raw counts."""
    fx, fy, fz, mx, my, mz = counts
    return SensorWrench(
        fx / COUNTS_PER_N,
        fy / COUNTS_PER_N,
        fz / COUNTS_PER_N,
        mx / COUNTS_PER_NM,
        my / COUNTS_PER_NM,
        mz / COUNTS_PER_NM,
    )


def counts_from_registers(registers: Sequence[int]) -> Counts:
    """Return six signed counts of the unsigned registers 180..185."""
    fx, fy, fz, mx, my, mz = (signed16(register) for register in registers)
    return fx, fy, fz, mx, my, mz


def signed16(register: int) -> int:
    """Return a 16-bit register (0..65535) as two's complement."""
    return register - 0x10000 if register & 0x8000 else register


def beyond_range(counts: Counts) -> bool:
    """Return whether any axis is beyond the sensor's measuring range (300 N, 30 N*m)."""
    force = max(max(counts[:3]), -min(counts[:3]))
    torque = max(max(counts[3:]), -min(counts[3:]))
    return force > RANGE_FORCE_COUNTS or torque > RANGE_TORQUE_COUNTS


def firmware_text(registers: Sequence[int]) -> str:
    """Return the firmware of registers 500..502 as "FTS-1.2.3": three letters, then three bytes as numbers."""
    letters, (major, minor, patch) = _bytes_of(registers)[:3], _bytes_of(registers)[3:6]
    return f"{_printable(letters)}-{major}.{minor}.{patch}"


def serial_text(registers: Sequence[int]) -> str:
    """Return the serial number of registers 510..513 as "FTA-12345" ("" when none was written).

    Three letters, one unused byte, then a 32-bit number whose low word comes first.
    """
    number = registers[3] << 16 | registers[2]
    return f"{_printable(_bytes_of(registers)[:3])}-{number:04d}" if number else ""


def _bytes_of(registers: Sequence[int]) -> bytes:
    return b"".join(register.to_bytes(2, "big") for register in registers)


def _printable(letters: bytes) -> str:
    return "".join(chr(letter) if 0x21 <= letter < 0x7F else "?" for letter in letters)
