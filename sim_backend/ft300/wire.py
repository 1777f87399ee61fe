"""The FT 300's wire format from the sensor's side: what it sends and receives. Pure.

Written from Robotiq's manual independently of the driver, with no shared code: registers are big-endian, the
stream is little-endian, and both end with a CRC-16 (reflected 0xA001, start 0xFFFF), low byte first.
"""

from __future__ import annotations

from collections.abc import Sequence

SLAVE = 0x09
FC_READ = 0x03
FC_WRITE = 0x10
ILLEGAL_FUNCTION = 1
ILLEGAL_ADDRESS = 2
ILLEGAL_VALUE = 3

STOP_BYTE = 0xFF
"""The byte that, sent often enough, stops the stream."""

SHORT_REQUEST = 8
"""Length of every request of functions 1..6: slave, function, two words, CRC."""
WRITE_OVERHEAD = 9
"""Length of a function 16 request beside its data."""


def crc_bytes(message: bytes) -> bytes:
    """Return the two CRC bytes that follow `message`, in sending order."""
    register = 0xFFFF
    for byte in message:
        register ^= byte
        for _ in range(8):
            carry = register & 1
            register >>= 1
            if carry:
                register ^= 0xA001
    return bytes((register % 256, register // 256))


def framed(message: bytes) -> bytes:
    """Return `message` with its CRC."""
    return message + crc_bytes(message)


def to_counts(wrench: Sequence[float]) -> tuple[int, ...]:
    """Return six int16 for N, N, N, N*m, N*m, N*m: 100 counts per newton, 1000 per newton metre, clipped at int16.

    Whether a real sensor clips or wraps is unknown.
    """
    scales = (100, 100, 100, 1000, 1000, 1000)
    return tuple(max(-32768, min(32767, round(value * scale))) for value, scale in zip(wrench, scales, strict=True))


def stream_packet(counts: Sequence[int]) -> bytes:
    """Return the 16 bytes of one sample: 0x20 0x4E, six words low byte first, CRC."""
    body = b"".join(bytes((count & 0xFF, count >> 8 & 0xFF)) for count in counts)
    return framed(b"\x20\x4e" + body)


def read_answer(words: Sequence[int]) -> bytes:
    """Return the answer to a read: byte count, then words high byte first."""
    body = b"".join(bytes((word >> 8 & 0xFF, word & 0xFF)) for word in words)
    return framed(bytes((SLAVE, FC_READ, len(body))) + body)


def write_answer(address: int, count: int) -> bytes:
    """Return the answer to function 16: address and number of words written."""
    return framed(bytes((SLAVE, FC_WRITE, address >> 8, address & 0xFF, count >> 8, count & 0xFF)))


def refusal(function: int, reason: int) -> bytes:
    """Return a Modbus exception answer."""
    return framed(bytes((SLAVE, function | 0x80, reason)))


def identity_words(firmware: str, serial: str, year: int) -> dict[int, int]:
    """Return registers 500..502, 510..513 and 514 of a firmware like "FTS-1.2.3" and a serial like "FTA-12345"."""
    letters, _, version = firmware.partition("-")
    major, minor, patch = (int(part) for part in version.split("."))
    serial_letters, _, number_text = serial.partition("-")
    number = int(number_text)
    a, b, c = (ord(letter) for letter in letters)
    d, e, f = (ord(letter) for letter in serial_letters)
    return {
        500: a * 256 + b,
        501: c * 256 + major,
        502: minor * 256 + patch,
        510: d * 256 + e,
        511: f * 256,
        512: number % 65536,
        513: number // 65536,
        514: year,
    }


class RequestScanner:
    """Extracts Modbus requests from the incoming bytes, dropping one byte at a time until a request fits.

    A request may follow a run of 0xFF without a pause, because the host's output queue hides pauses.
    """

    def __init__(self) -> None:
        self._bytes = bytearray()
        self.junk_bytes = 0

    def clear(self) -> None:
        """Discard an incomplete request."""
        self.junk_bytes += len(self._bytes)
        self._bytes.clear()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the complete requests for our slave number, each without its CRC."""
        self._bytes += data
        found = []
        while self._bytes:
            length = self._length_wanted()
            if length and len(self._bytes) < length:
                break
            message = bytes(self._bytes[: length - 2]) if length else b""
            if length and crc_bytes(message) == self._bytes[length - 2 : length]:
                found.append(message)
                del self._bytes[:length]
            else:
                self.junk_bytes += 1
                del self._bytes[:1]
        return found

    def _length_wanted(self) -> int:
        """Return how long the request at the front would be; 0 when no request can begin there."""
        head = self._bytes
        if head[0] != SLAVE:
            return 0
        if len(head) < 2:
            return SHORT_REQUEST
        if 1 <= head[1] <= 6:
            return SHORT_REQUEST
        if head[1] != FC_WRITE:
            return 0
        if len(head) < 7:
            return WRITE_OVERHEAD
        if head[6] != 2 * (head[4] * 256 + head[5]):
            return 0
        return WRITE_OVERHEAD + head[6]
