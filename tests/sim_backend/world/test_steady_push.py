"""A push that goes on, many steps at once: the same bits however it is divided, compiled or recorded."""

from __future__ import annotations

import random

import pytest

from robot_io.log.world_messages import WorldState
from robot_io.messages import BodyTwist
from robot_io.named_values import ContactMode
from sim_backend.physics.steady import kernel
from sim_backend.world.world import World
from tools.rig import resolve_rig

MS = 1_000_000
SLIDERS = {
    "box": (),
    "barrel": ("world.slider.shape=circle",),
    "box with its weight aside": ("world.slider.cof_m=[0.03, -0.05]",),
    "box pushed at its edge": ("world.start.edge_offset_m=0.19",),
}


def commands(seed: int, seconds: float) -> list[tuple[int, BodyTwist]]:
    """Return drawn commands: mostly a push, now and then sideways, backwards, turning or none; each for 0.2 s."""
    dice = random.Random(seed)
    found = [(0, BodyTwist(0.1, 0.0, 0.0))]
    for at in range(200, round(1000 * seconds), 200):
        vx = dice.choice([0.1, 0.1, 0.1, 0.1, 0.3, 0.0, -0.1])
        found.append((at * MS, BodyTwist(vx, dice.uniform(-0.05, 0.05), dice.uniform(-0.2, 0.2))))
    return found


def pushed(slider: str, seed: int, *, steps_ms: int, steady: bool = True, **more) -> tuple[World, list[tuple]]:
    """Return a world after 12 s of drawn commands, and what its sensor saw and its slider was every 40 ms."""
    world = World(resolve_rig("sim", ["world.sensor.noise_force_N=0", *SLIDERS[slider]]), 3, 0, **more)
    if not steady:
        world._steady = None
    waiting, seen = commands(seed, 12.0), []
    for at in range(0, 12_000, 40):
        while waiting and waiting[0][0] <= at * MS:
            world.command_base(waiting.pop(0)[1], at * MS)
        for now in range(at + steps_ms, at + 41, steps_ms):
            world.advance_to(now * MS)
        seen.append((world.read_slider((at + 40) * MS), world._contact))
    return world, seen


@pytest.mark.parametrize("slider", SLIDERS)
def test_the_division_of_time_changes_no_bit(slider):
    assert pushed(slider, 1, steps_ms=1)[1] == pushed(slider, 1, steps_ms=40)[1] == pushed(slider, 1, steps_ms=8)[1]


@pytest.mark.parametrize("slider", SLIDERS)
def test_compiled_it_gives_the_same_bits(slider):
    assert kernel.compiled() is not None
    assert pushed(slider, 2, steps_ms=20, compiled=True)[1] == pushed(slider, 2, steps_ms=20)[1]


def test_a_listener_changes_no_bit_and_hears_every_ten_steps():
    heard: list[WorldState] = []
    more = {"on_record": lambda record: heard.append(record) if isinstance(record, WorldState) else None}
    assert pushed("box", 3, steps_ms=40, **more)[1] == pushed("box", 3, steps_ms=40)[1]
    assert [state.t_ns for state in heard] == list(range(0, 12_001 * MS, 10 * MS))


@pytest.mark.parametrize("slider", SLIDERS)
@pytest.mark.parametrize("seed", [4, *(pytest.param(n, marks=pytest.mark.long) for n in range(5, 26))])
def test_it_is_what_single_steps_are(slider, seed):
    """The two differ by rounding only, which a push makes larger as it goes on: by far less than 1 um and 1 uN."""
    for one, other in zip(
        pushed(slider, seed, steps_ms=40)[1], pushed(slider, seed, steps_ms=40, steady=False)[1], strict=True
    ):
        assert one[0].x == pytest.approx(other[0].x, abs=1e-8)
        assert one[0].y == pytest.approx(other[0].y, abs=1e-8)
        assert one[0].yaw == pytest.approx(other[0].yaw, abs=1e-7)
        assert one[1].force_x == pytest.approx(other[1].force_x, abs=1e-5)
        assert one[1].force_y == pytest.approx(other[1].force_y, abs=1e-5)
        assert one[1].mode == other[1].mode


def along(edge_m: float, twist: BodyTwist, *, steady: bool) -> tuple[list[int], list[tuple]]:
    """Push for 1.5 s, go on with another command for 4.5 s; return the faces then touched, and slider and contact."""
    start = (f"world.start.edge_offset_m={edge_m}", "world.start.spread=0")
    world, faces, seen = World(resolve_rig("sim", start), 3, 0), [], []
    if not steady:
        world._steady = None
    for at in range(0, 6_000, 40):
        world.command_base(BodyTwist(0.1, 0.0, 0.0) if at < 1_500 else twist, at * MS)
        world.advance_to((at + 40) * MS)
        if at >= 1_500:
            faces.append(world._slider.face)
            seen.append((world.read_slider((at + 40) * MS), world._contact))
    return faces, seen


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ball_that_leaves_its_face_goes_round_the_corner_as_in_single_steps(side):
    turned = BodyTwist(0.05, side * 0.1, 0.0)
    faces, seen = along(side * 0.15, turned, steady=True)
    single_faces, single = along(side * 0.15, turned, steady=False)
    assert faces == single_faces
    assert -1 in faces, "it never came to the corner"
    for (pose, contact), (other_pose, other) in zip(seen, single, strict=True):
        assert (pose.x, pose.y, pose.yaw) == pytest.approx((other_pose.x, other_pose.y, other_pose.yaw), abs=1e-7)
        assert contact.mode == other.mode


def test_a_ball_that_moves_more_than_a_millimetre_in_a_step_is_cut_into_pieces_as_in_single_steps():
    """1.1 m/s, the fastest that the base goes."""
    _, seen = along(0.03, BodyTwist(1.1, 0.0, 0.0), steady=True)
    _, single = along(0.03, BodyTwist(1.1, 0.0, 0.0), steady=False)
    for (pose, _), (other, _) in zip(seen, single, strict=True):
        assert (pose.x, pose.y, pose.yaw) == pytest.approx((other.x, other.y, other.yaw), abs=1e-8)


def test_a_ball_that_creeps_by_less_than_a_nanometre_a_second_rests_and_keeps_its_force():
    _, seen = along(0.03, BodyTwist(5e-10, 0.0, 0.0), steady=True)
    _, single = along(0.03, BodyTwist(5e-10, 0.0, 0.0), steady=False)
    assert [contact.mode for _, contact in seen] == [contact.mode for _, contact in single]
    assert seen[-1][1].mode == ContactMode.HOLDING


def test_nearly_every_step_of_a_push_is_one(monkeypatch):
    """Else it would save nothing."""
    single = []
    step = World._step
    monkeypatch.setattr(World, "_step", lambda self: single.append(self.now_ns) or step(self))
    world = World(resolve_rig("sim", []), 3, 0)
    for at in range(0, 12_000, 40):
        world.command_base(BodyTwist(0.1, 0.0, 0.0), at * MS)
        world.advance_to(at * MS)
    in_contact = [t_ns for t_ns in single if t_ns > 1_500 * MS]
    assert len(in_contact) <= 5


def test_given_and_state_are_as_they_are_named():
    """What the world hands over has the length that the kernel takes apart."""
    world = World(resolve_rig("sim", []), 3, 0)
    assert len(world._steady._given_now()) == len(kernel.GIVEN)
    assert 3 + 2 + len(world._slider.state) + 7 == len(kernel.STATE)
