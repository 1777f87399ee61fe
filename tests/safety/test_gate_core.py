"""The gate's judgement: what may pass, what latches it and why, and when zero leaves."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from robot_io.ipc.gate_frame import GateFrame
from robot_io.messages import BodyTwist
from safety import gate
from safety.envelope import EnvelopeLimits
from safety.faults import FAULTS
from safety.gate import (
    LATCH_FAULT,
    LATCH_TEXT,
    GateState,
    Latch,
    due,
    latched,
    on_clock,
    on_frame,
    on_frames,
    on_own_pause,
)

MS = 1_000_000
T0 = 1_000 * MS
LIMITS = EnvelopeLimits(0.15, 0.25, 1.0, 0.5, 10 * MS, 0.0, 0.0)
ZERO = BodyTwist()
ROLLING = GateState(seq=7, tick=40, frame_ns=T0, twist=BodyTwist(0.1, 0.0, 0.0))
"""A gate in the middle of a push."""


def frame(seq=8, tick=41, sent_ns=T0 + 10 * MS, twist=ROLLING.twist):
    return GateFrame(seq, tick, sent_ns, 2, twist)


def judged(the_frame, state=ROLLING, now_ns=T0 + 10 * MS):
    return on_frame(LIMITS, state, the_frame, now_ns)


def ulps(value, count=4):
    values = [value]
    up = down = value
    for _ in range(count):
        up, down = math.nextafter(up, math.inf), math.nextafter(down, -math.inf)
        values += [up, down]
    return values


# --- what passes, what does not ----------------------------------------------------------------------------------


def test_a_good_frame_passes():
    after = judged(frame(twist=BodyTwist(0.105, 0.002, 0.001)))
    assert after.latch == Latch.NONE
    assert (after.seq, after.tick, after.frame_ns) == (8, 41, T0 + 10 * MS)
    assert after.twist == BodyTwist(0.105, 0.002, 0.001)


def test_the_first_frame_is_number_one_and_any_tick():
    for tick in (0, 1, 5000):
        assert judged(frame(1, tick, twist=ZERO), GateState()).latch == Latch.NONE
    assert judged(frame(0, 0, twist=ZERO), GateState()).latch == Latch.SEQUENCE
    assert judged(frame(2, 0, twist=ZERO), GateState()).latch == Latch.SEQUENCE
    assert judged(frame(1, -1, twist=ZERO), GateState()).latch == Latch.FROZEN_TICK


def test_nonsense_latches():
    assert judged(None).latch == Latch.NONSENSE


@pytest.mark.parametrize("seq", [0, 6, 7, 9, 8 + 2**32, -8])
def test_a_missing_or_doubled_frame_latches(seq):
    assert judged(frame(seq=seq)).latch == Latch.SEQUENCE


@pytest.mark.parametrize(("tick", "latch"), [(40, Latch.FROZEN_TICK), (39, Latch.FROZEN_TICK), (41, 0), (45, 0)])
def test_a_tick_must_move_with_the_sequence(tick, latch):
    assert judged(frame(tick=tick)).latch == latch


@pytest.mark.parametrize(("age_ns", "latch"), [(0, 0), (50 * MS, 0), (50 * MS + 1, Latch.STALE), (-5, 0)])
def test_an_old_frame_latches(age_ns, latch):
    now = T0 + 60 * MS
    assert judged(frame(sent_ns=now - age_ns), now_ns=now).latch == latch


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_a_velocity_that_is_no_number_latches(bad, place):
    assert judged(frame(twist=BodyTwist(*(bad if i == place else 0.0 for i in range(3))))).latch == Latch.NOT_FINITE


@pytest.mark.parametrize("direction", [0.0, 1.0, math.pi / 2, -2.0, math.pi])
def test_the_speed_limit(direction):
    """A billionth of slack for rounding, no more."""
    cos, sin = math.cos(direction), math.sin(direction)
    state = replace(ROLLING, twist=BodyTwist(0.15 * cos, 0.15 * sin, 0.0))
    for speed in ulps(0.15):
        assert judged(frame(twist=BodyTwist(speed * cos, speed * sin, 0.0)), state).latch == Latch.NONE
    for speed in (0.15 * (1 + 3e-9), 0.151, 1.0, 1e300):
        assert judged(frame(twist=BodyTwist(speed * cos, speed * sin, 0.0)), state).latch == Latch.ENVELOPE


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_turn_limit(sign):
    state = replace(ROLLING, twist=BodyTwist(0.1, 0.0, sign * 0.25))
    for rate in ulps(0.25):
        assert judged(frame(twist=BodyTwist(0.1, 0.0, sign * rate)), state).latch == Latch.NONE
    for rate in (0.25 * (1 + 3e-9), 0.26, 1e300):
        assert judged(frame(twist=BodyTwist(0.1, 0.0, sign * rate)), state).latch == Latch.ENVELOPE


@pytest.mark.parametrize("ticks", [1, 2, 5])
def test_a_step_of_the_speed(ticks):
    """1.2 x 1 m/s^2 x 10 ms a tick: 12 mm/s each."""
    start = replace(ROLLING, twist=BodyTwist(0.02, 0.0, 0.0))
    most = 0.012 * ticks
    for dx, dy in ((1.0, 0.0), (0.6, 0.8), (0.0, -1.0)):
        for share, latch in ((0.999, Latch.NONE), (1.001, Latch.STEP)):
            twist = BodyTwist(0.02 + most * share * dx, most * share * dy, 0.0)
            assert judged(frame(tick=40 + ticks, twist=twist), start).latch == latch


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_step_of_the_turn_rate(sign):
    """1.2 x 0.5 rad/s^2 x 10 ms: 6 mrad/s a tick."""
    for step, latch in ((0.00599, Latch.NONE), (0.00601, Latch.STEP)):
        assert judged(frame(twist=BodyTwist(0.1, 0.0, sign * step))).latch == latch


def test_every_limit_itself_still_passes_and_the_next_number_does_not():
    """To the last bit, from rest (where the sums are exact), with an acceleration that is not 1."""
    limits = EnvelopeLimits(0.15, 0.25, 2.0, 0.5, 10 * MS, 0.0, 0.0)
    for key, most, latch in (
        ("vx", 1.2 * 2.0 * (10 * MS * 1e-9), Latch.STEP),
        ("vy", 1.2 * 2.0 * (10 * MS * 1e-9), Latch.STEP),
        ("omega", 1.2 * 0.5 * (10 * MS * 1e-9), Latch.STEP),
        ("vx", 0.15 * (1.0 + 1e-9), Latch.ENVELOPE),
        ("omega", 0.25 * (1.0 + 1e-9), Latch.ENVELOPE),
    ):
        # towards the envelope from just below it, towards a step from rest
        before = BodyTwist(**{key: most - 1e-3}) if latch == Latch.ENVELOPE else ZERO
        for value, found in ((most, Latch.NONE), (math.nextafter(most, 1.0), latch)):
            after = on_frame(
                limits, replace(ROLLING, twist=before), frame(twist=BodyTwist(**{key: value})), T0 + 10 * MS
            )
            assert after.latch == found


def test_ticks_count_from_number_zero_too():
    start = replace(ROLLING, tick=0, twist=ZERO)
    assert judged(frame(tick=3, twist=BodyTwist(0.0359)), start).latch == Latch.NONE
    assert judged(frame(tick=3, twist=BodyTwist(0.0361)), start).latch == Latch.STEP


def test_a_tick_that_leaps_ahead_excuses_no_step():
    """At most 50 ms may pass between two frames: 6 ticks of 12 mm/s, whatever the tick says."""
    start = replace(ROLLING, twist=BodyTwist(0.02, 0.0, 0.0))
    for tick in (46, 1000, 10**9):
        assert judged(frame(tick=tick, twist=BodyTwist(0.0919, 0.0, 0.0)), start).latch == Latch.NONE
        assert judged(frame(tick=tick, twist=BodyTwist(0.0921, 0.0, 0.0)), start).latch == Latch.STEP


def test_the_first_frame_may_step_one_tick_from_rest():
    assert judged(frame(1, 700, twist=BodyTwist(0.0119, 0.0, 0.0)), GateState()).latch == Latch.NONE
    assert judged(frame(1, 700, twist=BodyTwist(0.0121, 0.0, 0.0)), GateState()).latch == Latch.STEP


@pytest.mark.parametrize(
    ("before", "after", "latch"),
    [
        (BodyTwist(0.15, 0.0, 0.2), ZERO, 0),  # down at once, in every component
        (BodyTwist(0.1, -0.1, 0.2), BodyTwist(0.02, -0.01, 0.0), 0),
        (BodyTwist(-0.1, 0.0, -0.2), BodyTwist(-0.01, 0.0, -0.2), 0),
        (BodyTwist(0.1, 0.0, 0.0), BodyTwist(-0.1, 0.0, 0.0), Latch.STEP),  # through zero is no braking
        (BodyTwist(0.1, 0.0, 0.0), BodyTwist(0.0, 0.05, 0.0), Latch.STEP),  # slower but elsewhere
        (BodyTwist(0.1, 0.0, 0.2), BodyTwist(0.0, 0.0, -0.2), Latch.STEP),
    ],
)
def test_braking_is_never_a_step(before, after, latch):
    assert judged(frame(twist=after), replace(ROLLING, twist=before)).latch == latch


# --- silence, end, measured speed, link --------------------------------------------------------------------------


@pytest.mark.parametrize(("silent_ns", "latch"), [(50 * MS, 0), (50 * MS + 1, Latch.SILENCE), (10**12, Latch.SILENCE)])
def test_silence_of_control(silent_ns, latch):
    after = on_clock(ROLLING, T0 + silent_ns)
    assert after.latch == latch
    assert after.twist == (ZERO if latch else ROLLING.twist)


def test_before_the_first_frame_silence_is_no_fault():
    assert on_clock(GateState(), T0) == GateState()


def test_measured_overspeed_latches_after_three_in_a_row():
    fast, slow = BodyTwist(0.196, 0.0, 0.0), BodyTwist(0.195, 0.0, 0.3)
    state = ROLLING
    for twist, latch in ((fast, 0), (fast, 0), (slow, 0), (fast, 0), (fast, 0), (fast, Latch.OVERSPEED)):
        state = gate.on_speed(LIMITS, state, twist)
        assert state.latch == latch
    assert state.twist == ZERO


@pytest.mark.parametrize("twist", [BodyTwist(math.nan), BodyTwist(0.0, math.nan), BodyTwist(0.1, 0.0, math.nan)])
def test_a_measured_speed_that_is_no_number_has_a_latch_of_its_own(twist):
    state = ROLLING
    for latch in (0, 0, Latch.ODOMETRY):
        state = gate.on_speed(LIMITS, state, twist)
        assert state.latch == latch
    assert gate.LATCH_FAULT[Latch.ODOMETRY] == "F49"


@pytest.mark.parametrize(
    "twist", [BodyTwist(0.1, 0.17, 0.0), BodyTwist(0.0, 0.0, 0.326), BodyTwist(0, 0, -0.326), BodyTwist(math.nan)]
)
def test_what_counts_as_overspeed(twist):
    assert gate.on_speed(LIMITS, ROLLING, twist).overspeed == 1
    assert gate.on_speed(LIMITS, ROLLING, BodyTwist(0.1, 0.16, 0.325)).overspeed == 0


def test_the_end_of_control_while_it_stands_and_while_it_moves():
    assert gate.on_eof(replace(ROLLING, twist=ZERO)).latch == Latch.EOF
    assert gate.on_eof(ROLLING).latch == Latch.EOF_MOVING
    assert gate.on_eof(latched(ROLLING, Latch.STEP)).latch == Latch.STEP


def test_the_first_cause_stays_for_ever_and_nothing_but_zero_is_left():
    state = latched(ROLLING, Latch.STEP)
    for after in (
        judged(frame(), state),
        judged(frame(twist=ZERO), state),  # nothing is wrong with this one, and it is too late
        judged(None, state),
        on_clock(state, T0 + 10**12),
        latched(state, Latch.LINK),
        gate.on_eof(state),
        gate.on_speed(LIMITS, replace(state, overspeed=5), BodyTwist(9.0, 0.0, 0.0)),
    ):
        assert after.latch == Latch.STEP
        assert after.twist == ZERO


def test_every_latch_has_a_text_and_names_a_row_of_the_fault_table():
    assert [int(latch) for latch in Latch] == list(range(19))  # each its own, for ever: the numbers are in logs
    assert set(LATCH_TEXT) == set(Latch)
    assert set(LATCH_FAULT) <= set(Latch)
    assert set(LATCH_FAULT.values()) <= set(FAULTS)


# --- when something is sent --------------------------------------------------------------------------------------


def going(twist, sent, ago_ms):
    return replace(ROLLING, twist=twist, sent=sent, sent_ns=T0 - round(ago_ms * MS))


@pytest.mark.parametrize(
    ("twist", "sent", "ago_ms", "leaves"),
    [
        (BodyTwist(0.1), BodyTwist(0.1), 17.999, False),  # repeats keep the grid
        (BodyTwist(0.1), BodyTwist(0.1), 18.0, True),
        (BodyTwist(0.11), BodyTwist(0.1), 10.0, False),  # growing ones wait for it
        (BodyTwist(0.11), BodyTwist(0.1), 20.0, True),
        (BodyTwist(0.09), BodyTwist(0.1), 0.0, True),  # reduced ones leave at once
        (BodyTwist(-0.09), BodyTwist(-0.1), 0.0, True),
        (ZERO, BodyTwist(0.1, -0.05, 0.2), 0.0, True),
        (ZERO, ZERO, 0.0, False),
        (BodyTwist(0.05, 0.01), BodyTwist(0.1, 0.0), 5.0, False),  # grows in one component
        (BodyTwist(0.05, 0.0), BodyTwist(-0.1, 0.0), 5.0, False),  # smaller, but the other way
        (ZERO, ZERO, 18.0, True),
    ],
)
def test_reduced_commands_leave_at_once_and_others_every_20_ms(twist, sent, ago_ms, leaves):
    found = due(LIMITS, going(twist, sent, ago_ms), T0)
    assert found == (twist if leaves else None)


@pytest.mark.parametrize("twist", [BodyTwist(0.1), BodyTwist(0.11)])
def test_a_command_waits_for_its_frame_and_does_not_leave_old(twist):
    """Something else wakes the gate 18 ms after the last command, and control's next frame comes at 20 ms."""
    state = replace(ROLLING, twist=twist, sent=BodyTwist(0.1), sent_ns=T0, frame_ns=T0 - MS)
    second = replace(state, frame_ns=T0 + 10 * MS)
    assert due(LIMITS, second, T0 + 10 * MS) is None
    assert due(LIMITS, second, T0 + 18 * MS) is None
    assert due(LIMITS, second, T0 + 19 * MS) is None
    third = replace(state, frame_ns=T0 + 20 * MS)
    assert due(LIMITS, third, T0 + 20 * MS) == twist
    assert due(LIMITS, replace(state, frame_ns=T0 + 18 * MS), T0 + 18 * MS) == twist  # after a tick that was late


def test_a_tick_that_does_not_come_leaves_no_gap_in_the_commands():
    """It is awaited for 2 ms; then the last command is repeated, until control's silence latches."""
    state = replace(ROLLING, twist=BodyTwist(0.1), sent=BodyTwist(0.1), sent_ns=T0, frame_ns=T0 + 10 * MS)
    assert due(LIMITS, state, T0 + 22 * MS - 1) is None
    assert due(LIMITS, state, T0 + 22 * MS) == BodyTwist(0.1)


@pytest.mark.parametrize(("next_ms", "waits"), [(30.0, True), (30.001, False), (40.0, False)])
def test_a_frame_that_is_to_come_later_than_30_ms_after_a_command_is_not_awaited(next_ms, waits):
    limits = replace(LIMITS, period_ns=20 * MS)
    frame_ns = T0 + round((next_ms - 20.0) * MS)
    state = replace(ROLLING, twist=BodyTwist(0.1), sent=BodyTwist(0.1), sent_ns=T0, frame_ns=frame_ns)
    now = max(T0 + 18 * MS, frame_ns + 3 * MS)
    assert due(limits, state, now) == (None if waits else BodyTwist(0.1))


def test_a_latched_gate_awaits_nothing():
    """Control may still be sending; zeros are repeated every 18 ms all the same."""
    state = latched(replace(ROLLING, sent=ZERO, sent_ns=T0, frame_ns=T0 + 10 * MS), Latch.STEP)
    assert due(LIMITS, state, T0 + 18 * MS) == ZERO


@pytest.mark.parametrize(
    ("rate_hz", "leaves_ms"), [(50, 20), (60, 18), (80, 25), (100, 20), (125, 24), (200, 20), (500, 18)]
)
def test_at_any_rate_a_command_leaves_within_30_ms_and_not_old(rate_hz, leaves_ms):
    """In the gate's own rhythm of 0.1 ms, after a command at T0 and a frame in each period from then on."""
    limits = replace(LIMITS, period_ns=round(1000 / rate_hz * MS))
    state = replace(ROLLING, twist=BodyTwist(0.1), sent=BodyTwist(0.1), sent_ns=T0, frame_ns=T0)
    for tenth in range(400):
        now = T0 + tenth * MS // 10
        if now - state.frame_ns >= limits.period_ns:
            state = replace(state, frame_ns=now)
        if due(limits, state, now) is not None:
            break
    assert (now - T0) / MS == pytest.approx(leaves_ms, abs=1)
    assert now - state.frame_ns < 2 * MS


def test_before_the_first_frame_nothing_is_sent_unless_it_has_latched():
    assert due(LIMITS, GateState(), T0) is None
    assert due(LIMITS, latched(GateState(), Latch.LINK), T0) == ZERO


def test_sent_is_what_really_went_out():
    state = gate.sent(ROLLING, BodyTwist(0.05), T0 + 3)
    assert (state.sent, state.sent_ns) == (BodyTwist(0.05), T0 + 3)
    assert state.twist == ROLLING.twist


@pytest.mark.parametrize("cause", [c for c in Latch if c])
def test_zero_leaves_in_the_moment_of_the_latch_and_goes_on(cause):
    state = replace(latched(going(BodyTwist(0.1), BodyTwist(0.1), 1.0), cause))
    now, zeros = T0, 0
    for _ in range(100):
        wanted = due(LIMITS, state, now)
        if wanted is not None:
            assert wanted == ZERO
            state = gate.sent(state, wanted, now)
            zeros += 1
        elif zeros == 0:
            raise AssertionError("the first zero has to leave at once")
        now += 2 * MS
    assert zeros == pytest.approx(200 / 18, abs=2)


def test_control_silent_or_dead_means_zero_within_the_bound_of_the_table():
    """Rows F65 and F66, in the gate's own rhythm of 2 ms, from the first tick without a frame."""
    state, now = ROLLING, T0
    while not state.latch:
        now += 2 * MS
        state = on_clock(state, now)
    assert now - (T0 + 10 * MS) <= FAULTS["F66"].bound_ticks * 10 * MS
    assert LATCH_FAULT[state.latch] == "F66"
    assert due(LIMITS, state, now) == ZERO
    dead = gate.on_eof(ROLLING)  # a killed process closes its end in the same moment
    assert LATCH_FAULT[dead.latch] == "F65"
    assert due(LIMITS, gate.sent(dead, ROLLING.twist, T0), T0) == ZERO


# --- any sequence ------------------------------------------------------------------------------------------------

number = st.one_of(st.floats(-0.2, 0.2), st.floats(allow_nan=True, allow_infinity=True))
gentle = st.builds(
    lambda *v: ("gentle", *v), st.floats(-0.008, 0.008), st.floats(-0.008, 0.008), st.floats(-0.005, 0.005)
)
event = st.one_of(
    st.builds(
        lambda *v: ("frame", *v),
        st.sampled_from([1, 1, 1, 1, 1, 0, 2]),
        st.sampled_from([1, 1, 1, 3, 0, -1]),
        st.sampled_from([0, 1 * MS, 40 * MS, 60 * MS]),
        number,
        number,
        number,
    ),
    gentle,
    st.tuples(st.just("clock")),
    st.tuples(st.just("speed"), number, number),
    st.tuples(st.just("nonsense")),
    st.tuples(st.just("eof")),
)
mostly_good = st.lists(st.sampled_from([event, *[gentle] * 6]).flatmap(lambda kind: kind), max_size=60)


@settings(deadline=None, max_examples=300)
@given(mostly_good, st.lists(st.sampled_from([2, 10, 10, 10, 51]), min_size=60, max_size=60))
def test_over_any_sequence_of_events(events, gaps):
    """Whatever comes: finite, inside the envelope, in its own steps; once latched, only zeros, for ever."""
    state, now, out = GateState(), T0, []
    for one, gap in zip(events, gaps, strict=False):
        now += gap * MS
        before = state
        if one[0] == "frame":
            _, dseq, dtick, age, *twist = one
            state = on_frame(
                LIMITS, state, GateFrame(state.seq + dseq, state.tick + dtick, now - age, 2, BodyTwist(*twist)), now
            )
        elif one[0] == "gentle":
            t = state.twist
            twist = BodyTwist(t.vx + one[1], t.vy + one[2], t.omega + one[3])
            state = on_frame(LIMITS, state, GateFrame(state.seq + 1, state.tick + 1, now, 2, twist), now)
        elif one[0] == "speed":
            state = gate.on_speed(LIMITS, state, BodyTwist(one[1], one[2], 0.0))
        elif one[0] == "nonsense":
            state = on_frame(LIMITS, state, None, now)
        elif one[0] == "eof":
            state = gate.on_eof(state)
        state = on_clock(state, now)
        if before.latch:
            assert state.latch == before.latch
        wanted = due(LIMITS, state, now)
        if wanted is None:
            continue
        assert all(math.isfinite(v) for v in (wanted.vx, wanted.vy, wanted.omega))
        assert math.hypot(wanted.vx, wanted.vy) <= LIMITS.speed * (1 + 2e-9)
        assert abs(wanted.omega) <= LIMITS.turn_rate * (1 + 2e-9)
        if state.latch:
            assert wanted == ZERO
        state = gate.sent(state, wanted, now)
        out.append(wanted)
    if events and events[-1][0] in ("nonsense", "eof"):
        assert state.latch
        assert not out or due(LIMITS, replace(state, sent_ns=0), now) == ZERO


def test_frames_that_waited_for_the_gate_are_judged_and_only_the_newest_must_be_fresh():
    """The gate was held up for 70 ms; control went on and its frames waited in the socket."""
    state = ROLLING
    start_ns = state.frame_ns
    waiting = [GateFrame(state.seq + n, state.tick + n, start_ns + n * 10 * MS, 2, state.twist) for n in range(1, 8)]
    now_ns = start_ns + 71 * MS
    assert on_frame(LIMITS, state, waiting[0], now_ns).latch == Latch.STALE
    after = on_frames(LIMITS, state, waiting, now_ns)
    assert after.latch == Latch.NONE
    assert (after.seq, after.tick, after.frame_ns) == (state.seq + 7, state.tick + 7, now_ns)
    # A newest frame that is old itself, a missing one, or nonsense among them latches as ever.
    assert on_frames(LIMITS, state, waiting, now_ns + 51 * MS).latch == Latch.STALE
    assert on_frames(LIMITS, state, waiting[:3] + waiting[4:], now_ns).latch == Latch.SEQUENCE
    assert on_frames(LIMITS, state, [waiting[0], None, waiting[1]], now_ns).latch == Latch.NONSENSE
    assert on_frames(LIMITS, state, [], now_ns) == state


def test_a_gate_that_was_frozen_itself_latches():
    state = ROLLING
    assert on_own_pause(state, 100 * MS).latch == Latch.NONE
    frozen = on_own_pause(state, 100 * MS + 1)
    assert frozen.latch == Latch.PAUSED
    assert frozen.twist == BodyTwist()


def test_a_gate_begins_with_nothing_heard_and_nothing_sent():
    assert GateState() == GateState(
        latch=Latch.NONE, seq=0, tick=-1, frame_ns=0, twist=ZERO, sent=ZERO, sent_ns=0, overspeed=0, said_ns=0
    )
