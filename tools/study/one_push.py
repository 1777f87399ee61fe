"""One push of a study: a run of the program in lockstep, and the row and the course that are kept of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec

from control.notes.push_course import FROM_CONTACT
from robot_io.errors import PushError
from robot_io.geometry import StraightPath, wrap_angle
from robot_io.rig.config import RigConfig, rig_from_toml
from robot_io.tick import Phase, TickInput, TickOutput, TickState
from tools.laws import law_label, own_law
from tools.parallel.part import Part, Row
from tools.study.pushes import Push
from tools.verdict.evidence import gather
from tools.verdict.first_cause import first_fault
from tools.verdict.judgement import FAILURES, judge
from tools.verdict.witness import Witness

FIXED_BEFORE = ("run", "seed")
FIXED_AFTER = (
    "law", "verdict", "exit_code", "distance_m", "end_lateral_m", "worst_lateral_m", "object_lateral_m",
    "object_heading_deg", "peak_force_N", "lost_s", "first_fault", "against",
)  # fmt: skip
"""Columns of `runs.csv` before and after those of the axes; the object's are where it truly is, beside the path."""
KEEP_EVERY_S = 0.2
LOST = (Phase.LOST, Phase.LOST_HOLD)


class Job(msgspec.Struct, frozen=True):
    """A push and what is logged of it: `log` is where, "" for no log; `ticks`: without derived topics."""

    push: Push
    log: str = ""
    ticks: bool = False

    @property
    def cases(self) -> tuple[Push]:
        """The one case of this item."""
        return (self.push,)


class Course:
    """Follows a push tick by tick.

    kept: every 0.2 s from first contact on the way of the ball (m), the object's lateral offset (m) and its heading
    (rad), PATH frame. lost_s: how long contact was lost.
    """

    def __init__(self, rig: RigConfig) -> None:
        self._line = StraightPath.of(rig.path.origin_m, rig.path.direction_deg)
        self._every = max(1, round(KEEP_EVERY_S * rig.loop.rate_hz))
        self._period_s = 1.0 / rig.loop.rate_hz
        self._lost = 0
        self.kept: list[tuple[float, float, float]] = []

    @property
    def lost_s(self) -> float:
        """How long contact was lost, s."""
        return round(self._lost * self._period_s, 9)

    def note(self, tick: int, state: TickState, world: Any) -> None:
        """Follow one tick; world: whose object is looked at."""
        phase = state.control.phase
        if phase in LOST:
            self._lost += 1
        if phase in FROM_CONTACT and tick % self._every == 0:
            lateral_m, heading = self.place(world)
            self.kept.append((state.control.progress_m, lateral_m, heading))

    def place(self, world: Any) -> tuple[float, float]:
        """Return the object's lateral offset (m) and its heading (rad), PATH frame."""
        pose = world.read_slider(world.now_ns)
        return self._line.lateral(pose.x, pose.y), wrap_angle(pose.yaw - self._line.heading)


def run_push(job: Job) -> Part:
    """Run one push; arrays: `course`, shape (kept, 3). An impossible one is a row with the reason."""
    import numpy as np

    push = job.push
    rig = rig_from_toml(push.rig)
    row: Row = {"run": push.run, "seed": push.seed, **push.axes, "law": law_label(rig)}
    course = Course(rig)
    try:
        row |= _ended(job, rig, course)
    except PushError as error:
        row |= _failed(error.exit_code, error.what)
    except Exception as error:  # one bad push must not end the study; its row names the defect
        row |= _failed(1, f"{type(error).__name__}: {error}")
    return Part([row], {"course": np.array(course.kept, dtype=np.float64).reshape(-1, 3)})


def _ended(job: Job, rig: RigConfig, course: Course) -> Row:
    from tools.run.lockstep import Lockstep, open_log

    push = job.push
    law = own_law(rig.control, push.folder)
    log = None
    if job.log:
        path = Path(job.log)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        log = open_log(path, push.rig, push.seed, in_contact=False, derive=not job.ticks)
    try:
        # What else this machine does must not decide a study: the time of a law's step is judged by `push run`.
        one = Lockstep(rig, push.seed, log, law=law, timed=False, compiled=True)

        def on_tick(inp: TickInput, state: TickState, output: TickOutput) -> None:
            course.note(inp.tick, state, one.world)

        figures = one.run(on_tick)
    finally:
        if log is not None:
            log.finish({})
    lateral_m, heading = course.place(one.world)
    return _row(rig, figures) | {
        "object_lateral_m": lateral_m,
        "object_heading_deg": math.degrees(heading),
        "lost_s": course.lost_s,
    }


def _row(rig: RigConfig, figures: dict[str, Any]) -> Row:
    trust = gather(rig, figures, Witness())
    judged = judge(figures["exit_code"], trust)
    first = first_fault(rig, figures)
    return {
        "verdict": judged.verdict,
        "exit_code": judged.exit_code,
        "distance_m": figures["distance_m"],
        "end_lateral_m": figures["lateral_error_m"],
        "worst_lateral_m": _known(figures["worst_lateral_m"]),
        "peak_force_N": _known(figures["worst_force_N"]),
        "first_fault": first.id if first else "",
        "against": " ".join(item.id for item in trust if item.says == "against"),
    }


def _failed(exit_code: int, reason: str) -> Row:
    return {"verdict": FAILURES.get(exit_code, "error"), "exit_code": exit_code, "against": " ".join(reason.split())}


def _known(value: float | None) -> float | str:
    return "" if value is None else value
