"""The envelope: finite, inside every limit, zero where the mode says so, and never a turned direction."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_io.messages import BodyTwist
from robot_io.tick import EnvelopeState, Mode
from safety.envelope import EnvelopeLimits, apply

LIMITS = EnvelopeLimits(0.15, 0.25, 1.0, 0.5, 10_000_000, 0.0, 0.0)
ZERO = BodyTwist()
STILL = (Mode.SILENT, Mode.READY, Mode.STOP, Mode.DEAD)
MOVING = (Mode.PUSHING, Mode.SLOW, Mode.HOLD)
velocity = st.floats(-2.0, 2.0)
twists = st.builds(BodyTwist, velocity, velocity, st.floats(-1.0, 1.0))
anything = st.floats(allow_nan=True, allow_infinity=True)
wild_twists = st.builds(BodyTwist, anything, anything, anything)


def settle(wanted, mode=Mode.PUSHING, state=None, ticks=400):
    """Apply the same wish until the rate limit no longer shows."""
    state = state or EnvelopeState()
    for _ in range(ticks):
        state, command = apply(LIMITS, state, wanted, mode)
    return state, command


@pytest.mark.parametrize("mode", STILL)
def test_zero_in_this_very_tick(mode):
    state, command = apply(LIMITS, EnvelopeState(BodyTwist(0.15, 0.0, 0.2), 3, True), BodyTwist(0.1, 0.1, 0.1), mode)
    assert command == ZERO
    assert state == EnvelopeState(ZERO, 3, False)


def test_hold_ramps_to_zero_at_the_acceleration_limit():
    state, speeds = EnvelopeState(BodyTwist(0.1, 0.0, 0.05)), []
    for _ in range(12):
        state, command = apply(LIMITS, state, BodyTwist(0.1, 0.0, 0.05), Mode.HOLD)
        speeds.append((command.vx, command.omega))
    assert speeds[0] == pytest.approx((0.09, 0.045))
    assert speeds[9:] == [pytest.approx((0.0, 0.0), abs=1e-15)] * 3
    assert command == ZERO


def test_slow_is_half_of_the_wish():
    _, command = settle(BodyTwist(0.1, -0.04, 0.1), Mode.SLOW)
    assert (command.vx, command.vy, command.omega) == pytest.approx((0.05, -0.02, 0.05))


def test_a_wish_inside_the_limits_passes_unchanged():
    wish = BodyTwist(0.1, 0.05, -0.2)
    state, command = settle(wish)
    assert command == wish
    assert (state.clamps, state.clamped) == (0, False)


def test_a_wish_beyond_them_is_scaled_and_counted():
    state, command = apply(LIMITS, EnvelopeState(BodyTwist(0.09, 0.12, 0.25)), BodyTwist(0.3, 0.4, 1.0), Mode.PUSHING)
    assert (command.vx, command.vy, command.omega) == pytest.approx((0.09, 0.12, 0.25))
    assert (state.clamps, state.clamped) == (1, True)
    state, _ = apply(LIMITS, state, BodyTwist(0.09, 0.12, 0.0), Mode.PUSHING)
    assert (state.clamps, state.clamped) == (1, False)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("mode", MOVING)
def test_a_wish_that_is_no_number_is_a_wish_for_zero(bad, place, mode):
    wish = BodyTwist(*(bad if i == place else 0.1 for i in range(3)))
    _, command = apply(LIMITS, EnvelopeState(BodyTwist(0.1, 0.0, 0.0)), wish, mode)
    assert (command.vx, command.vy, command.omega) == pytest.approx((0.09, 0.0, 0.0))
    assert settle(wish, mode)[1] == ZERO


def around(limit, ulps=3):
    values, up, down = [limit], limit, limit
    for _ in range(ulps):
        up, down = math.nextafter(up, math.inf), math.nextafter(down, 0.0)
        values += [up, down]
    return values


@pytest.mark.parametrize("direction", [0.0, 0.7, math.pi / 2, math.pi, -2.5])
def test_the_speed_limit_to_the_last_bit(direction):
    for speed in (*around(LIMITS.speed), 0.149, 0.151, 1e6):
        wish = BodyTwist(speed * math.cos(direction), speed * math.sin(direction), 0.0)
        start = EnvelopeState(BodyTwist(0.15 * math.cos(direction), 0.15 * math.sin(direction), 0.0))
        state, command = apply(LIMITS, start, wish, Mode.PUSHING)
        assert math.hypot(command.vx, command.vy) <= LIMITS.speed * (1.0 + 1e-12)
        if math.hypot(wish.vx, wish.vy) <= LIMITS.speed:
            assert (command, state.clamped) == (wish, False)
        else:
            assert state.clamped


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_turn_limit_to_the_last_bit(sign):
    for rate in (*around(LIMITS.turn_rate), 1e6):
        start = EnvelopeState(BodyTwist(0.0, 0.0, sign * 0.25))
        state, command = apply(LIMITS, start, BodyTwist(0.0, 0.0, sign * rate), Mode.PUSHING)
        assert abs(command.omega) <= LIMITS.turn_rate
        assert state.clamped == (rate > LIMITS.turn_rate)


def test_the_acceleration_limit_to_the_last_bit():
    for change in around(0.01):
        _, command = apply(LIMITS, EnvelopeState(), BodyTwist(change, 0.0, 0.0), Mode.PUSHING)
        assert command.vx <= 0.01
        assert command.vx == pytest.approx(change, abs=1e-16)
    for change in around(0.005):
        _, command = apply(LIMITS, EnvelopeState(), BodyTwist(0.0, 0.0, change), Mode.PUSHING)
        assert command.omega <= 0.005


@settings(deadline=None, max_examples=200)
@given(st.lists(st.tuples(st.one_of(twists, wild_twists), st.sampled_from(list(Mode))), max_size=60))
def test_over_any_sequence_the_command_is_finite_and_inside_every_limit(sequence):
    state, last = EnvelopeState(), ZERO
    for wish, mode in sequence:
        state, command = apply(LIMITS, state, wish, mode)
        assert all(math.isfinite(v) for v in (command.vx, command.vy, command.omega))
        assert math.hypot(command.vx, command.vy) <= LIMITS.speed * (1 + 1e-9)
        assert abs(command.omega) <= LIMITS.turn_rate * (1 + 1e-9)
        assert state.last == command
        if mode in STILL:
            assert command == ZERO
        else:
            assert math.hypot(command.vx - last.vx, command.vy - last.vy) <= 0.01 + 1e-12
            assert abs(command.omega - last.omega) <= 0.005 + 1e-12
        if mode == Mode.HOLD:
            assert math.hypot(command.vx, command.vy) <= math.hypot(last.vx, last.vy) + 1e-15
        last = command


@settings(deadline=None, max_examples=200)
@given(st.floats(0.01, 100.0), st.floats(-math.pi, math.pi), st.sampled_from([Mode.PUSHING, Mode.SLOW]))
def test_clamps_never_turn_a_velocity(speed, direction, mode):
    wish = BodyTwist(speed * math.cos(direction), speed * math.sin(direction), 0.0)
    state = EnvelopeState()
    for _ in range(30):  # on the way up as well
        state, command = apply(LIMITS, state, wish, mode)
        assert math.remainder(math.atan2(command.vy, command.vx) - direction, math.tau) == pytest.approx(0, abs=1e-9)
