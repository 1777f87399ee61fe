"""The FT 300 while it does not stream: who it is, its registers, and how to make it stream.

Modbus RTU, slave 9, functions 3 and 16 only (the documented ones). Registers: 180..185 wrench, 190..192
acceleration, 410 output select, 500..502 firmware, 510..513 serial number, 514 year (Robotiq FT 300 manual).
"""

from __future__ import annotations

import contextlib
import time

import minimalmodbus

from robot_io.errors import DeviceProtocolError, DeviceUnreachable
from robot_io.ft300.codec import (
    counts_from_registers,
    firmware_text,
    serial_text,
    signed16,
    wrench_from_counts,
)
from robot_io.ft300.serial_link import SerialLine
from robot_io.messages import DeviceInfo, SensorWrench

SLAVE_ID = 9
READ_HOLDING, WRITE_MULTIPLE = 3, 16
REG_WRENCH, REG_ACCELERATION, REG_OUTPUT, REG_FIRMWARE, REG_SERIAL, REG_YEAR = 180, 190, 410, 500, 510, 514
START_STREAM = 0x0200
COUNTS_PER_G = 1000.0

QUIET_LIMITS_S = (3.0, 1.0)
"""Limit of each try for stopping a stream found at open; Robotiq's manual says half a second of 0xFF."""
MODE_CHANGE_S = 0.1
"""Time the sensor needs to change from stream to Modbus (Robotiq's driver waits as long)."""

POWER_CYCLE = "Power-cycle the sensor and check its 24 V supply (USB does not feed it)"


class Ft300Registers:
    """The registers of the sensor on an open, quiet line. Errors of the line itself pass as LINE_ERRORS."""

    def __init__(self, line: SerialLine) -> None:
        self._line = line
        self._where = f"ft300 {line.port}"
        self._instrument = minimalmodbus.Instrument(line.serial, SLAVE_ID)

    def identify(self) -> DeviceInfo:
        """Bring the sensor to Modbus mode and return who it is.

        A line that talks is told to stop, and so is one that did not answer the first try. Raises
        DeviceUnreachable (no answer) or DeviceProtocolError (not an FT 300).
        """
        failure: Exception | None = None
        for quiet_limit_s in QUIET_LIMITS_S:
            if not self._line.is_silent() or isinstance(failure, minimalmodbus.NoResponseError):
                self._stop_stream(quiet_limit_s)
            try:
                firmware = self._read(REG_FIRMWARE, 3)
            except minimalmodbus.ModbusException as error:
                failure = error
            else:
                return self._info(firmware)
        if isinstance(failure, minimalmodbus.NoResponseError):
            raise DeviceUnreachable(
                "no answer as Modbus slave 9 at 19200 baud",
                where=self._where,
                do=f"{POWER_CYCLE}; a Robotiq gripper on this port would stay silent, too",
            )
        self._refuse_echo()
        raise DeviceProtocolError(
            f"it answers, but not as an FT 300 ({failure})", where=self._where, do="Check which device is on this port"
        )

    def wrench(self) -> SensorWrench:
        """Return the present raw wrench (N, N*m, SENSOR frame). Raises DeviceProtocolError when it is not given."""
        registers = self._read_or_none(REG_WRENCH, 6)
        if registers is None:
            raise DeviceProtocolError("it does not give its wrench", where=self._where, do=POWER_CYCLE)
        return wrench_from_counts(counts_from_registers(registers))

    def acceleration_g(self) -> tuple[float, float, float]:
        """Return the acceleration in g, SENSOR frame; NaN when the sensor does not give it."""
        registers = self._read_or_none(REG_ACCELERATION, 3)
        if registers is None:
            return float("nan"), float("nan"), float("nan")
        x, y, z = (signed16(register) / COUNTS_PER_G for register in registers)
        return x, y, z

    def ask_for_stream(self) -> None:
        """Ask the sensor to stream. Its answer may come late, be lost or be overrun by packets: they decide."""
        with contextlib.suppress(minimalmodbus.ModbusException):
            self._instrument.write_register(REG_OUTPUT, START_STREAM, functioncode=WRITE_MULTIPLE)

    def _stop_stream(self, limit_s: float) -> None:
        if not self._line.make_quiet(limit_s):
            self._refuse_echo()
            raise DeviceProtocolError(
                "it keeps sending and does not stop on request",
                where=self._where,
                do=f"Check which device is on this port. {POWER_CYCLE}",
            )
        self._line.wait_sent()
        time.sleep(MODE_CHANGE_S)
        self._line.flush_input()

    def _refuse_echo(self) -> None:
        """Raise DeviceProtocolError when the adapter sends back what we send: a sensor cannot be heard through that."""
        if self._line.echoes():
            raise DeviceProtocolError(
                "the adapter's echo: what is sent comes back",
                where=self._where,
                do="Turn off the echo of the RS-485 adapter (its receiver must be off while it sends)",
            )

    def _info(self, firmware: list[int]) -> DeviceInfo:
        version = firmware_text(firmware)
        if not version.startswith("F"):
            raise DeviceProtocolError(
                f"its firmware is {version!r}, but the firmware of an FT 300 begins with F",
                where=self._where,
                do="Check which device is on this port",
            )
        serial_number, year = self._read_or_none(REG_SERIAL, 4), self._read_or_none(REG_YEAR, 1)
        return DeviceInfo(
            device="ft300",
            where=self._line.port,
            model=f"Robotiq FT 300, built {year[0]}" if year else "Robotiq FT 300",
            version=version,
            serial=serial_text(serial_number) if serial_number else "",
        )

    def _read(self, register: int, count: int) -> list[int]:
        values: list[int] = self._instrument.read_registers(register, count, functioncode=READ_HOLDING)
        return values

    def _read_or_none(self, register: int, count: int) -> list[int] | None:
        try:
            return self._read(register, count)
        except minimalmodbus.ModbusException:
            return None
