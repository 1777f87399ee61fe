"""The contact ball is bounded like the base, lever arm included: by the envelope, and by the gate behind it.

The ball of the shipped rig is 1 m in front of the base: turning at 0.1 rad/s moves it sideways at 0.1 m/s. The limit
is 0.15 m/s, steps of a tick are 0.01 m/s and 0.005 rad/s.
"""

import itertools
import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_io.ipc.gate_frame import GateFrame
from robot_io.messages import BodyTwist
from robot_io.tick import EnvelopeState, Mode
from safety.envelope import EnvelopeLimits, apply, too_fast
from safety.gate import GateState, Latch, on_frame
from safety.settings import SafetySettings
from tools.rig import resolve_rig

MS = 1_000_000
LIMITS = EnvelopeLimits(0.15, 0.25, 1.0, 0.5, 10 * MS, 1.0, 0.2)


def ball(twist: BodyTwist) -> float:
    return math.hypot(twist.vx - 0.2 * twist.omega, twist.vy + 1.0 * twist.omega)


def settled(wish: BodyTwist) -> tuple[EnvelopeState, BodyTwist]:
    state = EnvelopeState()
    for _ in range(200):
        state, command = apply(LIMITS, state, wish, Mode.PUSHING)
    return state, command


def test_the_arm_comes_from_the_rig():
    limits = SafetySettings.of(resolve_rig("sim")).envelope
    assert (limits.contact_x, limits.contact_y) == (1.0, 0.0)


def test_a_turn_that_would_throw_the_ball_is_scaled_as_a_whole():
    """0.15 m/s ahead and 0.25 rad/s were 0.10 and 0.25 m/s at the ball."""
    state, command = settled(BodyTwist(0.15, 0.0, 0.25))
    share = 0.15 / math.hypot(0.10, 0.25)
    assert (command.vx, command.vy, command.omega) == pytest.approx((0.15 * share, 0.0, 0.25 * share))
    assert state.clamped


@pytest.mark.parametrize("wish", [BodyTwist(0.1, 0.0, 0.1), BodyTwist(0.0, -0.1, 0.2), BodyTwist(0.15, 0.0, 0.0)])
def test_a_wish_at_which_the_ball_is_slow_passes(wish):
    state, command = settled(wish)
    assert command == wish
    assert not state.clamped


def test_the_measured_turn_rate_is_not_multiplied_by_the_arm():
    assert not too_fast(LIMITS, BodyTwist(0.15, 0.0, 0.25))


def passed_by_the_gate(commands: list[BodyTwist]) -> Latch:
    state = GateState()
    for n, twist in enumerate(commands, 1):
        state = on_frame(LIMITS, state, GateFrame(n, n, n * 10 * MS, 2, twist), n * 10 * MS)
    return state.latch


velocity = st.floats(-0.3, 0.3)
wishes = st.tuples(st.builds(BodyTwist, velocity, velocity, velocity), st.sampled_from(list(Mode)), st.integers(1, 20))


@settings(deadline=None, max_examples=300)
@given(st.lists(wishes, max_size=12))
def test_over_any_wishes_the_ball_keeps_its_limit_and_the_gate_agrees(phases):
    state, commands = EnvelopeState(), []
    for wish, mode, ticks in phases:
        for _ in range(ticks):
            state, command = apply(LIMITS, state, wish, mode)
            commands.append(command)
    assert max(map(ball, commands), default=0.0) <= 0.15 * (1 + 1e-9)
    assert passed_by_the_gate(commands) == Latch.NONE


def test_every_wish_is_reached_from_every_command():
    """The commands never stick at the ball's limit: random pairs of wishes inside it, two seconds each."""
    draw = random.Random(3)
    inside = (BodyTwist(*(draw.uniform(-0.25, 0.25) for _ in range(3))) for _ in itertools.count())
    wishes = itertools.islice((w for w in inside if ball(w) < 0.15 and math.hypot(w.vx, w.vy) < 0.15), 60)
    state = EnvelopeState()
    for wish in wishes:
        for _ in range(200):
            state, command = apply(LIMITS, state, wish, Mode.PUSHING)
        assert (command.vx, command.vy, command.omega) == pytest.approx((wish.vx, wish.vy, wish.omega), abs=1e-9)


def judged(before: BodyTwist, twist: BodyTwist) -> Latch:
    state = GateState(seq=7, tick=40, frame_ns=10 * MS, twist=before)
    return on_frame(LIMITS, state, GateFrame(8, 41, 20 * MS, 2, twist), 20 * MS).latch


def test_the_gate_refuses_a_ball_that_is_too_fast():
    before = BodyTwist(0.0, 0.0, 0.145)
    assert judged(before, BodyTwist(0.0, 0.0, 0.147)) == Latch.NONE  # 0.1499 m/s at the ball
    assert judged(before, BodyTwist(0.0, 0.0, 0.148)) == Latch.CONTACT_SPEED  # 0.1509 m/s


def test_the_gate_never_latches_on_a_frame_that_reduces_every_component():
    """Sideways against the turn the ball stands nearly still; less of the sideways part makes it faster."""
    before = BodyTwist(0.0, -0.15, 0.25)
    assert judged(before, BodyTwist(0.0, 0.0, 0.25)) == Latch.NONE
    assert judged(before, BodyTwist(0.0, -0.001, 0.2)) == Latch.NONE
    assert judged(before, BodyTwist(0.0, 0.0, 0.251)) == Latch.ENVELOPE
