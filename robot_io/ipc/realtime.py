"""What a process with a deadline takes of the system, and a record of what it got.

sched_setscheduler(2), mlockall(2), prctl(2) PR_SET_TIMERSLACK, sched_setaffinity(2), and /dev/cpu_dma_latency of the
kernel (Documentation/power/pm_qos_interface.rst: the request lasts as long as the file is open).
"""

from __future__ import annotations

import os
import struct

import msgspec

from robot_io.ipc.process import lock_memory, set_timer_slack_1ns, try_realtime

DMA_LATENCY_FILE = "/dev/cpu_dma_latency"
NO_CPU = -1


class RealtimeFacts(msgspec.Struct, frozen=True):
    """What this process got."""

    fifo: bool = False
    """Real-time priority (SCHED_FIFO)."""
    memory_locked: bool = False
    idle_kept_shallow: bool = False
    """Whether processors are kept out of deep sleep, from which waking takes up to some hundred microseconds."""
    cpu: int = NO_CPU
    """The processor that this process is bound to; -1 for any."""
    spin_us: float = 0.0
    """How long before a deadline the loop wakes up and waits awake."""


def set_up_realtime(priority: int, *, cpu: int = NO_CPU, spin_us: float = 0.0) -> RealtimeFacts:
    """Take everything the system allows, in the thread that will keep the deadlines; call it after the imports.

    priority: of SCHED_FIFO, 1..99. cpu: the processor to stay on, -1 for any. spin_us: wanted; 0 without FIFO or with a
    single processor, where a loop that waits awake would take the time of those it waits for.
    Raises nothing: what the system denies is False in the result (cpu: -1).
    """
    set_timer_slack_1ns()
    fifo = try_realtime(priority)
    return RealtimeFacts(
        fifo,
        lock_memory(),
        _keep_idle_shallow(),
        _bind(cpu),
        spin_us if fifo and (os.cpu_count() or 1) > 1 else 0.0,
    )


def _bind(cpu: int) -> int:
    if cpu == NO_CPU:
        return NO_CPU
    try:
        os.sched_setaffinity(0, {cpu})
    except OSError:  # no such processor, or not ours to use
        return NO_CPU
    return cpu


def _keep_idle_shallow() -> bool:
    """Ask for a wake-up latency of 0 us until this process ends: its descriptor is left open on purpose."""
    try:
        fd = os.open(DMA_LATENCY_FILE, os.O_WRONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        os.write(fd, struct.pack("=i", 0))
    except OSError:
        os.close(fd)
        return False
    return True
