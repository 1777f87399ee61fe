"""`push log zip DIR`: pack runs for others, as the artifact of a paper: addresses and names removed."""

from __future__ import annotations

import argparse
import getpass
import platform
from pathlib import Path
from typing import Any

from robot_io.error_report import tell
from robot_io.errors import EnvironmentFault, LogDamaged, UsageError
from tools.log.artifact import pack
from tools.replay.verified_log import VerifiedLog
from tools.terminal.arguments import named_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the folder and where the zip goes."""
    parser.add_argument("log", type=named_path, metavar="DIR", help="a run's folder, or one with runs in it")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout, last")
    parser.add_argument("--out", type=named_path, metavar="FILE", help="the zip (default: DIR.zip)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Pack; return what was done. Raises UsageError, LogDamaged for a log that cannot be trusted, EnvironmentFault."""
    top: Path = args.log
    out: Path = args.out or top.with_name(f"{top.resolve().name}.zip")
    if not top.is_dir():
        raise UsageError("this is not a folder", where=str(top), do="Name a run's folder, or one with runs in it")
    logs = sorted({file for name in ("run.mcap", "run_[0-9]*.mcap") for file in top.rglob(name)})
    if not logs:
        raise UsageError("there is no run.mcap in this folder or below it", where=str(top), do="Name another")
    if out.exists():
        raise UsageError("it exists already", where=str(out), do="Give another one with --out")
    for log in logs:
        _require_trusted(log)
    try:
        packed = pack(logs, top, out, (_user(), *platform.node().split(".")))
    except OSError as error:
        out.unlink(missing_ok=True)
        raise EnvironmentFault(
            f"the zip cannot be written: {error.strerror}", where=str(out), do="Give another --out"
        ) from None
    except BaseException:
        out.unlink(missing_ok=True)
        raise
    tell(f"{out}: {len(packed.runs)} run{'s' * (len(packed.runs) != 1)}")
    for kind, count in packed.removed.items():
        tell(f"removed: {kind}, {count} times")
    for name in packed.left_out:
        tell(f"left out: {name}")
    return {"out": str(out), "runs": packed.runs, "removed": packed.removed, "left_out": packed.left_out}


def _require_trusted(log: Path) -> None:
    """Verify chain and seal: what is sealed again must be what was recorded."""
    verified = VerifiedLog(log)
    for _ in verified.messages():
        continue
    if not verified.config_intact:
        raise LogDamaged("its config.toml was changed after the log was finished", where=str(log))


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return ""
