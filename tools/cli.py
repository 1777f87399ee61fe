"""The `push` program: finds the command's module, imports only that one, and reports every error in one sentence.

A command module has `add_arguments(parser)` and `run(args) -> int`. Commands of two words (`bench physics`) are
keys with a space. `--json` promises exactly one object, on one line, last on stdout, errors included.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import os
import select
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any, NamedTuple, NoReturn

from robot_io.error_report import discard_stdout, ignoring_output_errors, report, unexpected
from robot_io.errors import EnvironmentFault, OperatorStop, PushError, UsageError

BROKEN_PIPE = 141
"""128 + SIGPIPE: the reader of our output has closed it (`push log cat LOG | head`)."""


class Command(NamedTuple):
    """A command's module, a short summary and two examples."""

    module: str
    summary: str
    examples: tuple[str, str]


COMMANDS = {
    "run": Command(
        "tools.commands.run",
        "one push, on hardware, emulated or simulated",
        ('push run emulated --distance-m 2 --note "box, 2 kg"', "push run sim --fast --trials 3 --json"),
    ),
    "stop": Command(
        "tools.commands.stop",
        "stop the runs under way, or a rig's base by zeros",
        ("push stop", "push stop emulated --json"),
    ),
    "doctor": Command(
        "tools.commands.doctor",
        "look at every device, this machine and the rig; nothing moves",
        ("push doctor emulated", "push doctor my-rig.toml --json"),
    ),
    "watch": Command(
        "tools.commands.watch",
        "force, arm and base, live; nothing moves",
        ("push watch emulated", "push watch my-rig.toml --json"),
    ),
    "calibrate": Command(
        "tools.commands.calibrate",
        "measure tare, frames, contact point or path, by hand; nothing is moved",
        (
            "push calibrate bias emulated --rehearse",
            "push calibrate frame my-rig.toml --cord 0,120,240 --apply my-rig.toml",
        ),
    ),
    "replay": Command(
        "tools.commands.replay",
        "re-run a log's ticks and compare every byte",
        ("push replay runs/demo/run.mcap", "push replay runs/demo/run.mcap --json"),
    ),
    "report": Command(
        "tools.commands.report",
        "the page of a run, or one page that compares several",
        ("push report runs/demo --png", "push report runs/one runs/two --out runs/compared --gif"),
    ),
    "view": Command(
        "tools.commands.view",
        "layouts for Rerun, Lichtblick and Foxglove; opens one that is installed",
        ("push view runs/demo", "push view runs/demo --out layouts --json"),
    ),
    "log": Command(
        "tools.commands.log",
        "inspect, export or repair a log",
        ("push log info runs/demo/run.mcap", "push log recover runs/demo/run.mcap"),
    ),
    "sweep": Command(
        "tools.commands.sweep",
        "many simulated pushes, and the paper's figures",
        ("push sweep --out sweeps/paper", "push sweep my-grid.toml --out sweeps/mine --resume"),
    ),
    "study": Command(
        "tools.commands.study",
        "many whole pushes over settings, laws and seeds, with tables and figures",
        ("push study floors --out studies/floors", "push study my-study.toml --out studies/mine --resume"),
    ),
    "study show": Command(
        "tools.study.show",
        "the runs of a study, filtered, sorted or summed up",
        ("push study show studies/mine --where verdict!=done", "push study show studies/mine --by law"),
    ),
    "study rerun": Command(
        "tools.study.rerun",
        "run a study again: the same bytes, or what differs",
        ("push study rerun studies/mine", "push study rerun studies/mine --json"),
    ),
    "tune": Command(
        "tools.commands.tune", "recommend gains, with a map of the stable ones", ("push tune", "push tune --json")
    ),
    "faults": Command(
        "tools.commands.faults",
        "the fault table; with --run every row proved",
        ("push faults", "push faults --run --only F01 --json"),
    ),
    "emulate": Command(
        "tools.commands.emulate",
        "the wire emulators on their own, until stopped",
        ("push emulate ft300 --wrench=-10,0,0,0,0,0", "push emulate all --json"),
    ),
    "config": Command(
        "tools.commands.config",
        "show or check a rig with all its values, or a schema for editors",
        ("push config show emulated --set control.k_f=0.1", "push config check my-rig.toml"),
    ),
    "completion": Command(
        "tools.completion",
        "the script by which bash or zsh complete commands and options",
        ("push completion bash", "push completion zsh"),
    ),
    "bench sim": Command(
        "tools.bench.sim",
        "measure how much faster than real time level sim is",
        ("push bench sim", "push bench sim --distance-m 2 --json"),
    ),
    "bench physics": Command(
        "tools.bench.physics",
        "measure the slider's solvers",
        ("push bench physics", "push bench physics --json"),
    ),
    "bench loop": Command(
        "tools.bench.loop",
        "measure how late the control loop wakes up on this machine",
        ("push bench loop --full-stack", "push bench loop --rate 100 --load --json"),
    ),
    "bench latency": Command(
        "tools.bench.latency",
        "measure the way from a force at the sensor to the command at the base",
        ("push bench latency", "push bench latency --steps 20 --json"),
    ),
}

ACTIONS = {
    "log info": ("push log info runs/demo", "push log info runs/demo --json"),
    "log cat": ("push log cat runs/demo --topics /safety/event", "push log cat runs/demo | head -3"),
    "log export": ("push log export runs/demo", "push log export runs/demo --signals"),
    "log recover": ("push log recover runs/demo", "push log recover runs/demo --out whole.mcap"),
    "log zip": ("push log zip runs/demo", "push log zip runs --out artifact.zip"),
    "calibrate bias": ("push calibrate bias --rehearse", "push calibrate bias my-rig.toml --seconds 120 --json"),
    "calibrate sign": ("push calibrate sign --rehearse", "push calibrate sign my-rig.toml --apply my-rig.toml"),
    "calibrate frame": ("push calibrate frame my-rig.toml --cord", "push calibrate frame --from runs/one runs/two"),
    "calibrate contact": ("push calibrate contact --rehearse", "push calibrate contact my-rig.toml --marking-mm 2"),
    "calibrate marker": ("push calibrate marker --rehearse", "push calibrate marker my-rig.toml --out marker.toml"),
    "calibrate path": ("push calibrate path my-rig.toml --two-places", "push calibrate path --rehearse --json"),
    "emulate ft300": ("push emulate ft300 --wrench=-10,0,0,0,0,0", "push emulate ft300 --streaming --latency-ms 16"),
    "emulate ur": ("push emulate ur --model ur10e", "push emulate ur --model ur5e --wrench=0,0,-15,0,0,0 --json"),
    "emulate ur10": ("push emulate ur10", "push emulate ur10 --host 127.0.0.11 --json"),
    "emulate ridgeback": ("push emulate ridgeback", "push emulate ridgeback --port 0 --json"),
    "emulate all": ("push emulate all", "push emulate all barrel --seed 3 --json"),
}
"""Two examples for each action of a command that has some."""


class Parser(argparse.ArgumentParser):
    """An argparse parser that raises instead of exiting, so that `--json` also covers usage errors.

    Neither it nor those of its actions take abbreviations: a new option would change what they mean.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        """Raise UsageError with argparse's message."""
        raise UsageError(message, where="command line", do=f"`{self.prog} --help` shows the usage")


def main(argv: Sequence[str]) -> int:
    """Run one command and return its exit code; never raises except SystemExit for `--help`."""
    keep_standard_descriptors()
    as_json = "--json" in argv
    try:
        code = dispatch(argv)
        if sys.stdout is not None:
            sys.stdout.flush()
    except PushError as error:
        return report(error, as_json=as_json)
    except KeyboardInterrupt:
        return report(OperatorStop("stopped by the operator"), as_json=as_json)
    except Exception as error:
        if isinstance(error, BrokenPipeError) and _reader_of_stdout_is_gone():
            discard_stdout()
            return BROKEN_PIPE
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:
            where = str(error.filename or "")  # empty: the disk that stdout goes to
            with ignoring_output_errors():
                return report(EnvironmentFault("there is no space left on the disk", where=where), as_json=as_json)
        if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
            few = EnvironmentFault("too many open files", do="Allow more: ulimit -n 1024")
            return report(few, as_json=as_json)
        return report(unexpected(error), as_json=as_json)
    return code


def dispatch(argv: Sequence[str]) -> int:
    """Find the command in `argv`, import its module and run it."""
    name = " ".join(argv[:2]) if " ".join(argv[:2]) in COMMANDS else " ".join(argv[:1])
    if name not in COMMANDS:
        return _overview(argv)
    module = importlib.import_module(COMMANDS[name].module)
    args = parser_of(name, module).parse_args(list(argv[len(name.split()) :]))
    return int(module.run(args))


def parser_of(name: str, module: ModuleType) -> Parser:
    """Return the parser of one command, with its examples below the help."""
    command = COMMANDS[name]
    parser = Parser(
        prog=f"push {name}",
        description=f"{command.summary[0].upper()}{command.summary[1:]}.",
    )
    module.add_arguments(parser)
    _show_examples(parser, command.examples)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, below in action.choices.items():
                _show_examples(below, ACTIONS.get(f"{name} {word}", ()))
    return parser


def _show_examples(parser: argparse.ArgumentParser, examples: Sequence[str]) -> None:
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "\n".join(["examples:", *(f"  {example}" for example in examples)])


def _overview(argv: Sequence[str]) -> int:
    """Handle `push`, `push --help`, `push --version`, the first word of a two-word command, and unknown commands."""
    first = argv[0] if argv else "--help"
    group = {name: command for name, command in COMMANDS.items() if name.startswith(f"{first} ")}
    if first == "--version":
        from importlib.metadata import version

        print(f"push {version('single-point-push')}")
        return 0
    if first in ("-h", "--help", "help") or (group and set(argv[1:]) <= {"-h", "--help"}):
        shown = group or COMMANDS
        width = max(len(name) for name in shown)
        lines = [f"  {name.ljust(width)}  {command.summary}" for name, command in shown.items()]
        example = next(iter(shown.values())).examples[0]
        print("usage: push COMMAND ...\n\ncommands:\n" + "\n".join(lines))
        print(f"\nexamples:\n  {example}\n  push {next(iter(shown))} --help")
        return 0
    if first.startswith("-"):
        raise UsageError(f"`{first}` is not an option of push", do="A command comes first: `push --help` lists them")
    if group:
        raise UsageError(f"`push {first}` needs one of: {', '.join(name.split()[1] for name in group)}")
    import difflib

    near = difflib.get_close_matches(first, [name.split()[0] for name in COMMANDS], n=1)
    hint = f"Did you mean `push {near[0]}`?" if near else "`push --help` lists the commands"
    raise UsageError(f"there is no command `{first}`", do=hint)


def keep_standard_descriptors() -> None:
    """Open /dev/null for each of the descriptors 0, 1, 2 that is closed.

    Otherwise the next device opened would get that number, and a library that writes to descriptor 2
    (ur_rtde does) would write to the device.
    """
    for fd in (0, 1, 2):
        try:
            os.fstat(fd)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is fd


def _reader_of_stdout_is_gone() -> bool:
    poll = select.poll()
    poll.register(1, 0)
    return any(events & select.POLLERR for _, events in poll.poll(0))
