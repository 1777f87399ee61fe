"""Normal pushes at level sim, each seed another: object, start, floor and slip; what each of them met and travelled.

`python -m tests.safety.normal_pushes 200` runs the seeds 0 to 199 on all processors and prints what they met.
"""

from __future__ import annotations

import math
import random
import sys
from typing import NamedTuple

import joblib

from robot_io.geometry import point_outside
from robot_io.rig.config import load_rig
from robot_io.tick import TickInput, TickOutput, TickState
from safety.checks.motion_checks import GROUPS, PUSH
from safety.motion_bounds import phase_bounds, total_bounds
from tools.run.lockstep import Lockstep
from tools.verdict.evidence import gather
from tools.verdict.judgement import judge
from tools.verdict.witness import Witness

OBJECTS = {
    "box": (),
    "barrel": ("world.slider.shape=circle", "world.slider.radius_m=0.25", "world.slider.mass_kg=5.0"),
}
"""The objects of the shipped rigs `emulated` and `barrel`."""
DISTANCES_M = (2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 6.0)
"""One push in ten is as long as the paper's."""
WORST_EDGE_M, WORST_LATERAL_M, WORST_HEADING_DEG, WORST_PATCHES, WORST_SLIP = 0.07, 0.05, 3.0, 0.3, 0.1


class Push(NamedTuple):
    """What one push met, and how far it travelled."""

    seed: int
    what: str
    exit_code: int
    faults: dict[str, int]
    worst_lateral_m: float
    path_ratio: float
    """True way of the contact point in the push over its progress."""
    push_share: float
    """Way in the push, as sent or measured, over its bound (F45)."""
    total_share: float
    """The gate's way over its bound (F47)."""


class Nothing:
    """A log that keeps nothing."""

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        pass

    def tick(self, time_ns: int, payload: bytes, tick: object) -> None:
        pass


class _Way:
    """Follows the true way of the contact point while the run pushes."""

    def __init__(self, push: Lockstep) -> None:
        self._push = push
        self._last: tuple[float, float] | None = None
        self.way_m = self.counted_m = self.travelled_m = 0.0

    def __call__(self, inp: TickInput, state: TickState, output: TickOutput) -> None:
        self.travelled_m = inp.base.travel_m
        if GROUPS.get(state.control.phase) != PUSH:
            self._last = None
            return
        world = self._push.world
        pose = world.read_base(world.now_ns).pose
        ball = point_outside(pose.x, pose.y, pose.yaw, *self._push.rig.frames.contact_in_base_m[:2])
        if self._last is not None:
            self.way_m += math.dist(ball, self._last)
        self._last = ball
        self.counted_m = max(state.safety.motion.sent_m, state.safety.motion.measured_m)


def settings_of(seed: int, distance_m: float) -> tuple[str, ...]:
    """Return the settings of a seed: every number within what the world's settings call normal."""
    draw = random.Random(f"normal push {seed}")
    name = list(OBJECTS)[seed % 2]
    start = {
        "lateral_offset_m": draw.uniform(-WORST_LATERAL_M, WORST_LATERAL_M),
        "edge_offset_m": draw.uniform(-WORST_EDGE_M, WORST_EDGE_M),
        "heading_deg": draw.uniform(-WORST_HEADING_DEG, WORST_HEADING_DEG) if name == "box" else 0.0,
        "spread": 0.0,
    }
    return (
        *OBJECTS[name],
        *(f"world.start.{key}={value!r}" for key, value in start.items()),
        f"world.floor.patch_strength={draw.uniform(0.0, WORST_PATCHES)!r}",
        f"world.slip={draw.uniform(0.0, WORST_SLIP)!r}",
        f"control.distance_m={distance_m!r}",
    )


def push_of(seed: int) -> Push:
    """Run the push of a seed at level sim."""
    rig = load_rig("sim", settings_of(seed, DISTANCES_M[seed // 2 % len(DISTANCES_M)]))
    push = Lockstep(rig, seed, Nothing())
    way = _Way(push)
    ended = push.run(way)
    slider, start = rig.world.slider, rig.world.start
    what = (
        f"{slider.shape} {rig.control.distance_m} m, slip {rig.world.slip:.3f}, "
        f"patches {rig.world.floor.patch_strength:.2f}, lateral {start.lateral_offset_m:+.3f} m, "
        f"edge {start.edge_offset_m:+.3f} m, heading {start.heading_deg:+.1f} degrees"
    )
    return Push(
        seed,
        what,
        judge(ended["exit_code"], gather(rig, ended, Witness())).exit_code,
        ended["fault_counts"],
        ended["worst_lateral_m"] or math.nan,
        way.way_m / ended["distance_m"] if ended["distance_m"] else math.nan,
        way.counted_m / phase_bounds(rig).push_m,
        way.travelled_m / total_bounds(rig).distance_m,
    )


def pushes(seeds: range) -> list[Push]:
    """Run the pushes of `seeds` on all processors."""
    found: list[Push] = joblib.Parallel(n_jobs=-1)(joblib.delayed(push_of)(seed) for seed in seeds)
    return found


def in_words(found: list[Push]) -> str:
    """Return what was met, and the largest ways against their bounds."""
    met = [f"seed {p.seed}: {p.faults}, exit {p.exit_code}: {p.what}" for p in found if p.faults or p.exit_code]
    worst = max(found, key=lambda p: p.path_ratio)
    return "\n".join(
        (
            *met,
            f"{len(found)} pushes, {len(met)} with a fault; longest way over progress {worst.path_ratio:.4f} "
            f"(seed {worst.seed}); way over bound: push {max(p.push_share for p in found):.3f}, "
            f"all {max(p.total_share for p in found):.3f}; "
            f"worst lateral {max(abs(p.worst_lateral_m) for p in found):.3f} m",
        )
    )


if __name__ == "__main__":
    print(in_words(pushes(range(int(sys.argv[1])))))
