"""One small epoll loop with absolute deadlines, shared by control, gate and emulators.

One thread, no asyncio: file descriptors call a function when ready, timers call a function at an absolute
CLOCK_MONOTONIC time. Timers use one timerfd, because epoll's own timeout is rounded up to whole milliseconds.
"""

from __future__ import annotations

import ctypes
import heapq
import itertools
import os
import select
from collections.abc import Callable

from robot_io.clock import NS_PER_S, monotonic_ns

READ = select.EPOLLIN
WRITE = select.EPOLLOUT
HANGUP = select.EPOLLHUP | select.EPOLLERR

_CLOCK_MONOTONIC = 1
_TFD_NONBLOCK = os.O_NONBLOCK
_TFD_CLOEXEC = os.O_CLOEXEC
_TFD_TIMER_ABSTIME = 1
_FIRED = -1
"""Setting the timer again takes its expiration back: reading it away would be one more system call before each tick."""


class _Timespec(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_long), ("tv_nsec", ctypes.c_long))


class _Itimerspec(ctypes.Structure):
    _fields_ = (("it_interval", _Timespec), ("it_value", _Timespec))


_libc = ctypes.CDLL(None, use_errno=True)


class TimerFd:
    """A timerfd that fires at absolute CLOCK_MONOTONIC times (Linux timerfd_create(2); in `os` from Python 3.13)."""

    def __init__(self) -> None:
        self._fd: int = _libc.timerfd_create(_CLOCK_MONOTONIC, _TFD_NONBLOCK | _TFD_CLOEXEC)
        if self._fd < 0:
            raise OSError(ctypes.get_errno(), "timerfd_create failed")
        self._spec = _Itimerspec()

    def fileno(self) -> int:
        """Return the descriptor."""
        return self._fd

    def set_ns(self, deadline_ns: int) -> None:
        """Fire once at `deadline_ns` (at once when it is past); 0 disarms. An expiration not read is taken back."""
        self._spec.it_value.tv_sec, self._spec.it_value.tv_nsec = divmod(deadline_ns, NS_PER_S)
        if _libc.timerfd_settime(self._fd, _TFD_TIMER_ABSTIME, ctypes.byref(self._spec), None) != 0:
            raise OSError(ctypes.get_errno(), "timerfd_settime failed")

    def close(self) -> None:
        """Close the descriptor; idempotent."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


class Timer:
    """Handle of a timer; `cancel()` is idempotent."""

    __slots__ = ("callback", "deadline_ns", "period_ns")

    def __init__(self, deadline_ns: int, period_ns: int, callback: Callable[[int], None]) -> None:
        self.deadline_ns = deadline_ns
        self.period_ns = period_ns
        self.callback: Callable[[int], None] | None = callback

    def cancel(self) -> None:
        """Never call back again."""
        self.callback = None


class EventLoop:
    """Calls functions when descriptors are ready or deadlines pass; `run` ends after `stop`."""

    def __init__(self) -> None:
        self._epoll = select.epoll()
        self._handlers: dict[int, Callable[[int], None]] = {}
        self._timer_fd = TimerFd()
        self._epoll.register(self._timer_fd.fileno(), READ)
        self._heap: list[tuple[int, int, Timer]] = []
        self._order = itertools.count()
        self._armed_ns = 0
        self._running = False

    def add_fd(self, fd: int, on_ready: Callable[[int], None], events: int = READ) -> None:
        """Call `on_ready(event_mask)` whenever `fd` is ready for `events` (level-triggered)."""
        self._epoll.register(fd, events)
        self._handlers[fd] = on_ready

    def set_events(self, fd: int, events: int) -> None:
        """Change which events of a registered `fd` are waited for."""
        self._epoll.modify(fd, events)

    def remove_fd(self, fd: int) -> None:
        """Forget `fd`; call it before closing the descriptor. Unknown descriptors are ignored."""
        if self._handlers.pop(fd, None) is not None:
            self._epoll.unregister(fd)

    def call_at(self, deadline_ns: int, callback: Callable[[int], None]) -> Timer:
        """Call `callback(deadline_ns)` once, at or after the absolute time `deadline_ns`."""
        return self._push(Timer(deadline_ns, 0, callback))

    def call_every(self, period_ns: int, callback: Callable[[int], None], first_ns: int | None = None) -> Timer:
        """Call `callback(deadline_ns)` on an absolute grid.

        Late deadlines are called one after another (a device emulator owes each sample); a callback that
        wants to skip them compares its deadline with the clock.
        """
        first = monotonic_ns() + period_ns if first_ns is None else first_ns
        return self._push(Timer(first, period_ns, callback))

    def stop(self) -> None:
        """Make `run` return after the current callback."""
        self._running = False

    def run(self) -> None:
        """Serve until `stop` is called."""
        self._running = True
        while self._running:
            self.run_once(-1)

    def run_once(self, timeout_ms: int = -1) -> None:
        """Wait at most `timeout_ms` (-1: until something happens) and serve what is ready."""
        self._arm()
        for fd, events in self._epoll.poll(timeout_ms / 1000 if timeout_ms >= 0 else -1):
            if fd == self._timer_fd.fileno():
                self._armed_ns = _FIRED
                self._fire()
            else:
                handler = self._handlers.get(fd)  # an earlier handler of this round may have removed it
                if handler is not None:
                    handler(events)

    def close(self) -> None:
        """Close the loop's own descriptors (not those of its users); idempotent."""
        if not self._epoll.closed:
            self._timer_fd.close()
            self._epoll.close()

    def _push(self, timer: Timer) -> Timer:
        heapq.heappush(self._heap, (timer.deadline_ns, next(self._order), timer))
        return timer

    def _arm(self) -> None:
        while self._heap and self._heap[0][2].callback is None:
            heapq.heappop(self._heap)
        wanted = max(self._heap[0][0], 1) if self._heap else 0  # 0 would disarm
        if wanted != self._armed_ns:
            self._timer_fd.set_ns(wanted)
            self._armed_ns = wanted

    def _fire(self) -> None:
        now_ns = monotonic_ns()
        while self._heap and self._heap[0][0] <= now_ns:
            deadline_ns, _, timer = heapq.heappop(self._heap)
            callback = timer.callback
            if callback is None:
                continue
            if timer.period_ns:
                timer.deadline_ns = deadline_ns + timer.period_ns
                self._push(timer)
            callback(deadline_ns)
