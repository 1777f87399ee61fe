"""`force-integral` against the paper's law, over the same seeds: what docs/laws.md promises of it."""

from __future__ import annotations

import statistics

import pytest

from tests.control.law_study import Course, push
from tests.how_many import how_many

SEEDS = how_many(12, 200)


def median(courses: list[Course], what: str) -> float:
    return statistics.median(abs(getattr(course, what)) for course in courses)


def percentile_95(courses: list[Course]) -> float:
    return statistics.quantiles((course.worst_m for course in courses), n=20)[-1]


@pytest.mark.long
@pytest.mark.timeout(9 * 3600)
def test_the_integral_takes_the_offset_away_and_costs_nothing():
    paper, integral = ([push(law, seed) for seed in range(SEEDS)] for law in ("force", "force-integral"))
    assert median(integral, "at_6_m") <= 0.5 * median(paper, "at_6_m")
    # Of few pushes the noise, which no law can take away, leaves more of so small a number.
    assert median(integral, "end_m") <= how_many(2, 1) * 0.1 * median(paper, "end_m")
    assert percentile_95(integral) <= percentile_95(paper)
    for one, other in zip(integral, paper, strict=True):
        assert one.exit_code <= other.exit_code
        assert (one.lost, len(one.faults)) <= (other.lost, len(other.faults))


def test_a_short_push_with_the_errors_ends_well():
    course = push("force-integral", 0, 0.3)
    assert course.exit_code == 0
    assert course.faults == ()
