"""Core and gate together over inputs and frames that are anything at all, with every rule checked in every tick.

The way of the base is added up here, from what leaves the gate alone; it is compared with what the rig can need.
"""

from __future__ import annotations

import math
import random
from functools import cache
from typing import NamedTuple

from msgspec.structs import replace

from robot_io.ipc.gate_frame import GateFrame
from robot_io.ipc.record import BASE_RECORD
from robot_io.messages import BaseOdometry, BodyTwist, DeviceHealth, LinkState, Stamped
from robot_io.tick import TICK_CDR, ControlTick, Phase, TickInput
from safety.gate import GateState
from safety.gate_shell import GateShell
from safety.motion_bounds import total_bounds
from safety.travel import MOVING_M_PER_S, Travel
from tests.safety.any_input import FLOATS, TICKS, Change, Spoiler, drawn_changes
from tests.safety.fold_bench import PERIOD_NS, FoldBench
from tests.safety.fold_rules import GATE_MARGIN, ZERO, Rules, inside

MS = 1_000_000
STARTS = ("first tick", "tare", "approach", "push", "lost", "retreat", "near its end")
RIG = ("control.distance_m=0.3",)
BASE_TIMEOUT_S = 0.25
"""The base stops by itself after this long without a command."""
UP, LOST = DeviceHealth(LinkState.UP, "", {}, 50.0), DeviceHealth(LinkState.LOST, "gone", {}, 0.0)
FRAME_WRONGS = (
    "nothing",
    "missing",
    "doubled",
    "tick",
    "old",
    "vx",
    "vy",
    "omega",
    "link",
    "asleep",
    "odometry",
    "eof",
)


class Wrong(NamedTuple):
    """What goes wrong on the way to the gate at tick `at`."""

    at: int
    what: str
    number: int


class Sequence(NamedTuple):
    """One sequence: where it starts, what is spoilt, what happens to frames, and where time jumps (ms, by tick)."""

    start: str
    changes: list[Change]
    wrongs: list[Wrong]
    jumps: dict[int, int]


def drawn_sequence(draw: random.Random) -> Sequence:
    """Draw a sequence from a seeded generator."""
    wrongs = [
        Wrong(draw.randrange(TICKS), draw.choice(FRAME_WRONGS), draw.randrange(1000))
        for _ in range(draw.choice((0, 0, 0, 1, 3)))
    ]
    jumps = {
        draw.randrange(TICKS): draw.choice((1, 15, 40, 60, 110, 300, 1500, 10**7))
        for _ in range(draw.choice((0, 0, 1, 3)))
    }
    return Sequence(draw.choice(STARTS), drawn_changes(draw), wrongs, jumps)


@cache
def _begun(start: str) -> FoldBench:
    bench = FoldBench(RIG)
    if start == "first tick":
        return bench
    if start in ("tare", "approach", "retreat"):
        return bench.run_to({"tare": Phase.TARE, "approach": Phase.APPROACH, "retreat": Phase.RETREAT}[start])
    bench.at_full_speed()
    if start == "lost":
        bench.force_path = (0.0, 0.0)
        bench.run_to(Phase.LOST)
    return bench


def begun(start: str) -> FoldBench:
    """Return a bench in the middle of a run without a fault."""
    copy = FoldBench(RIG)
    copy.__dict__.update(_begun(start).__dict__)
    return copy


class _Gate:
    """The gate behind a bench, and the way that it lets the base go."""

    def __init__(self, bench: FoldBench, start: str) -> None:
        safety = bench.core.safety
        self.bounds = total_bounds(bench.rig)
        self.way_m = self.bounds.distance_m - 0.01 if start == "near its end" else 0.0
        last_ns = bench.now_ns - PERIOD_NS
        state = GateState(
            seq=7, tick=bench.tick - 1, frame_ns=last_ns, twist=bench.sent, sent=bench.sent, sent_ns=last_ns,
            said_ns=last_ns,
        )  # fmt: skip
        shell = GateShell(safety.envelope, self.bounds, last_ns, gate=state)
        travel = Travel(bench.sent != ZERO, last_ns, self.way_m)
        self.shell = replace(shell, travel=travel, record=replace(shell.record, sent=bench.sent), asleep_ns=0)
        self._limits = safety.envelope
        self._now_ns = last_ns

    def turn(self, bench: FoldBench, frame: GateFrame, wrongs: list[Wrong]) -> None:
        """Let one frame and what is wrong with it through."""
        now_ns, before = frame.sent_ns, self.shell
        step_s = min((now_ns - self._now_ns) * 1e-9, BASE_TIMEOUT_S)
        speed = math.hypot(before.record.sent.vx, before.record.sent.vy)
        self.way_m += speed * step_s if speed > MOVING_M_PER_S else 0.0
        self._now_ns = now_ns
        shell = before.on_frames(_frames(frame, wrongs), now_ns, now_ns)
        odometry, stamp_s = bench.inp.base.odometry if bench.inp is not None else ZERO, now_ns * 1e-9
        for wrong in wrongs:
            if wrong.what == "odometry":
                odometry = BodyTwist(FLOATS[wrong.number % len(FLOATS)], 0.0, 0.0)
            if wrong.what == "stamp":
                stamp_s = abs(FLOATS[wrong.number % len(FLOATS)])
            if wrong.what == "eof":
                shell = shell.on_control_gone(now_ns)
        shell = shell.on_samples([Stamped(BaseOdometry(odometry), 0, now_ns, stamp_s)])
        whats = {wrong.what for wrong in wrongs}
        shell = shell.on_clock(now_ns, LOST if "link" in whats else UP).on_asleep(10**9 if "asleep" in whats else 0)
        shell, _ = shell.on_leaving(now_ns)
        if before.gate.latch:
            assert shell.gate.latch == before.gate.latch, "the first cause is kept"
        wanted = shell.due(now_ns)
        if wanted is not None:
            assert inside(self._limits, wanted, GATE_MARGIN), wanted
            assert not shell.gate.latch or wanted == ZERO, (shell.gate.latch, wanted)
            shell = shell.on_sent(wanted, wanted, now_ns)
        if shell.gate.latch:
            assert shell.gate.sent == ZERO, "the first zero leaves in the turn that latches"
        over_m = self.way_m - self.bounds.distance_m
        assert over_m <= self._limits.speed * BASE_TIMEOUT_S, "further than this push can need"
        assert over_m < 1e-6 or shell.gate.latch, "it goes on beyond what this push can need"
        self.shell = shell.on_publish(now_ns, newest_inbound_ns=now_ns, newest_pong_ns=now_ns)
        BASE_RECORD.encode(self.shell.record)


def _frames(frame: GateFrame, wrongs: list[Wrong]) -> list[GateFrame | None]:
    frames: list[GateFrame | None] = [frame]
    for wrong in wrongs:
        value = FLOATS[wrong.number % len(FLOATS)]
        match wrong.what:
            case "nothing":
                frames = [None]
            case "missing":
                frames = []
            case "doubled":
                frames = [frame, frame]
            case "tick":
                frames = [replace(frame, tick=frame.tick - wrong.number)]
            case "old":
                frames = [replace(frame, sent_ns=frame.sent_ns - wrong.number * MS)]
            case "vx" | "vy" | "omega":
                frames = [replace(frame, twist=replace(frame.twist, **{wrong.what: value}))]
    return frames


def run(sequence: Sequence, ticks: int = TICKS) -> int:
    """Fold a sequence, checking every tick; return how many ticks it had. Raises AssertionError."""
    bench = begun(sequence.start)
    gate = _Gate(bench, sequence.start)
    spoiler = Spoiler(sequence.changes)
    mode = bench.output.mode if bench.output is not None else 0
    rules = Rules(bench.core.safety.envelope, bench.state, mode, bench.now_ns)
    for n in range(ticks):
        late_ns = sequence.jumps.get(n, 0) * MS
        now_ns = bench.now_ns = bench.now_ns + late_ns
        tick = bench.tick
        record = gate.shell.record

        def seen(
            inp: TickInput, n: int = n, latched: bool = record.latched, cause: int = record.latch_cause
        ) -> TickInput:
            base = replace(inp.base, latched=latched, latch_cause=cause)
            return spoiler.spoil(replace(inp, base=base), n)

        output = bench.fold(seen, n)
        assert bench.inp is not None
        TICK_CDR.encode(ControlTick(0, 0, bench.inp, (), bench.state, output))  # as the loop does, in the same tick
        rules.check(bench.state, output, now_ns)
        frame = GateFrame(gate.shell.gate.seq + 1, tick, now_ns, output.mode, output.command_body)
        gate.turn(bench, frame, [wrong for wrong in sequence.wrongs if wrong.at == n])
        if output.finished:
            return n + 1
    return ticks
