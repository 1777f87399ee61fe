"""Who opens and closes a pty's slave, told by the kernel (inotify(7)): a close that is followed at once by an open
leaves no other trace on the master's side.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import struct
import termios

_CLOSED = 0x08 | 0x10
"""IN_CLOSE_WRITE, IN_CLOSE_NOWRITE."""
_OPENED = 0x20
"""IN_OPEN."""
_EVENT = struct.Struct("iIII")
_libc = ctypes.CDLL(None, use_errno=True)


class PtyWatch:
    """Counts who has the pty at `path` open; without a descriptor (`fileno` -1) where the kernel gives no more watches.

    Of two that open it at the very same time only one may be counted.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._holders = 0
        self._let_go = False
        self._opened_since = False
        self._fd: int = _libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self._fd >= 0 and _libc.inotify_add_watch(self._fd, path.encode(), _CLOSED | _OPENED) < 0:
            self.close()

    def fileno(self) -> int:
        """Return the descriptor that is readable when something has happened."""
        return self._fd

    def reopened(self) -> bool:
        """Return whether, since the last call, the last who had it open closed it and somebody opened it again."""
        since, self._opened_since = self._opened_since, False
        return self._count(self._take()) or since

    def nobody(self) -> None:
        """Discard what a client left unread and start anew: the master has seen that nobody has it open.

        The next one may have opened it since then, and may even have written and closed it: `reopened` tells that.
        """
        self._opened_since = self.flush() or any(event & _OPENED for event in self._take())
        self._holders = 0
        self._let_go = False

    def flush(self) -> bool:
        """Discard what a client has left unread, which a pty keeps for the next one; return what `reopened` would."""
        before = self.reopened()
        with contextlib.suppress(OSError):
            slave = os.open(self._path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
            termios.tcflush(slave, termios.TCIFLUSH)
            os.close(slave)
        events = self._take()
        for ours in (_OPENED, _CLOSED):
            if found := next((event for event in events if event & ours), 0):
                events.remove(found)
        return self._count(events) or before

    def close(self) -> None:
        """Stop watching; idempotent."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _take(self) -> list[int]:
        data = b""
        with contextlib.suppress(OSError):  # nothing has happened, or there is no watch
            data = os.read(self._fd, 4096)
        events, at = [], 0
        while at < len(data):
            _, mask, _, name_bytes = _EVENT.unpack_from(data, at)
            events.append(mask)
            at += _EVENT.size + name_bytes
        return events

    def _count(self, events: list[int]) -> bool:
        again = False
        for event in events:
            if event & _CLOSED:
                self._holders = max(self._holders - 1, 0)
                self._let_go = not self._holders
            elif event & _OPENED:
                again |= self._let_go
                self._holders, self._let_go = self._holders + 1, False
        return again
