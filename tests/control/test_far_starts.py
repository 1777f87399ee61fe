"""Starts far off in every way at once: none ends because the law asks for a push backward (docs/laws.md)."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest

from robot_io.tick import Phase
from tests.how_many import how_many
from tools.rig import resolve_rig
from tools.run.lockstep import Lockstep

HALF_WIDTH_M = 0.2
KNOWN = (
    (0.8, -22.0, -0.5, 1.0, "corners", 0.2),
    (0.8, -22.0, -0.5, 0.8, "corners", 0.5),
    (0.67, -19.5, -0.41, 0.8, "corners", 0.5),
)
"""Offset over the half width, heading (degrees), beside the path (m), contact friction, pressure, k_y: stopped once."""


class _NoLog:
    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        pass

    def tick(self, time_ns: int, payload: bytes, tick: object) -> None:
        pass


def drawn(seed: int) -> tuple[float, float, float, float, str, float]:
    """Draw a start, every other one from those that turn the object away from the path."""
    draw = random.Random(f"far-{seed}")
    edge, heading, beside = draw.uniform(0.4, 0.8), draw.uniform(-22.0, -10.0), draw.uniform(-0.5, -0.2)
    if seed % 2:
        edge, heading, beside = draw.uniform(-0.8, 0.8), draw.uniform(-22.0, 22.0), draw.uniform(-0.5, 0.5)
    return edge, heading, beside, draw.choice((0.3, 0.8, 1.0)), draw.choice(("corners", "frame")), 0.2


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("start", [*KNOWN, *(drawn(seed) for seed in range(how_many(6, 60)))], ids=str)
def test_a_far_start_does_not_end_sideways(start):
    edge, heading, beside, friction, pressure, k_y = start
    rig = resolve_rig("sim", [
        "control.distance_m=3", "world.start.spread=0", f"world.start.edge_offset_m={edge * HALF_WIDTH_M}",
        f"world.start.heading_deg={heading}", f"world.start.lateral_offset_m={beside}", "control.k_f=0.3",
        f"control.k_y_rad_per_m={k_y}", f"world.slider.contact_friction={friction}",
        f"world.slider.pressure={pressure}",
    ])  # fmt: skip
    widest = [0.0]

    def look(_inp: Any, state: Any, _output: Any) -> None:
        if state.control.phase == Phase.PUSH:
            widest[0] = max(widest[0], abs(state.control.theta_p))

    figures = Lockstep(rig, 0, _NoLog()).run(look)
    assert not {"F56", "F56-way"} & set(figures["fault_counts"])
    assert figures["lost_times"] == 0
    assert widest[0] <= math.pi / 2


@pytest.mark.long
@pytest.mark.timeout(600)
@pytest.mark.parametrize("edge", [0.24, -0.16])
def test_the_integral_leads_no_far_start_out_of_its_room(edge):
    """With the paper's gains, which are beyond the limit of such a box: it adds up offsets on the way back, too."""
    ends = {}
    for law in ("force", "force-integral"):
        rig = resolve_rig("sim", [
            f"control.law={law}", "control.distance_m=6", "control.k_f=0.1", "control.k_y_rad_per_m=0.3",
            "world.start.spread=0", f"world.start.edge_offset_m={edge}", "world.start.lateral_offset_m=0.05",
            "world.start.heading_deg=3", "world.slider.length_m=0.4", "world.slider.width_m=0.6",
            "world.slider.mass_kg=4.5", "world.floor.patch_strength=0.2", "world.floor.patch_m=0.3",
        ])  # fmt: skip
        figures = Lockstep(rig, 1, _NoLog()).run(lambda *_: None)
        assert not {"F55-slow", "F55-stop"} & set(figures["fault_counts"])
        assert figures["exit_code"] == 0
        ends[law] = abs(figures["lateral_error_m"])
    assert ends["force-integral"] < ends["force"] + 0.2
