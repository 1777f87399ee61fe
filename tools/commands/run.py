"""`push run [RIG]`: one push, at the level its rig names; emulated by default."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from robot_io.error_report import ignoring_output_errors, say_json, tell
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.ipc.process import allow_descriptors
from robot_io.rig.config import RigConfig
from tools.commands.run_laws import add_law_arguments, check_law, law_overrides, note_passed_law
from tools.commands.run_outputs import save_tare, unused_faults, with_injected, write_report, write_summary
from tools.commands.run_trials import check_trials, run_battery
from tools.laws import own_law
from tools.live.arguments import add_live_arguments
from tools.live.view import check_live, live_view
from tools.places import run_dir, saved_tare
from tools.places.device_locks import DeviceLocks
from tools.places.running import announced
from tools.places.saved_tare import SavedTare
from tools.report.process import ReportProcess
from tools.rig import devices_at, folder_of, resolve_rig, with_faults
from tools.run.awake import awake
from tools.run.facts.bounds import bounds_of, check_room
from tools.run.facts.outlook import blind_words, tell_bounds, tell_levels
from tools.run.facts.run_facts import level_of
from tools.terminal import verdict
from tools.terminal.arguments import SEED, named_path, note, number, whole_number
from tools.terminal.gain_warning import gain_warning
from tools.terminal.live_line import LiveLine
from tools.terminal.rig_arguments import add_faults, add_rig
from tools.verdict.arm_pose import arm_pose_notes
from tools.verdict.object_pose import object_pose
from tools.verdict.witness import Witness

if TYPE_CHECKING:
    from tools.log.run_parts import RunParts
    from tools.run.launcher import Launcher
    from tools.run.lockstep import Lockstep


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push run`."""
    add_rig(parser)
    parser.add_argument(
        "--distance-m", type=number(0.001, 1000), metavar="M", help="how far to push, from first contact"
    )
    add_law_arguments(parser)
    parser.add_argument("--seed", type=SEED, metavar="SEED", default=0, help="seed of the simulated world (0)")
    parser.add_argument(
        "--out", type=named_path, metavar="DIR", help="folder for the run, created (default: runs/RIG-TIME)"
    )
    add_faults(parser, 'inject a fault, at levels sim and emulated: "ft.frozen at 10 s for 1 s"')
    parser.add_argument("--fast", action="store_true", help="level sim only: as fast as possible")
    parser.add_argument(
        "--start-in-contact", action="store_true", help="use a tare saved in this power cycle of the sensor"
    )
    parser.add_argument("--check", action="store_true", help="what `push doctor` and --dry-run say; nothing moves")
    parser.add_argument("--yes", action="store_true", help="do not ask on the terminal before a real robot moves")
    parser.add_argument("--dry-run", action="store_true", help="show what would run, without connecting to anything")
    parser.add_argument("--move-robot", action="store_true", help="needed before any real device is opened")
    parser.add_argument(
        "--drive-blind", action="store_true", help="let a real base move although its sensor or arm is emulated"
    )
    parser.add_argument(
        "--trials", type=whole_number(1, 1000), metavar="N", help="a battery: N pushes, asking before each, and a table"
    )
    parser.add_argument("--note", type=note, default="", metavar="TEXT", help="a remark, kept in log and report")
    add_live_arguments(parser)
    parser.add_argument("--no-report", action="store_true", help="write no report.html")
    parser.add_argument("--json", action="store_true", help="the summary as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Push; return the run's exit code. Raises PushError if the run could not start."""
    rig = with_faults(resolve_rig(args.rig, overrides(args)), args.faults)
    check_flags(args, rig)
    if warning := gain_warning(rig):
        tell(warning)
    saved = saved_tare.load(rig) if args.start_in_contact else None
    if args.check or args.dry_run:
        from tools.doctor.dry_run import check_only, dry_run

        as_json = args.json
        return check_only(rig, folder_of(args.rig), as_json=as_json) if args.check else dry_run(rig, as_json=as_json)
    if not devices_at(rig, "sim"):
        tell_levels(rig)
    if not devices_at(rig, "hardware"):
        tell_bounds(rig)
    with DeviceLocks(rig):
        if devices_at(rig, "hardware"):
            prepare(args, rig)
        if args.trials:
            return run_battery(args, rig, lambda one, out: finish(one, *push_once(one, rig, out, saved)))
        pushed = push_once(args, rig, args.out, saved)
    summary = finish(args, *pushed)
    if args.json:
        with ignoring_output_errors():
            say_json(summary)
    return int(summary["exit_code"])


def push_once(
    args: argparse.Namespace, rig: RigConfig, out: Path | None, saved: SavedTare | None
) -> tuple[dict[str, Any], ReportProcess | None]:
    """Push, tell the verdict and return the summary, with the process that makes the report where one has begun.

    out: the run's folder, None for a new one.
    """
    simulated = bool(devices_at(rig, "sim"))
    out = run_dir.create(out, rig.name)
    follow = simulated and not args.no_report and not rig.log.in_parts
    early, ran = None, False
    try:
        early = ReportProcess(out / "run.mcap", out / "report.html") if follow else None
        ran = True  # from here on they know whether the run has begun
        summary = run_lockstep(args, rig, out, saved) if simulated else run_wall_clock(args, rig, out, saved)
    except BaseException:
        if not ran:
            run_dir.discard(out)
        if early is not None:
            early.drop()
        raise
    summary |= {"bounds": bounds_of(rig), "report": None}
    if blind := blind_words(rig):
        summary["notes"].insert(0, blind)
    say_lines(verdict.person_lines(summary), as_json=args.json)
    write_summary(summary, out)
    return summary, early


def finish(args: argparse.Namespace, summary: dict[str, Any], early: ReportProcess | None) -> dict[str, Any]:
    """Write the report of a run whose verdict has been told; return its summary. Raises UsageError: an unused fault."""
    out = Path(summary["out"])
    if not args.no_report:
        tell("writing the report ...")
        write_report(summary, out, early)
        write_summary(summary, out)
        if summary["report"]:
            say_lines([f"report: {summary['report']}"], as_json=args.json)
    if unused := unused_faults(summary):
        raise UsageError(
            f"the fault `{unused[0]}` changed nothing",
            where="push run",
            do=f"Choose a time within the run; what came of the run is in {out}",
        )
    return summary


def say_lines(lines: list[str], *, as_json: bool) -> None:
    """Print lines for people at once: on stdout, or on stderr where that is for JSON."""
    with ignoring_output_errors():
        for line in lines:
            tell(line) if as_json else print(line, flush=True)


def overrides(args: argparse.Namespace) -> list[str]:
    """Return the settings of `--set`, followed by those of the other flags."""
    found = list(args.overrides)
    if args.distance_m is not None:
        found.append(f"control.distance_m={args.distance_m!r}")
    found += law_overrides(args)
    if args.start_in_contact:
        found.append("world.start.gap_m=0.0")
    return found


def check_flags(args: argparse.Namespace, rig: RigConfig) -> None:
    """Raise UsageError for flags that contradict the rig; nothing has been opened yet."""
    hardware = devices_at(rig, "hardware")
    if hardware and not (args.move_robot or args.dry_run or args.check):
        raise UsageError(
            f"rig {rig.name!r} moves a real robot ({', '.join(hardware)} at level hardware)",
            where="push run",
            do="Clear the floor, hold the e-stop, and add --move-robot",
        )
    if hardware and args.move_robot and not args.untested_law:
        check_law(rig)
    blind = blind_words(rig)
    if blind and not (args.drive_blind or args.check):
        raise UsageError(blind, where="push run", do="Use the real ones, an emulated base, or --drive-blind")
    if args.fast and not devices_at(rig, "sim"):
        raise UsageError(
            "--fast is for level sim only: real drivers run on the wall clock",
            where="push run",
            do="Leave --fast out, or give a rig of level sim",
        )
    check_room(rig, args.seed)
    if args.trials and not (args.dry_run or args.check):
        check_trials(args, rig)
    if args.live:
        check_live(args.live_port, fast=args.fast)


def prepare(args: argparse.Namespace, rig: RigConfig) -> None:
    """Look at the real devices, and ask before a real robot moves. Raises DeviceError and OperatorStop."""
    from tools.doctor.before_run import look_before_run
    from tools.doctor.consent import ask_once

    look_before_run(rig, folder_of(args.rig))
    tell_bounds(rig)
    if not args.yes:
        ask_once(rig, "Push now?")


def run_wall_clock(args: argparse.Namespace, rig: RigConfig, out: Path, saved: SavedTare | None) -> dict[str, Any]:
    """Run the processes of a wall-clock run and return its summary."""
    launcher: Launcher | None = None
    with run_dir.discarded_unless(out, lambda: launcher is not None and launcher.began):
        from tools.run.launcher import Launcher
        from tools.run.processes import MOST_DESCRIPTORS

        allow_descriptors(MOST_DESCRIPTORS)
        launcher = Launcher(
            rig,
            out,
            seed=args.seed,
            saved=saved,
            live=LiveLine(rig),
            kind_folder=folder_of(args.rig),
            note=args.note,
            live_port=args.live_port if args.live else None,
        )
        with awake():
            figures = launcher.run()
    save_tare(rig, figures)
    summary = verdict.summary(
        rig,
        figures,
        out=out,
        log=launcher.log,
        seed=args.seed,
        level=level_of(rig),
        note=args.note,
        devices=launcher.devices(figures),
        notes=[*arm_pose_notes(rig, figures), *launcher.notes],
        witness=launcher.witness(figures),
        pushed=launcher.pushed(),
    )
    note_passed_law(rig, summary)
    return with_injected(summary, launcher.injected(figures)) | {"latency": launcher.latencies()}


def run_lockstep(args: argparse.Namespace, rig: RigConfig, out: Path, saved: SavedTare | None) -> dict[str, Any]:
    """Run level sim in this process, with its live view where one is wanted, and return its summary."""
    one: Lockstep | None = None
    with (
        run_dir.discarded_unless(out, lambda: one is not None and one.began),
        live_view(args.live_port if args.live else None) as to_view,
    ):
        from tools.run.lockstep import Lockstep, open_log

        law = own_law(rig.control, folder_of(args.rig))
        text = run_dir.write_config(out, rig)
        log = open_log(out / "run.mcap", text, args.seed, in_contact=saved is not None, note=args.note, to_view=to_view)
        try:
            one, live = Lockstep(rig, args.seed, log, saved=saved, law=law), LiveLine(rig)
        except BaseException:  # an impossible world, or an interrupt
            log.abandon()
            raise
        return lockstep_summary(args, one, log, out, live)


def lockstep_summary(
    args: argparse.Namespace, one: Lockstep, log: RunParts, out: Path, live: LiveLine
) -> dict[str, Any]:
    """Run to the end and return the summary."""
    from tools.run.paced import PacedRun, run_fast

    try:
        try:
            with announced(one.rig, out / "run.mcap"):
                figures = run_fast(one) if args.fast else PacedRun(one, live).run()
        finally:
            live.close()
            log.finish({})
    except OSError as error:  # only the log is outside this process here
        log.abandon()
        raise EnvironmentFault(
            f"the log cannot be written any more: {error.strerror}", where=str(out / "run.mcap"), do="Free some space"
        ) from None
    save_tare(one.rig, figures)
    summary = verdict.summary(
        one.rig,
        figures,
        out=out,
        log=out / "run.mcap",
        seed=args.seed,
        level="sim",
        note=args.note,
        devices=figures["devices"],
        notes=arm_pose_notes(one.rig, figures),
        witness=Witness(),
        pushed=object_pose(one.rig.path, log.object_poses),
    )
    return with_injected(summary, figures["injected"]) | {"latency": msgspec.to_builtins(log.latencies)}
