"""What the verdict needs of all ticks of a push: offsets from first contact to rest, and the way without contact."""

import math

import pytest

from control.push_course import PushCourse
from robot_io.tick import Phase


def followed(*ticks):
    """Follow (phase, progress in m, lateral in m) tick by tick."""
    course = PushCourse()
    for tick in ticks:
        course.note(*tick)
    return course.figures()


def test_nothing_counts_before_contact_and_after_the_rest():
    found = followed(
        (Phase.APPROACH, 0.0, 0.9), (Phase.PUSH, 0.0, 0.04), (Phase.PUSH, 0.1, -0.12), (Phase.REST, 0.2, 0.05),
        (Phase.RETREAT, 0.19, 0.8), (Phase.CHECK, 0.15, 0.8), (Phase.DONE, 0.15, 0.8),
    )  # fmt: skip
    assert found == {"start_lateral_m": 0.04, "worst_lateral_m": -0.12, "lost_m": 0.0, "lost_times": 0}


def test_a_push_that_met_nothing_has_no_offsets():
    found = followed((Phase.APPROACH, 0.0, 0.1), (Phase.LOST_HOLD, 0.0, 0.1), (Phase.FAILED, 0.0, 0.1))
    assert found == {"start_lateral_m": None, "worst_lateral_m": None, "lost_m": 0.0, "lost_times": 0}


def test_each_loss_counts_once_and_from_end_to_end():
    lost = [(Phase.LOST, 0.10 + (0.0005 if k % 2 else 0.0), 0.0) for k in range(400)]  # a pose that trembles at rest
    found = followed(
        (Phase.PUSH, 0.0, 0.0), (Phase.PUSH, 0.1, 0.0), *lost, (Phase.LOST, 0.14, 0.0), (Phase.LOST_HOLD, 0.15, 0.0),
        (Phase.LOST, 0.15, 0.0), (Phase.PUSH, 0.16, 0.0), (Phase.LOST, 0.20, 0.0), (Phase.LOST, 0.22, 0.0),
    )  # fmt: skip
    assert found["lost_times"] == 2
    assert found["lost_m"] == pytest.approx(0.05 + 0.02, abs=1e-9)


def test_what_is_not_a_number_is_left_out():
    found = followed((Phase.PUSH, 0.0, 0.1), (Phase.PUSH, 0.1, math.nan), (Phase.LOST, math.nan, 0.1))
    assert found == {"start_lateral_m": 0.1, "worst_lateral_m": 0.1, "lost_m": 0.0, "lost_times": 0}
