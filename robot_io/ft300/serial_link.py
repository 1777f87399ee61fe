"""The serial line to an FT 300: open it with errors a person can act on, read without blocking, make it quiet.

Knows ports, bytes and time, nothing of packets but their length. Everything here is bounded in time. Errors of
a line that went away come as one of `LINE_ERRORS`, because pyserial, termios and the kernel each have their own.
"""

from __future__ import annotations

import errno
import logging
import os
import select
import termios
import time
from pathlib import Path
from typing import Protocol

import serial
from serial.tools import list_ports

from robot_io.errors import DeviceUnreachable, UsageError
from robot_io.ft300.tcp_link import SCHEME, TcpPort, is_tcp_address

BAUD = 19_200
ANSWER_TIMEOUT_S = 0.3
"""Wait for a Modbus answer: 9 ms on the wire, up to 32 ms in a slow USB adapter, the rest is margin."""
WRITE_TIMEOUT_S = 0.5
SILENCE_S = 0.1
"""A streaming sensor sends every 10 ms; 100 ms without a byte is a stopped one (Robotiq's driver waits 84 ms)."""
BURST = b"\xff" * 20
BURST_PERIOD_S = 0.015
"""20 bytes need 10.4 ms at 19200 baud, so that no backlog of 0xFF builds up in front of the next request."""
POLL_MS = 5

LINE_ERRORS = (OSError, termios.error, ValueError)
"""SerialException and SerialTimeoutException are OSErrors; tcflush raises termios.error, a closed fd ValueError."""

SYSFS_TTY = Path("/sys/class/tty")
UDEV_RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
ADAPTER_USB_IDS = ((0x0403, 0x6015), (0x0403, 0x6001))

_log = logging.getLogger(__name__)


class _Port(Protocol):
    """What is used of a pyserial port, whether a tty or a socket."""

    @property
    def in_waiting(self) -> int: ...
    def fileno(self) -> int: ...
    def write(self, data: bytes, /) -> int | None: ...
    def close(self) -> None: ...


class SerialLine:
    """One open port: a tty at 19200 8N1, locked against a second opener, or a TCP serial server.

    Raises DeviceUnreachable when the port is missing, busy, forbidden or no serial port, and UsageError for an
    address that is neither a path nor `socket://host:port`.
    """

    def __init__(self, port: str) -> None:
        self.port = port
        over_tcp = "://" in port
        if over_tcp and not is_tcp_address(port):
            raise UsageError(f"{port!r} is not a port of an FT 300", do="Give a device path or socket://host:port")
        make = TcpPort if over_tcp else serial.Serial
        try:
            self.serial: _Port = make(
                port, BAUD, timeout=ANSWER_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S, exclusive=True
            )
        except LINE_ERRORS as error:
            raise _unreachable(port, error) from error
        self.is_tty = os.isatty(self.serial.fileno())
        try:
            os.set_blocking(self.serial.fileno(), False)
            self.set_wake_bytes(1)
        except LINE_ERRORS as error:
            self.close()
            raise _unreachable(port, error) from error

    def fileno(self) -> int:
        """Return the descriptor."""
        return self.serial.fileno()

    def close(self) -> None:
        """Release the port; idempotent."""
        self.serial.close()

    def set_wake_bytes(self, count: int) -> None:
        """Report the port as readable from `count` waiting bytes on (VMIN; a socket always does from 1).

        Any count but 0 also makes an empty read differ from the end of the line.
        """
        if self.is_tty:
            attributes = termios.tcgetattr(self.fileno())
            attributes[6][termios.VMIN] = count
            attributes[6][termios.VTIME] = 0
            termios.tcsetattr(self.fileno(), termios.TCSANOW, attributes)

    def read_now(self, limit: int = 4096) -> bytes:
        """Return what is there, b"" when nothing is. Raises one of LINE_ERRORS when the line is gone."""
        try:
            data = os.read(self.fileno(), limit)
        except BlockingIOError:
            return b""
        if not data:
            raise ConnectionResetError(errno.ECONNRESET, "the other end closed the line")
        return data

    def read_to_boundary(self, pending: int, unit: int) -> bytes:
        """Return bytes that complete whole units together with the `pending` bytes read before.

        The beginning of the next unit stays in the kernel, so that its last byte, and no other, wakes the reader
        and the arrival stamp is the packet's own. A socket has no such threshold: everything is read.
        """
        if not self.is_tty:
            return self.read_now()
        total = pending + self.serial.in_waiting
        wanted = total - total % unit - pending
        return self.read_now(wanted) if wanted > 0 else b""

    def flush_input(self) -> None:
        """Throw away what is waiting (bounded, unlike pyserial's own on a socket that never falls silent)."""
        for _ in range(16):
            if not self.read_now():
                return

    def wait_readable(self, timeout_ms: int) -> None:
        """Wait until something can be read, at most `timeout_ms`."""
        poller = select.poll()
        poller.register(self.fileno(), select.POLLIN)
        poller.poll(timeout_ms)

    def is_silent(self) -> bool:
        """Listen for 100 ms; return whether nothing came."""
        deadline_s = time.monotonic() + SILENCE_S
        while time.monotonic() < deadline_s:
            self.wait_readable(POLL_MS)
            if self.read_now():
                return False
        return True

    def make_quiet(self, limit_s: float) -> bool:
        """Send 0xFF until the line is silent for 100 ms; False when it is not within `limit_s`."""
        heard_s = burst_s = time.monotonic()
        deadline_s = heard_s + limit_s
        while (now_s := time.monotonic()) < deadline_s:
            if self.read_now():
                heard_s = now_s
            elif now_s - heard_s >= SILENCE_S:
                return True
            if now_s >= burst_s:
                self.serial.write(BURST)
                burst_s = now_s + BURST_PERIOD_S
            self.wait_readable(POLL_MS)
            if time.monotonic() - now_s < POLL_MS / 1000:
                time.sleep(0.001)  # a stream that is always readable must not spin
        return False

    def echoes(self) -> bool:
        """Send 0xFF, which asks a sensor for nothing but silence; return whether it comes back within 100 ms."""
        self.flush_input()
        self.serial.write(BURST)
        heard = b""
        deadline_s = time.monotonic() + SILENCE_S
        while BURST not in heard and time.monotonic() < deadline_s:
            self.wait_readable(POLL_MS)
            heard += self.read_now()
        return BURST in heard

    def wait_sent(self, limit_s: float = 0.5) -> None:
        """Wait until the kernel has sent everything (as tcdrain, but bounded; a socket cannot tell)."""
        deadline_s = time.monotonic() + limit_s
        while getattr(self.serial, "out_waiting", 0) > 0 and time.monotonic() < deadline_s:
            time.sleep(0.002)

    def prefer_low_latency(self) -> None:
        """Ask an FTDI adapter to deliver every 1 ms, not every 16; warn with the cure when it refuses.

        Done before streaming (a change stalls reception for a moment). Ports without such a timer are left alone.
        """
        timer = SYSFS_TTY / Path(os.path.realpath(self.port)).name / "device" / "latency_timer"
        if _milliseconds(timer) <= 1:
            return
        try:
            self.serial.set_low_latency_mode(True)  # type: ignore[attr-defined]  # only ttys on Linux have it
        except (*LINE_ERRORS, AttributeError):
            _log.debug("%s does not take the low_latency flag", self.port)
        if (left_ms := _milliseconds(timer)) > 1:
            _log.warning(
                "%s delivers only every %d ms (USB latency timer), so samples arrive late and in bursts. "
                "As root add this udev rule and replug: %s",
                self.port,
                left_ms,
                UDEV_RULE,
            )


def _milliseconds(timer: Path) -> int:
    try:
        return int(timer.read_text())
    except (OSError, ValueError):
        return 0


def _unreachable(port: str, error: Exception) -> DeviceUnreachable:
    """Say what is wrong with the port, and what to do about it."""
    code = error.errno if isinstance(error, OSError) else None
    where = f"ft300 {port}"
    if port.startswith(SCHEME):
        return DeviceUnreachable(
            f"nothing accepts the connection ({error})", where=where, do="Start the serial server or check its address"
        )
    if code == errno.ENOENT:
        return DeviceUnreachable("there is no such port", where=where, do=_suggestion())
    if code in (errno.EACCES, errno.EPERM):
        return DeviceUnreachable(
            "you may not open this port", where=where, do='Run "sudo usermod -aG dialout $USER" and log in again'
        )
    if code in (errno.EAGAIN, errno.EBUSY):
        return DeviceUnreachable(
            "another program uses this port", where=where, do=f'Close it ("fuser -v {port}" names it)'
        )
    return DeviceUnreachable(
        f"it cannot be used as a serial port ({error})", where=where, do="Check the path, replug the adapter"
    )


def _suggestion() -> str:
    """Name the adapters that could be meant; nothing is opened to find out."""
    candidates = [info.device for info in list_ports.comports() if (info.vid, info.pid) in ADAPTER_USB_IDS]
    if candidates:
        return f"Adapters plugged in: {', '.join(candidates)} (better name them by /dev/serial/by-id)"
    return "No FTDI adapter is plugged in: check the USB cable (ls -l /dev/serial/by-id)"
