"""The law of a `push run`: its flags, and what a law of one's own needs before it moves a real robot."""

from __future__ import annotations

import argparse
import json
from typing import Any

from control.laws.shipped import SHIPPED, is_shipped
from robot_io.error_report import tell
from robot_io.errors import PushError, UsageError
from robot_io.rig.config import RigConfig
from tools.places import law_proof


def add_law_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags about the law."""
    parser.add_argument(
        "--law", metavar="LAW", help=f"{', '.join(SHIPPED)}, or your own as module:Class (default: the rig's)"
    )
    parser.add_argument("--controller", metavar="LAW", help="earlier name of --law")
    parser.add_argument(
        "--untested-law", action="store_true", help="let a law of your own move a real robot without an emulated run"
    )


def law_overrides(args: argparse.Namespace) -> list[str]:
    """Return the settings of these flags."""
    if args.controller is not None:
        tell("--controller is called --law now")
    return [f"control.law={json.dumps(law)}" for law in (args.controller, args.law) if law is not None]


def check_law(rig: RigConfig) -> None:
    """Raise UsageError for a law of one's own that has not passed an emulated run with this very source."""
    if not is_shipped(rig.control.law) and not law_proof.has_passed(rig.control.law_facts):
        raise UsageError(
            f"the law `{rig.control.law}` has not yet passed an emulated run with its present source",
            where="push run",
            do=f"Run it emulated first (push run emulated --law {rig.control.law}), or add --untested-law",
        )


def note_passed_law(rig: RigConfig, summary: dict[str, Any]) -> None:
    """Note for later that a law of one's own has passed, if every device was emulated."""
    if summary["exit_code"] == 0 and summary["level"] == "emulated" and not is_shipped(rig.control.law):
        try:
            law_proof.save(rig.control.law_facts, rig.name, summary["log"])
        except (OSError, PushError) as error:
            summary["notes"].append(f"that this law has passed could not be noted: {error}")
