"""Whatever a tick sees and whatever reaches the gate: finite, inside the envelope, zero once latched, bounded, ended.

And no reaction is let go without its clear condition. The rules are in `fold_rules`. A failure names its seed:
`any_run.run(any_run.drawn_sequence(random.Random("SEED/NUMBER")))` is that sequence again.
"""

from __future__ import annotations

import random

import joblib
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.how_many import how_many
from tests.safety.any_input import HOWS, TICKS, Change, places
from tests.safety.any_run import FRAME_WRONGS, STARTS, Sequence, Wrong, drawn_sequence, run

CHUNK = 250
MOST_BEGIN = 900
"""A push of 0.3 m has about as many ticks."""
MOST_TICKS = 40_000
"""A push of the shipped rig is bounded at 258 s in motion; with its rests it has ended long before this."""


def sequences(seed: int, first: int, count: int) -> int:
    """Run sequences one after the other; return how many ticks they had."""
    ticks = 0
    for number in range(first, first + count):
        try:
            ticks += run(drawn_sequence(random.Random(f"{seed}/{number}")))
        except Exception as error:
            raise AssertionError(f"sequence {seed}/{number}: {error!r}") from error
    return ticks


def whole_push(seed: int, number: int) -> int:
    """Run one push from its first tick to its end, a few places wrong from some tick on, for a while or for ever."""
    draw = random.Random(f"{seed}/{number}")
    changes = [
        Change(
            draw.randrange(len(places())),
            draw.choice(HOWS),
            draw.randrange(1000),
            draw.randrange(MOST_BEGIN),
            draw.choice((1, 6, 15, 100, MOST_TICKS)),
        )
        for _ in range(draw.choice((1, 1, 2, 4)))
    ]
    try:
        ticks = run(Sequence("first tick", changes, [], {}), MOST_TICKS)
    except Exception as error:
        raise AssertionError(f"push {seed}/{number}: {error!r}") from error
    assert ticks < MOST_TICKS, f"push {seed}/{number} does not end: {changes}"
    return ticks


@pytest.fixture(scope="module")
def seed(pytestconfig) -> int:
    """The seed that `make test-all` prints."""
    return int(pytestconfig.getoption("--hypothesis-seed") or 0)


def test_every_number_of_a_tick_is_a_place_that_can_be_spoilt():
    names = [place.name for place in places()]
    assert {"host.asleep_ns", "ft.readings[-1].force[2]", "arm.joints.position[5]", "base.pose.yaw"} <= set(names)
    assert len(names) == len(set(names))


def test_over_drawn_sequences(seed):
    assert sequences(seed, 0, 60) > 60 * TICKS / 4


changes = st.builds(
    Change,
    st.integers(0, len(places()) - 1),
    st.sampled_from(HOWS),
    st.integers(0, 999),
    st.integers(0, TICKS - 1),
    st.integers(1, TICKS),
)
wrongs = st.builds(Wrong, st.integers(0, TICKS - 1), st.sampled_from(FRAME_WRONGS), st.integers(0, 999))
jumps = st.dictionaries(st.integers(0, TICKS - 1), st.integers(0, 10**7), max_size=2)


@pytest.mark.long
@pytest.mark.timeout(600)
@settings(deadline=None, max_examples=1000)
@given(st.builds(Sequence, st.sampled_from(STARTS), st.lists(changes, max_size=8), st.lists(wrongs, max_size=3), jumps))
def test_over_whatever_hypothesis_thinks_of(sequence):
    run(sequence)


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_over_very_many_drawn_sequences(seed):
    count = how_many(20_000, 100_000)
    firsts = range(0, count, CHUNK)
    ticks = sum(joblib.Parallel(n_jobs=-1)(joblib.delayed(sequences)(seed, first, CHUNK) for first in firsts))
    print(f"{count} sequences, {ticks} ticks, seed {seed}")


@pytest.mark.long
@pytest.mark.timeout(1200)
def test_whole_pushes_end_whatever_stays_wrong(seed):
    count = how_many(300, 3000)
    ticks = joblib.Parallel(n_jobs=-1)(joblib.delayed(whole_push)(seed, number) for number in range(count))
    print(f"{count} pushes, the longest {max(ticks)} ticks, seed {seed}")
