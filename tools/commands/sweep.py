"""`push sweep`: many simulated pushes at once; without a grid, the paper's complete simulation study."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from robot_io.error_report import say_json, tell
from robot_io.errors import UsageError
from tools.parallel.work import Work, add_work_arguments, run_parts, working
from tools.sweep.grid import check_law, load_grid
from tools.sweep.paper import paper_study
from tools.sweep.plan import Plan, lanes_plan
from tools.terminal.arguments import name_or_path, named_path, number, pair


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "grid", nargs="?", type=name_or_path, default="paper", help="paper (default), or a TOML grid file"
    )
    parser.add_argument(
        "--out", type=named_path, metavar="DIR", help="folder for the results (default: sweeps/NAME-TIME)"
    )
    parser.add_argument("--resume", action="store_true", help="continue the study in --out, skipping finished parts")
    parser.add_argument(
        "--gains",
        type=pair(0, 10, "K_F,K_Y"),
        metavar="K_F,K_Y",
        help="gains for all cases, for example --gains=0.1,0.3",
    )
    parser.add_argument("--law", metavar="LAW", help="the law of all cases, one of the shipped ones")
    parser.add_argument("--open-loop", action="store_true", help="the same as --law open-loop")
    parser.add_argument("--dt", type=number(1e-6, 100), metavar="S", help="simulation step in s")
    add_work_arguments(parser)
    parser.add_argument("--json", action="store_true", help="the summary as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Run the study and write its results; return the exit code."""
    from tools.parallel.store import Store, fingerprint

    began = time.monotonic()
    plan = _plan(args)
    if args.resume and not args.out:
        raise UsageError("--resume needs the folder of the study to continue", do="Add --out DIR")
    out = args.out or Path("sweeps") / f"{plan.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    with working(args):
        store = Store(out, plan.name, fingerprint(plan.definition, plan.sources), resume=args.resume)
        run_parts(store, Work(plan.items, plan.function, plan.prepare), args, where=out)
    summary, lines = plan.write(store, store.load(len(plan.items)))
    for line in lines:
        tell(line)
    tell(f"results in {out}: {', '.join(summary['files'])}")
    if args.json:
        say_json({"schema": 1, **summary, "out": str(out), "elapsed_s": round(time.monotonic() - began, 3)})
    return 0


def _plan(args: argparse.Namespace) -> Plan:
    gains = args.gains
    if args.grid == "hardware":
        raise UsageError(
            "the experiment is a study of whole pushes now",
            where="push sweep hardware",
            do="Run `push study experiment-box` and `push study experiment-barrel`",
        )
    changes: dict[str, Any] = {"k_f": gains[0], "k_y_rad_per_m": gains[1]} if gains else {}
    if args.open_loop and args.law not in (None, "open-loop"):
        raise UsageError("--open-loop and --law name two laws", where="push sweep", do="Give one of them")
    if law := "open-loop" if args.open_loop else args.law:
        check_law(law, "--law")
        changes["law"] = law
    if args.grid == "paper":
        return lanes_plan(paper_study(changes, args.dt))
    return lanes_plan(load_grid(Path(args.grid), changes, args.dt))
