"""The code that writes a log: format, commit, uncommitted changes, and the versions of the packages that matter."""

from __future__ import annotations

import os
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from robot_io import __version__
from robot_io.log.log_format import FORMAT_FACT, LOG_FORMAT
from robot_io.rig.config import RigConfig

COMMIT_FACT, DIRTY_FACT, PROGRAM_FACT = "commit", "dirty", "program"
ENGINE_FACT = "mujoco"
GIT_MAX_S = 0.2
_CHECKOUT = Path(__file__).resolve().parents[3]
_PACKAGES = ("numpy", "mcap", "msgspec", "ur-rtde")
# Read only: git writes nothing into the repository and starts no program that its settings name.
_GIT = ("git", "--no-optional-locks", "-c", "core.fsmonitor=false", "status", "--porcelain=v2", "--branch", "-uno")


@cache
def code_facts() -> dict[str, str]:
    """Return the facts, collected once per process; no commit without a checkout or if git does not answer."""
    return {
        FORMAT_FACT: str(LOG_FORMAT),
        PROGRAM_FACT: f"single-point-push {__version__}",
        **commit_of(_CHECKOUT),
        **{name: found for name in _PACKAGES if (found := _version(name))},
    }


def engine_facts(rig: RigConfig) -> dict[str, str]:
    """Return the version of the engine that moves the world's object; empty for the closed form, which is ours."""
    return {ENGINE_FACT: _version("mujoco")} if rig.world.engine == "mujoco" else {}


def commit_of(checkout: Path) -> dict[str, str]:
    """Return commit and dirty flag ("True": tracked files were changed) of a checkout; empty if it is not one."""
    if not (checkout / ".git").exists():  # otherwise git would answer for an enclosing repository
        return {}
    environment = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    try:
        asked = subprocess.run(
            _GIT, cwd=checkout, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=GIT_MAX_S
        )
    except (OSError, subprocess.TimeoutExpired):
        return {}
    lines = asked.stdout.decode(errors="replace").splitlines()
    commit = next((line.removeprefix("# branch.oid ") for line in lines if line.startswith("# branch.oid ")), "")
    if asked.returncode or len(commit) not in (40, 64):  # "(initial)": no commit yet
        return {}
    return {COMMIT_FACT: commit, DIRTY_FACT: str(any(not line.startswith("#") for line in lines))}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
