"""The rows of this machine: may it run in real time, is there room, does it stay awake, is its clock set."""

from __future__ import annotations

import ctypes
import resource
import shutil
from pathlib import Path

from robot_io.ipc.process import leave_realtime, try_realtime
from robot_io.rig.config import RigConfig
from safety.gate_process import PRIORITY as HIGHEST_PRIORITY
from safety.motion_bounds import total_bounds
from tools.doctor.check import Check, Rows
from tools.run.awake import SYSTEMD
from tools.run.processes import MOST_DESCRIPTORS, RING_BYTES

PLAIN_RATE_HZ = 100.0
"""Without permission for real-time priority no higher loop rate is supported."""
LOG_BYTES_PER_S = 300_000
"""Twice what a run at 100 Hz was seen to log."""
STANDING_S = 60.0
"""Tare, waiting and the end of a run are logged, too."""
PROCESS_BYTES = 80_000_000
PROCESSES = 7
LOCKED_BYTES = 512_000_000
_CAP_IPC_LOCK = 14
_TIME_ERROR = 5
"""What adjtimex(2) returns while the clock is not synchronised."""
LIMITS_FILE = "/etc/security/limits.d/99-push.conf"


def host_checks(rig: RigConfig) -> list[Check]:
    """Return the rows of this machine."""
    rows = Rows("host")
    _scheduling(rows, rig)
    _limits(rows)
    _disk(rows, rig)
    _memory(rows)
    _suspend(rows)
    _clock(rows)
    return rows.all("this system does not say")


def _scheduling(rows: Rows, rig: RigConfig) -> None:
    if try_realtime(HIGHEST_PRIORITY):
        leave_realtime()
        rows.ok("scheduling", "real-time priority is allowed")
        return
    fix = f'Put "@YOUR_GROUP - rtprio 85" into {LIMITS_FILE} and log in again'
    rate_hz = rig.loop.rate_hz
    told = f"no permission for real-time priority: only {PLAIN_RATE_HZ:g} Hz is supported"
    rows.bad("scheduling", "failed" if rate_hz > PLAIN_RATE_HZ else "warning", told, fix, rate_hz, PLAIN_RATE_HZ, "Hz")


def _limits(rows: Rows) -> None:
    _, files = resource.getrlimit(resource.RLIMIT_NOFILE)
    memory, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if 0 <= files < MOST_DESCRIPTORS:
        told = f"a process may have {files} files open"
        fix = f"Allow more: ulimit -n {MOST_DESCRIPTORS}"
        rows.bad("limits", "failed", told, fix, float(files), float(MOST_DESCRIPTORS))
    elif 0 <= memory < LOCKED_BYTES and not _may_lock_any():
        told = f"a process may keep only {memory / 1e6:.0f} MB in memory: the loop may have to wait for the disk"
        fix = f'Put "@YOUR_GROUP - memlock unlimited" into {LIMITS_FILE} and log in again'
        rows.bad("limits", "warning", told, fix, memory / 1e6, LOCKED_BYTES / 1e6, "MB")
    else:
        rows.ok("limits", "enough open files, enough memory that may be locked")


def _may_lock_any() -> bool:
    """Return whether this process has CAP_IPC_LOCK, which no limit binds."""
    words = Path("/proc/self/status").read_text().split()
    return bool(int(words[words.index("CapEff:") + 1], 16) >> _CAP_IPC_LOCK & 1)


def _disk(rows: Rows, rig: RigConfig) -> None:
    folder = Path.cwd()
    free, needed = shutil.disk_usage(folder).free, LOG_BYTES_PER_S * (STANDING_S + total_bounds(rig).moving_s)
    told = f"{free / 1e9:.1f} GB free at {folder}, a run of this rig may log {needed / 1e9:.2f} GB"
    if free >= needed:
        rows.ok("disk", told, free / 1e9, needed / 1e9, "GB")
    else:
        rows.bad("disk", "failed", told, "Free some space, or change to another disk", free / 1e9, needed / 1e9, "GB")


def _memory(rows: Rows) -> None:
    needed = PROCESSES * PROCESS_BYTES + sum(RING_BYTES.values())
    words = Path("/proc/meminfo").read_text().split()
    free = int(words[words.index("MemAvailable:") + 1]) * 1024
    told = f"{free / 1e9:.1f} GB of memory free, a run takes up to {needed / 1e9:.1f} GB"
    if free >= needed:
        rows.ok("memory", told, free / 1e9, needed / 1e9, "GB")
    else:
        rows.bad("memory", "warning", told, "End other programs", free / 1e9, needed / 1e9, "GB")


def _suspend(rows: Rows) -> None:
    if not SYSTEMD.is_dir():
        rows.skip("suspend", "no systemd here that could be asked to stay awake")
    elif shutil.which("systemd-inhibit") is None:
        told, fix = "nothing keeps this machine awake during a push", "Install systemd-inhibit, or turn suspending off"
        rows.bad("suspend", "warning", told, fix)
    else:
        rows.ok("suspend", "systemd-inhibit keeps this machine awake during a push")


def _clock(rows: Rows) -> None:
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(512))  # all zero: it only reads
    if state == _TIME_ERROR:
        told, fix = "this machine's clock is not synchronised", "Let chrony or systemd-timesyncd set it"
        rows.bad("clock", "warning", told, fix)
    elif state >= 0:
        rows.ok("clock", "this machine's clock is synchronised")
