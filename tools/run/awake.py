"""Keeps the machine from suspending while a push is under way, where the system can be asked to."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

SYSTEMD = Path("/run/systemd/system")
"""Exists where systemd runs, and only there can its tool ask for anything."""


@contextlib.contextmanager
def awake() -> Iterator[None]:
    """Hold the system back from suspending meanwhile; without a way to ask it, do nothing. Never fails, never waits.

    The hold ends with our end of a pipe, so also when this process is killed.
    """
    tool = shutil.which("systemd-inhibit") if SYSTEMD.is_dir() else None
    if tool is None:
        yield
        return
    command = [tool, "--what=sleep", "--mode=block", "--who=push", "--why=a robot is pushing", "cat"]
    try:
        holder = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    except OSError:
        yield
        return
    assert holder.stdin is not None
    try:
        yield
    finally:
        holder.stdin.close()
        try:
            holder.wait(1.0)
        except subprocess.TimeoutExpired:
            holder.kill()
            holder.wait()
