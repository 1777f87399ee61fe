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
from msgspec.structs import replace

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


@pytest.mark.parametrize(
    ("last", "wish", "command"),
    [
        # 5 cm/s of vy and 0.25 rad/s away: the turn's step of 0.005 rad/s is a fiftieth of it, and so is that of vy.
        (BodyTwist(-0.1, 0.05, 0.05), BodyTwist(-0.1, 0.1, -0.2), BodyTwist(-0.1, 0.051, 0.045)),
        # -10 and -10 cm/s and 0.2 rad/s away: a fortieth.
        (BodyTwist(-0.05, 0.1, -0.25), BodyTwist(-0.15, 0.0, -0.05), BodyTwist(-0.0525, 0.0975, -0.245)),
        # -5 and -20 cm/s and 0.25 rad/s away: a fiftieth.
        (BodyTwist(-0.05, 0.1, -0.25), BodyTwist(-0.1, -0.1, 0.0), BodyTwist(-0.051, 0.096, -0.245)),
    ],
)
def test_where_each_step_alone_makes_the_ball_too_fast_it_goes_straight_to_the_wish(last, wish, command):
    """The largest step on the straight line in which neither the velocity nor the turn changes too fast."""
    for side in (1.0, -1.0):  # and its mirror image
        mirrored = [BodyTwist(t.vx * side, t.vy * side, t.omega * side) for t in (last, wish, command)]
        _, found = apply(LIMITS, EnvelopeState(mirrored[0]), mirrored[1], Mode.PUSHING)
        assert (found.vx, found.vy, found.omega) == pytest.approx(tuple(vars_of(mirrored[2])), abs=1e-12)


def vars_of(twist: BodyTwist) -> tuple[float, float, float]:
    return twist.vx, twist.vy, twist.omega


def test_where_scaling_the_step_reduces_every_component_it_is_scaled():
    """From the ball at 0.15 m/s: 9 cm/s and 0.245 rad/s would be 0.155 m/s."""
    last, wish = BodyTwist(-0.05, 0.1, -0.25), BodyTwist(-0.05, -0.1, 0.0)
    _, found = apply(LIMITS, EnvelopeState(last), wish, Mode.PUSHING)
    share = 0.15 / math.hypot(-0.05 + 0.2 * 0.245, 0.09 - 0.245)
    assert vars_of(found) == pytest.approx((-0.05 * share, 0.09 * share, -0.245 * share))


def test_the_step_goes_straight_to_the_wished_velocity():
    """3-4-5: of 0.03 and 0.04 m/s, a step of 0.01 m/s is 0.006 and 0.008 m/s; the last one arrives."""
    _, found = apply(LIMITS, EnvelopeState(BodyTwist(0.01, 0.02, 0.0)), BodyTwist(0.04, 0.06, 0.0), Mode.PUSHING)
    assert vars_of(found) == pytest.approx((0.016, 0.028, 0.0))
    _, found = apply(LIMITS, EnvelopeState(BodyTwist(0.034, 0.052, 0.0)), BodyTwist(0.04, 0.06, 0.0), Mode.PUSHING)
    assert vars_of(found) == pytest.approx((0.04, 0.06, 0.0))


def judged(before: BodyTwist, twist: BodyTwist) -> Latch:
    state = GateState(seq=7, tick=40, frame_ns=10 * MS, twist=before)
    return on_frame(LIMITS, state, GateFrame(8, 41, 20 * MS, 2, twist), 20 * MS).latch


def test_the_gate_refuses_a_ball_that_is_too_fast():
    before = BodyTwist(0.0, 0.0, 0.145)
    assert judged(before, BodyTwist(0.0, 0.0, 0.147)) == Latch.NONE  # 0.1499 m/s at the ball
    assert judged(before, BodyTwist(0.0, 0.0, 0.148)) == Latch.CONTACT_SPEED  # 0.1509 m/s


def test_the_gates_margin_is_a_thousandth():
    ahead = replace(LIMITS, contact_y=0.0)
    state = GateState(seq=7, tick=40, frame_ns=10 * MS, twist=BodyTwist(0.0, 0.0, 0.149))
    for omega, latch in ((0.15 * 1.001, Latch.NONE), (0.15016, Latch.CONTACT_SPEED)):
        frame = GateFrame(8, 41, 20 * MS, 2, BodyTwist(0.0, 0.0, omega))
        assert on_frame(ahead, state, frame, 20 * MS).latch == latch


def test_the_gate_never_latches_on_a_frame_that_reduces_every_component():
    """Sideways against the turn the ball stands nearly still; less of the sideways part makes it faster."""
    before = BodyTwist(0.0, -0.15, 0.25)
    assert judged(before, BodyTwist(0.0, 0.0, 0.25)) == Latch.NONE
    assert judged(before, BodyTwist(0.0, -0.001, 0.2)) == Latch.NONE
    assert judged(before, BodyTwist(0.0, 0.0, 0.251)) == Latch.ENVELOPE
