"""The world of the closed form against the world of MuJoCo, by whole pushes of 6 m from the same eight starts.

Same base, law, start and support points, no noise. What is compared is where ball and object are across the path, at
the same way of the ball along it. `pytest -s` prints the figures of docs/simulation-studies.md.
"""

import math
from functools import cache
from typing import NamedTuple

import pytest

from sim_backend.rigid import model
from tests.control.closed_loop import ClosedLoop
from tools.floors.starts import STARTS, rig_settings

pytestmark = [pytest.mark.long, pytest.mark.timeout(1800)]

POINTS = "world.floor.support_points=36"
MUJOCO = (POINTS, "world.engine=mujoco")
HALF_STEP = (*MUJOCO, "world.mujoco.timestep_s=0.0005")
TOUCH_M, END_M, EVERY_M = 0.05, 6.0, 0.01
"""The ball starts 5 cm before the object, along the path."""


class Place(NamedTuple):
    """Where the ball is along and across the path, and the object across it (m)."""

    along: float
    ball: float
    slider: float


@cache
def course(index: int, settings: tuple[str, ...]) -> tuple[Place, ...]:
    """Push from a start; return where things are at each centimetre of the ball's way along the path."""
    loop = ClosedLoop((*rig_settings(STARTS[index]), *settings))
    seen = [Place(-1.0, 0.0, 0.0)]

    def look(now: ClosedLoop) -> None:
        base, slider = now.world.read_base(now.world.now_ns).pose, now.world.read_slider(now.world.now_ns)
        place = Place(base.x + math.cos(base.yaw), base.y + math.sin(base.yaw), slider.y)  # the ball is 1 m ahead
        if place.along > seen[-1].along:  # not the retreat
            seen.append(place)

    loop.run(look)
    assert not loop.faults_seen
    wanted = [TOUCH_M + EVERY_M * (i + 1) for i in range(round((END_M - TOUCH_M) / EVERY_M))]
    found, k = [], 1
    for along in wanted:
        while seen[k].along < along:
            k += 1
        one, other = seen[k - 1], seen[k]
        share = (along - one.along) / (other.along - one.along)
        found.append(Place(*(a + share * (b - a) for a, b in zip(one, other, strict=True))))
    return tuple(found)


def apart_mm(one: tuple[Place, ...], other: tuple[Place, ...]) -> float:
    """Return the rms distance of two courses across the path, the ball's or the object's, whichever is larger."""
    pairs = list(zip(one, other, strict=True))
    ball = sum((a.ball - b.ball) ** 2 for a, b in pairs)
    slider = sum((a.slider - b.slider) ** 2 for a, b in pairs)
    return 1000 * math.sqrt(max(ball, slider) / len(pairs))


MISSED = pytest.mark.xfail(reason="coulomb was seen 8.1 mm from MuJoCo, as along-push was: the cause is not shown yet")


@pytest.mark.parametrize("index", [*range(len(STARTS) - 1), pytest.param(len(STARTS) - 1, marks=MISSED)])
def test_along_push_and_coulomb_are_where_mujoco_is(index):
    start = STARTS[index]
    exact = course(index, MUJOCO)
    along_push, coulomb = (
        apart_mm(course(index, (POINTS, f"world.floor.turning={turning}")), exact)
        for turning in ("along-push", "coulomb")
    )
    print(f"\n{start}: along-push {along_push:.1f} mm, coulomb {coulomb:.1f} mm from MuJoCo")
    assert along_push <= (10.0 if start.offset_share == 0.4 else 25.0)
    assert coulomb <= 8.0


@pytest.mark.parametrize("what", ["step", "softness"])
def test_mujocos_own_course_does_not_hang_on_its_step_or_softness(what, monkeypatch):
    """Half the step, and half the sinking at half the step (a stiffer contact needs it)."""
    usual = course(0, MUJOCO)
    if what == "softness":
        monkeypatch.setattr(model, "FEET_RAD_PER_S", model.FEET_RAD_PER_S * math.sqrt(2))
        monkeypatch.setattr(model, "BALL_RAD_PER_S", model.BALL_RAD_PER_S * math.sqrt(2))
    finer = course.__wrapped__(0, HALF_STEP)
    moved = apart_mm(usual, finer)
    print(f"\nhalf the {what}: {moved:.2f} mm")
    assert moved <= 1.0
