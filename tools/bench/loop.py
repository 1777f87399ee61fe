"""`push bench loop`: how late the control loop wakes up here, beside a bare loop and beside the kernel's own measure.

Lateness depends on the machine and the moment; what can be compared are the ratios within one run of this command.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import msgspec

from robot_io.error_report import say_json, tell
from robot_io.errors import UsageError
from robot_io.ipc.realtime import NO_CPU, RealtimeFacts
from robot_io.rig.config import LoopConfig
from tools.bench.clock import bare, cyclictest, full_stack
from tools.bench.clock.load import full_load
from tools.bench.clock.rounds import WANTED, Column, Rounds, run_rounds
from tools.bench.clock.wakeups import Best, best_of
from tools.run.control_process import PRIORITY
from tools.terminal.arguments import named_path, number, whole_number

BUDGET_S = 570.0
"""The command ends within ten minutes."""
FULL_START_S, BARE_START_S = 7.0, 0.4
"""What a measurement takes beside its duration."""
PLANNED = 5
"""Rounds for which there is to be time, as some are dropped."""
LEAST_S = 3.0
LEAST_HZ, MOST_HZ = 50.0, 500.0
PLAIN, SPIN = "", ", spin"

# What the loop aims at (docs/realtime.md).
BARE_RATIO = 1.3
SPIN_P50_RATIO, SPIN_P99_RATIO = 1.5, 2.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "--rate", type=_rates, metavar="HZ,HZ", default=(100.0, 200.0, 500.0), help="loop rates (100,200,500)"
    )
    parser.add_argument("--full-stack", action="store_true", help="also the loop of complete runs at level emulated")
    parser.add_argument("--load", action="store_true", help="keep every processor busy meanwhile")
    parser.add_argument(
        "--duration-s", type=number(LEAST_S, 120), metavar="S", default=20.0,
        help="of one measurement; shortened where ten minutes would not do (20)",
    )  # fmt: skip
    parser.add_argument(
        "--cpu", type=whole_number(-1, 1023), default=NO_CPU, metavar="N", help="bind all to this processor (-1: any)"
    )
    parser.add_argument("--picture", type=named_path, metavar="FILE", help="histograms as .svg or .png")
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last on stdout")


def _rates(text: str) -> tuple[float, ...]:
    read = number(LEAST_HZ, MOST_HZ)
    return tuple(dict.fromkeys(read(word) for word in text.split(",")))


class Given(NamedTuple):
    """The arguments that the measurements need."""

    duration_s: float
    cpu: int
    full_stack: bool
    reference: str


def run(args: argparse.Namespace) -> int:
    """Measure and print the figures; return the exit code. Raises UsageError and EnvironmentFault."""
    if args.picture is not None and args.picture.suffix not in (".svg", ".png"):
        raise UsageError("a picture is an .svg or .png file", where=str(args.picture), do="Give such a name")
    deadline_s = time.monotonic() + BUDGET_S
    reference = "cyclictest" if cyclictest.has_cyclictest() else "bare"
    if reference == "bare":
        tell("cyclictest is not installed (package rt-tests): the bare loop is the reference")
    given = Given(_duration_s(args, reference), args.cpu, args.full_stack, reference)
    if given.duration_s < args.duration_s:
        tell(f"each measurement takes {given.duration_s:.0f} s, so that all end within ten minutes")
    found: dict[float, Rounds] = {}
    with full_load(wanted=args.load):
        got = realtime(given)
        for i, rate_hz in enumerate(args.rate):
            tell(f"{rate_hz:g} Hz:")
            share_s = (deadline_s - time.monotonic()) / (len(args.rate) - i)
            found[rate_hz] = run_rounds(
                columns(rate_hz, given), time.monotonic() + share_s, say=lambda text: tell(f"  {text}")
            )
    rows = [row for rate_hz, rounds in found.items() for row in rows_of(rate_hz, rounds, given)]
    words = verdict(rows)
    _print(rows, found, got, words)
    if args.picture is not None:
        from tools.bench.clock.picture import draw

        draw(args.picture, {rate_hz: rounds.kept for rate_hz, rounds in found.items()})
        tell(f"picture: {args.picture}")
    if args.json:
        facts = {"load": args.load, "duration_s": given.duration_s, "realtime": msgspec.to_builtins(got)}
        say_json({"schema": 1, "rates": rows, **facts, "verdict": words})
    return 0


def _duration_s(args: argparse.Namespace, reference: str) -> float:
    """Return the length of a measurement with which five rounds of all rates fit into the time."""
    measured = (reference == "cyclictest") + 2 + 2 * args.full_stack
    extra_s = 2 * BARE_START_S + 2 * FULL_START_S * args.full_stack
    fits_s = (BUDGET_S / (len(args.rate) * PLANNED) - extra_s) / measured
    return float(min(args.duration_s, max(LEAST_S, int(fits_s))))


def realtime(given: Given) -> RealtimeFacts:
    """Return what this machine gives a loop."""
    job = bare.BareJob(LEAST_HZ, 0.1, PRIORITY, given.cpu, LoopConfig().spin_us)
    return bare.measure(job)[1]


def columns(rate_hz: float, given: Given) -> dict[str, Column]:
    """Return what is measured in a round, by name."""
    found: dict[str, Column] = {}
    if given.reference == "cyclictest":
        found["cyclictest"] = partial(cyclictest.measure, rate_hz, given.duration_s, PRIORITY, given.cpu)
    for word, spin_us in ((PLAIN, 0.0), (SPIN, LoopConfig().spin_us)):
        job = bare.BareJob(rate_hz, given.duration_s, PRIORITY, given.cpu, spin_us)
        found[f"bare{word}"] = lambda job=job: bare.measure(job)[0]  # type: ignore[misc]
        if given.full_stack:
            found[f"full{word}"] = partial(full_stack.measure, rate_hz, given.duration_s, spin_us, given.cpu)
    return found


def rows_of(rate_hz: float, rounds: Rounds, given: Given) -> list[dict[str, Any]]:
    """Return a row without and one with spin: the loop, the bare loop, the reference, and their ratios."""
    rows = []
    for word, spin_us in ((PLAIN, 0.0), (SPIN, LoopConfig().spin_us)):
        loop = f"full{word}" if given.full_stack else f"bare{word}"
        row: dict[str, Any] = {
            "rate_hz": rate_hz, "spin_us": spin_us, "loop": "full" if given.full_stack else "bare",
            "reference": given.reference, "rounds_kept": rounds.count, "rounds_run": rounds.run,
            "kept_share": round(rounds.kept_shares[loop], 3),
            "bare_kept_share": round(rounds.kept_shares[f"bare{word}"], 3),
            "reference_kept_share": round(rounds.kept_shares[given.reference], 3),
        }  # fmt: skip
        if not rounds.too_noisy:
            best = {name: best_of(kept) for name, kept in rounds.kept.items()}
            row |= _figures(best[loop], best[f"bare{word}"], best[given.reference])
            if given.full_stack:
                row |= _of_full(rounds, loop)
        rows.append(row)
    return rows


def _figures(loop: Best, alone: Best, reference: Best) -> dict[str, Any]:
    return {
        "p50_us": round(loop.p50_us, 1), "p99_us": round(loop.p99_us, 1), "max_us": round(loop.max_us, 1),
        "skipped": loop.skipped, "skipped_stolen": loop.skipped_stolen,
        "bare_p50_us": round(alone.p50_us, 1), "bare_p99_us": round(alone.p99_us, 1),
        "reference_p50_us": round(reference.p50_us, 1), "reference_p99_us": round(reference.p99_us, 1),
        "ratio_p50": _ratio(loop.p50_us, reference.p50_us), "ratio_p99": _ratio(loop.p99_us, reference.p99_us),
        "bare_ratio_p50": _ratio(loop.p50_us, alone.p50_us), "bare_ratio_p99": _ratio(loop.p99_us, alone.p99_us),
    }  # fmt: skip


def _of_full(rounds: Rounds, loop: str) -> dict[str, Any]:
    """Return how long the frame took to the gate, from the deadline, and the means of the stages (best round)."""
    best = min((one.facts for one in rounds.kept[loop]), key=lambda facts: float(facts["to_gate_p50_ms"]))
    return {
        "to_gate_p50_us": round(1e3 * best["to_gate_p50_ms"], 1),
        "to_gate_p99_us": round(1e3 * best["to_gate_p99_ms"], 1),
        "stages_us": best["stages_us"],
    }


def _ratio(loop_us: float, other_us: float) -> float | None:
    """Return a ratio; none to something that was not late at all."""
    return round(loop_us / other_us, 2) if other_us > 0.0 else None


def verdict(rows: list[dict[str, Any]]) -> str:
    """Return whether the loop keeps what it aims at, in words."""
    if any("p50_us" not in row for row in rows):
        return "too noisy"
    if any(row["loop"] == "bare" for row in rows):
        return "measured without the full stack"
    missed = [
        f"{name} {row[name]:g} (aim {aim:g}) at {row['rate_hz']:g} Hz {'with' if row['spin_us'] else 'without'} spin"
        for row in rows
        for name, aim in _aims(row).items()
        if row[name] is not None and row[name] > aim
    ]
    return "above the aims: " + "; ".join(missed) if missed else "within the aims"


def _aims(row: Mapping[str, Any]) -> dict[str, float]:
    if row["spin_us"]:
        return {"ratio_p50": SPIN_P50_RATIO, "ratio_p99": SPIN_P99_RATIO}
    return {"bare_ratio_p50": BARE_RATIO, "bare_ratio_p99": BARE_RATIO}


def _print(rows: list[dict[str, Any]], found: dict[float, Rounds], got: RealtimeFacts, words: str) -> None:
    tell("")
    tell(f"{'Hz':>5}  {'column':12} {'p50':>8} {'p99':>8} {'worst':>9} {'kept':>5}  us after the deadline, best round")
    for rate_hz, rounds in found.items():
        if rounds.too_noisy:
            tell(f"{rate_hz:5g}  too noisy: {rounds.count} of {rounds.run} rounds kept, {WANTED} needed")
        for name, kept in rounds.kept.items():
            share = f"{rounds.kept_shares[name]:.0%}"
            if rounds.too_noisy:
                tell(f"{rate_hz:5g}  {name:12} {'-':>8} {'-':>8} {'-':>9} {share:>5}")
                continue
            best = best_of(kept)
            tell(f"{rate_hz:5g}  {name:12} {best.p50_us:8.1f} {best.p99_us:8.1f} {best.max_us:9.1f} {share:>5}")
            if best.skipped + best.skipped_stolen:
                tell(f"{'':21}skipped {best.skipped} ticks, and {best.skipped_stolen} while the host took time")
    for row in rows:
        if "stages_us" in row:
            stages = ", ".join(f"{name} {us:g}" for name, us in row["stages_us"].items())
            spin = f"{row['rate_hz']:g} Hz {'with' if row['spin_us'] else 'without'} spin"
            tell(f"{spin}: frame sent to the gate after {row['to_gate_p50_us']:g} us ({stages})")
    told = [word for word, yes in (
        ("real-time priority", got.fifo), ("memory locked", got.memory_locked), ("shallow idle", got.idle_kept_shallow)
    ) if yes]  # fmt: skip
    tell(f"this machine gives: {', '.join(told) or 'nothing'}; spin {got.spin_us:g} us")
    tell(words)
