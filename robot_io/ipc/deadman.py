"""A process that the kernel kills when it stops renewing: also one that is frozen, and can do nothing itself.

A timer of timer_create(2) whose signal is SIGKILL: that one ends a stopped process as well.
"""

from __future__ import annotations

import ctypes
import signal
import time
from typing import ClassVar

_SIGEV_SIGNAL = 0


class _SigEvent(ctypes.Structure):
    """`struct sigevent` of <signal.h>: 64 bytes on every Linux."""

    _fields_: ClassVar = [
        ("value", ctypes.c_void_p),
        ("signo", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("rest", ctypes.c_char * 48),
    ]


class _TimerSpec(ctypes.Structure):
    """`struct itimerspec` of <time.h>: interval, then the first time, each in s and ns."""

    _fields_: ClassVar = [(name, ctypes.c_long) for name in ("every_s", "every_ns", "first_s", "first_ns")]


class Deadman:
    """Kills this process `after_s` after the last `renew`. Begins with the first one; `release` ends it.

    Raises OSError where the system has no more timers.
    """

    def __init__(self, after_s: int) -> None:
        self._libc = _library()
        self._spec = _TimerSpec(0, 0, after_s, 0)
        self._timer = ctypes.c_void_p()
        event = _SigEvent(None, int(signal.SIGKILL), _SIGEV_SIGNAL, b"")
        if self._libc.timer_create(time.CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(self._timer)) != 0:
            code = ctypes.get_errno()
            raise OSError(code, "timer_create failed")

    def renew(self) -> None:
        """Begin the time anew."""
        self._libc.timer_settime(self._timer, 0, ctypes.byref(self._spec), None)

    def release(self) -> None:
        """Let the process live on without renewing."""
        self._libc.timer_settime(self._timer, 0, ctypes.byref(_TimerSpec()), None)


def _library() -> ctypes.CDLL:
    libc = ctypes.CDLL(None, use_errno=True)
    # Before glibc 2.34 these functions were in a library of their own.
    return libc if hasattr(libc, "timer_create") else ctypes.CDLL("librt.so.1", use_errno=True)
