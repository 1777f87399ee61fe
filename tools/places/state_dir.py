"""The user's folder for what outlives a run, for no eyes but theirs: locks and saved tares."""

from __future__ import annotations

import os
import re
from pathlib import Path

from robot_io.errors import EnvironmentFault


def state_dir() -> Path:
    """Create and return the user's state folder for this program (XDG_STATE_HOME). Raises EnvironmentFault."""
    root = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    path = Path(root) / "single-point-push"
    try:
        path.mkdir(parents=True, exist_ok=True)
        path.chmod(0o700)
    except OSError as error:
        raise EnvironmentFault(
            f"the state folder cannot be created: {error.strerror}", where=str(path), do="Set XDG_STATE_HOME"
        ) from None
    return path


def file_name(rig_name: str) -> str:
    """Return a rig's name as a file name."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", rig_name) or "rig"
