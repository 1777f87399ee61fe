"""The pty that acts as an FT 300's serial port, with its stable name, client detection and line speed.

The slave is not held open here, so that `fuser` shows only the client; the kernel then reports a hang-up while
nobody has it open, and bytes sent meanwhile are lost, as with a real port. Not modelled: parity (a pty refuses
to set it), modem lines, and the size of a real port's buffers (a pty keeps up to 64 kB for a client that has
it open and does not read). Closing a real port waits until everything is sent; closing a pty does not wait, so the
emulator takes the port for closed until then.
"""

from __future__ import annotations

import contextlib
import os
import select
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from robot_io.clock import NS_PER_MS
from robot_io.errors import EnvironmentFault
from robot_io.ipc.event_loop import HANGUP, READ, EventLoop, Timer
from sim_backend.ft300.pty_watch import PtyWatch

LOOK_PERIOD_NS = 5 * NS_PER_MS
READ_BYTES = 2048
BAUD_AT_FIRST = termios.B9600
"""A serial port's speed before anyone sets it (Linux)."""


class PtyPort:
    """A pty with its slave in raw mode, served in `loop`; bytes from the client go to `on_bytes`.

    `on_opened` is called when a client has opened the port, after the bytes of the one before.
    """

    def __init__(
        self,
        loop: EventLoop,
        on_bytes: Callable[[bytes], None],
        on_opened: Callable[[], None],
        link: str | None = None,
    ) -> None:
        self._loop = loop
        self._on_bytes = on_bytes
        self._on_opened = on_opened
        self._link = Path(link) if link else None
        self._master = -1
        self._look: Timer | None = None
        self._watch: PtyWatch | None = None
        self._hang_up_poll = select.poll()
        self._paused = False
        self.path = ""
        self.attached = False
        self.attaches = 0

    def open(self) -> None:
        """Create the pty and its link. Raises EnvironmentFault when no pty is available or the link's path is taken."""
        if self._link is not None and self._link.exists() and not self._link.is_symlink():
            raise EnvironmentFault(
                "something that is not a link is in the way", where=str(self._link), do="Choose another name"
            )
        try:
            self._master, slave = os.openpty()
        except OSError as error:
            raise EnvironmentFault(
                f"this machine provides no pseudo-terminal ({error})",
                where="/dev/pts",
                do="Mount devpts there, or close some terminals",
            ) from error
        # Before any byte is sent: a cooked line would echo the stream to its sender and change 0x0D to 0x0A.
        tty.setraw(slave)
        attributes = termios.tcgetattr(slave)
        attributes[4] = attributes[5] = BAUD_AT_FIRST
        termios.tcsetattr(slave, termios.TCSANOW, attributes)
        self.path = os.ttyname(slave)
        os.close(slave)
        os.set_blocking(self._master, False)
        self._hang_up_poll = select.poll()
        self._hang_up_poll.register(self._master, select.POLLIN)  # a hang-up is always reported
        self._watch = PtyWatch(self.path)
        if self._watch.fileno() >= 0:
            self._loop.add_fd(self._watch.fileno(), self._on_watch)
        if self._link is not None:
            beside = self._link.with_name(f"{self._link.name}.{os.getpid()}")
            beside.symlink_to(self.path)
            beside.replace(self._link)
        self._paused = False
        self._await_client()

    def close(self) -> None:
        """Hang up: the client's port behaves as that of an unplugged adapter. Idempotent."""
        if self._master < 0:
            return
        if self._look is not None:
            self._look.cancel()
            self._look = None
        if self._watch is not None:
            self._loop.remove_fd(self._watch.fileno())
            self._watch.close()
            self._watch = None
        self._loop.remove_fd(self._master)
        os.close(self._master)
        self._master = -1
        self.attached = False
        if self._link is not None and self._link.is_symlink() and str(self._link.readlink()) == self.path:
            self._link.unlink()
        self.path = ""

    def write(self, data: bytes) -> int:
        """Send to the client; return how many bytes were accepted (the rest is lost: port not open, or full)."""
        if not self.attached:
            return 0
        try:
            return os.write(self._master, data)
        except OSError:  # full, or closed a moment ago
            return 0

    def baud_is(self, speed: int) -> bool:
        """Return whether the client has set this speed (a termios constant)."""
        _, _, _, _, input_speed, output_speed, _ = termios.tcgetattr(self._master)
        return bool(input_speed == speed and output_speed == speed)

    def pause(self) -> None:
        """Read nothing from the client until `resume` (its output queue fills up meanwhile)."""
        if self.attached and not self._paused:
            self._paused = True
            self._loop.set_events(self._master, 0)

    def resume(self) -> None:
        """Read bytes again."""
        if self.attached and self._paused:
            self._loop.set_events(self._master, READ)
        self._paused = False

    def look(self) -> None:
        """Notice at once who has opened or closed the port."""
        if self._watch is not None:
            self._on_watch(0)

    def _on_watch(self, _events: int) -> None:
        assert self._watch is not None
        if not self.attached:
            self._on_look(0)
        elif self._watch.reopened():
            self._take_rest()
            self._watch.flush()
            self.attaches += 1
            self._on_opened()

    def _await_client(self) -> None:
        self.attached = False
        self._look = self._loop.call_every(LOOK_PERIOD_NS, self._on_look)

    def _on_look(self, _deadline_ns: int) -> None:
        """Check whether a client opened the slave: the hang-up is gone (a client that only listens sends nothing).

        A client may have opened, written and closed it since the last check.
        """
        assert self._watch is not None
        assert self._look is not None
        reopened = self._watch.reopened()
        state = next((events for _, events in self._hang_up_poll.poll(0)), 0)
        if reopened or state & select.POLLHUP:
            self._take_rest()
        if state & select.POLLHUP:
            return
        self._look.cancel()
        self._look = None
        self.attached = True
        self.attaches += 1
        self._paused = False
        self._loop.add_fd(self._master, self._on_ready)
        self._on_opened()

    def _on_ready(self, events: int) -> None:
        if not events & HANGUP:
            if data := self._read():
                self._on_bytes(data)
            return
        # At once: the client may open it again within a millisecond, and then the hang-up is gone.
        assert self._watch is not None
        self._take_rest()
        self._loop.remove_fd(self._master)
        self._watch.nobody()
        self._await_client()

    def _take_rest(self) -> None:
        while data := self._read():
            self._on_bytes(data)

    def _read(self) -> bytes:
        with contextlib.suppress(OSError):  # EIO: the client closed it; EAGAIN: nothing
            return os.read(self._master, READ_BYTES)
        return b""
