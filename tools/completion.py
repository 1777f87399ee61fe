"""`push completion bash|zsh`: print the script by which a shell completes commands, options and paths.

Above `cli` and not among the commands, because it reads the table of all of them.
"""

from __future__ import annotations

import argparse
import importlib

from tools.cli import COMMANDS
from tools.terminal.arguments import name_or_path, named_path

SHELLS = ("bash", "zsh")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the shell."""
    parser.add_argument("shell", choices=SHELLS, help="the shell that is to complete")


def run(args: argparse.Namespace) -> int:
    """Print the script; return 0."""
    import shtab

    print(shtab.complete(whole_parser(), shell=args.shell))
    return 0


def whole_parser() -> argparse.ArgumentParser:
    """Return one parser of every command with all its options, which the program itself never builds."""
    root = argparse.ArgumentParser(prog="push")
    root.add_argument("--version", action="store_true", help="the version")
    commands = root.add_subparsers()
    groups: dict[str, argparse._SubParsersAction[argparse.ArgumentParser]] = {}
    for name, command in COMMANDS.items():
        group, _, word = name.rpartition(" ")
        if group and group not in groups:
            groups[group] = commands.add_parser(group, help=f"{group} ...").add_subparsers()
        parser = (groups[group] if group else commands).add_parser(word, help=command.summary)
        if any(other.startswith(f"{name} ") for other in COMMANDS):  # its second word, or its own arguments
            groups[name] = parser.add_subparsers()
        importlib.import_module(command.module).add_arguments(parser)
        _complete_paths(parser)
    return root


def _complete_paths(parser: argparse.ArgumentParser) -> None:
    """Mark every argument that is a path, also those of a command's actions."""
    import shtab

    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                _complete_paths(below)
        elif action.type in (named_path, name_or_path):
            action.complete = shtab.FILE  # type: ignore[attr-defined]
