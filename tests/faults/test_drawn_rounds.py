"""Kills and freezes drawn from a seed, in every phase of a run; 200 of them with PUSH_TEST_FULL=1."""

from __future__ import annotations

import pytest

from tests.faults.drawn_rounds import Found, check_bounds, drawn_blow, in_words, play, worst
from tests.host_watch import UNMEASURED, HostStalled
from tests.how_many import how_many

ROUNDS = how_many(12, 200)


@pytest.mark.long
@pytest.mark.timeout(120 * ROUNDS)
def test_whoever_is_killed_or_frozen_whenever_the_base_stands_and_nothing_stays(state, tmp_path, host, pytestconfig):
    seed = int(pytestconfig.getoption("--hypothesis-seed") or 0)
    found: list[Found] = []
    spoilt = 0
    for number in range(ROUNDS):
        blow = drawn_blow(seed, number)
        try:
            found.append(play(state, tmp_path / str(number), blow, host))
        except HostStalled as stalled:
            spoilt += 1
            print(f"round {seed}/{number}, {blow}: {stalled}")
            continue
        except AssertionError as error:
            raise AssertionError(f"round {seed}/{number}, {blow}: {error}") from error
        print(f"round {seed}/{number}: {in_words(found[-1])}")
        check_bounds(found[-1])
    print(worst(found))
    if spoilt:
        UNMEASURED.add(f"{spoilt} of {ROUNDS} rounds: the host ended the run before the blow")
