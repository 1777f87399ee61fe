"""The user's folder for what outlives a run: locks and saved tares."""

from __future__ import annotations

import fcntl
import os
import re
from pathlib import Path
from typing import Self

from robot_io.errors import EnvironmentFault


def state_dir() -> Path:
    """Create and return the user's state folder for this program (XDG_STATE_HOME). Raises EnvironmentFault."""
    root = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    path = Path(root) / "single-point-push"
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentFault(
            f"the state folder cannot be created: {error.strerror}", where=str(path), do="Set XDG_STATE_HOME"
        ) from None
    return path


def file_name(rig_name: str) -> str:
    """Return a rig's name as a file name."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", rig_name) or "rig"


class RigLock:
    """At most one run per rig on this machine; held until the process ends, released by the kernel."""

    def __init__(self, rig_name: str) -> None:
        """Acquire the lock. Raises EnvironmentFault if another run holds it or its file cannot be opened."""
        self._path = state_dir() / f"{file_name(rig_name)}.lock"
        try:
            self._fd = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise EnvironmentFault(
                f"the rig's lock cannot be opened: {error.strerror}", where=str(self._path), do="Remove that file"
            ) from None
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(self._fd, 32, 0).decode(errors="replace").strip()
            os.close(self._fd)
            raise EnvironmentFault(
                f"the rig is in use by another run (process {holder or 'unknown'})",
                where=rig_name,
                do="Wait for it, or stop it with Ctrl-C in its terminal",
            ) from None
        os.ftruncate(self._fd, 0)
        os.pwrite(self._fd, f"{os.getpid()}\n".encode(), 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._fd)
