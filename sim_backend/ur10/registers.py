"""The general-purpose registers of a UR controller and the watchdog on one of them.

Inputs keep their last value when the client that wrote them goes away. Source: RTDE guide; `rtde_set_watchdog`
in the URScript manual.
"""

from __future__ import annotations

from robot_io.clock import NS_PER_S

REGISTERS = 48
BITS = 128


class Registers:
    """Integer and double registers 0..47, in and out, when each input was last written, and bits 0..127."""

    def __init__(self) -> None:
        self.int_in = [0] * REGISTERS
        self.double_in = [0.0] * REGISTERS
        self.bits_in = [False] * BITS
        self.bits_out = [False] * BITS
        self.int_out = [0] * REGISTERS
        self.double_out = [0.0] * REGISTERS
        self.int_written_ns = [0] * REGISTERS

    def write_int(self, index: int, value: int, now_ns: int) -> None:
        """Store a client's value of `input_int_register_<index>`."""
        self.int_in[index] = value
        self.int_written_ns[index] = now_ns


class Watchdog:
    """Trips when an integer input register is not written at least `min_frequency_hz` times a second."""

    def __init__(self, registers: Registers, index: int, min_frequency_hz: float, now_ns: int) -> None:
        self._registers = registers
        self._index = index
        self._limit_ns = NS_PER_S / min_frequency_hz  # infinite for a rate too small to divide by
        self._since_ns = now_ns

    def tripped(self, now_ns: int) -> bool:
        """Return whether the register was not written for too long."""
        last_ns = max(self._since_ns, self._registers.int_written_ns[self._index])
        return now_ns - last_ns > self._limit_ns
