"""Arguments that several commands have: which rig, its settings, and faults to inject."""

from __future__ import annotations

import argparse

from tools.terminal.arguments import name_or_path


def add_rig(parser: argparse.ArgumentParser) -> None:
    """Declare the rig (`rig`, by default the emulated one) and `--set` (`overrides`, a list of key=value)."""
    parser.add_argument(
        "rig", nargs="?", type=name_or_path, default="emulated", help="a shipped rig or a TOML file (default: emulated)"
    )
    parser.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change one value of the rig, repeatable",
    )


def add_faults(parser: argparse.ArgumentParser, words: str) -> None:
    """Declare `--fault` (`faults`, a list); words: its help."""
    parser.add_argument("--fault", dest="faults", action="append", default=[], metavar="WORDS", help=words)
