"""The registers of an emulated FT 300 and its answers to Modbus requests. Pure.

Functions 3 and 16 and the registers below are documented; a real sensor's answer to anything else is unknown.
"""

from __future__ import annotations

import msgspec

from sim_backend.ft300 import wire

REG_WRENCH, REG_ACCELERATION, REG_OUTPUT = 180, 190, 410
OUTPUT_STREAM = 0x0200
MOST_REGISTERS = 125


class Reply(msgspec.Struct, frozen=True, gc=False):
    """An answer, and the output that the request selected (None: no output selected)."""

    answer: bytes
    selected: int | None = None
    is_refusal: bool = False


class SensorRegisters:
    """Identity ("FTS-1.2.3", "FTA-12345", year), acceleration (g), the newest six counts and the output select."""

    def __init__(self, firmware: str, serial: str, year: int, acceleration_g: tuple[float, float, float]) -> None:
        self.counts: tuple[int, ...] = (0,) * 6
        self.output = 0
        self._words = wire.identity_words(firmware, serial, year)
        for axis, value in enumerate(acceleration_g):
            self._words[REG_ACCELERATION + axis] = round(value * 1000) & 0xFFFF

    def word(self, address: int) -> int | None:
        """Return a register as unsigned word; None when there is no such register."""
        if REG_WRENCH <= address < REG_WRENCH + 6:
            return self.counts[address - REG_WRENCH] & 0xFFFF
        if address == REG_OUTPUT:
            return self.output
        return self._words.get(address)

    def serve(self, request: bytes) -> Reply:
        """Answer a request (without its CRC). A selected output takes effect when the answer is sent, not here."""
        function = request[1]
        address = request[2] << 8 | request[3]
        if function == wire.FC_READ:
            return self._read(address, request[4] << 8 | request[5])
        if function == wire.FC_WRITE:
            return self._write(address, request[7:])
        return _refused(function, wire.ILLEGAL_FUNCTION)

    def _read(self, address: int, count: int) -> Reply:
        if not 1 <= count <= MOST_REGISTERS:
            return _refused(wire.FC_READ, wire.ILLEGAL_VALUE)
        words = []
        for offset in range(count):
            word = self.word(address + offset)
            if word is None:
                return _refused(wire.FC_READ, wire.ILLEGAL_ADDRESS)
            words.append(word)
        return Reply(wire.read_answer(words))

    def _write(self, address: int, data: bytes) -> Reply:
        if address != REG_OUTPUT or len(data) != 2:
            return _refused(wire.FC_WRITE, wire.ILLEGAL_ADDRESS)
        return Reply(wire.write_answer(REG_OUTPUT, 1), selected=data[0] << 8 | data[1])


def _refused(function: int, reason: int) -> Reply:
    return Reply(wire.refusal(function, reason), is_refusal=True)
