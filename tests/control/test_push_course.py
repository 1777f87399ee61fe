"""What the verdict needs of all ticks of a push: the ball's offsets from first contact to rest."""

import math

from control.notes.push_course import PushCourse
from robot_io.tick import Phase


def followed(*ticks):
    """Follow (phase, lateral in m) tick by tick."""
    course = PushCourse()
    for tick in ticks:
        course.note(*tick)
    return course.figures()


def test_nothing_counts_before_contact_and_after_the_rest():
    found = followed(
        (Phase.APPROACH, 0.9), (Phase.PUSH, 0.04), (Phase.PUSH, -0.12), (Phase.LOST, 0.1), (Phase.REST, 0.05),
        (Phase.RETREAT, 0.8), (Phase.CHECK, 0.8), (Phase.DONE, 0.8),
    )  # fmt: skip
    assert found == {"start_lateral_m": 0.04, "worst_lateral_m": -0.12, "worst_force_N": None}


def test_without_contact_and_while_coming_to_rest_the_push_still_counts():
    assert followed((Phase.PUSH, 0.0), (Phase.LOST, 0.2))["worst_lateral_m"] == 0.2
    assert followed((Phase.PUSH, 0.0), (Phase.LOST_HOLD, -0.3))["worst_lateral_m"] == -0.3
    assert followed((Phase.PUSH, 0.0), (Phase.REST, 0.4))["worst_lateral_m"] == 0.4


def test_a_push_that_met_nothing_has_no_offsets():
    found = followed((Phase.APPROACH, 0.1), (Phase.LOST_HOLD, 0.1), (Phase.FAILED, 0.1))
    assert found == {"start_lateral_m": None, "worst_lateral_m": None, "worst_force_N": None}


def test_what_is_not_a_number_is_left_out():
    found = followed((Phase.PUSH, math.inf), (Phase.PUSH, 0.1), (Phase.PUSH, math.nan), (Phase.LOST, -math.inf))
    assert (found["start_lateral_m"], found["worst_lateral_m"]) == (0.1, 0.1)


def test_of_two_that_are_as_large_the_first_is_the_worst():
    assert followed((Phase.PUSH, 0.1), (Phase.PUSH, -0.1))["worst_lateral_m"] == 0.1


def test_the_worst_force_is_the_largest_from_first_contact_to_rest():
    found = followed(
        (Phase.APPROACH, 0.0, 40.0), (Phase.PUSH, 0.0, 12.0), (Phase.PUSH, 0.0, math.nan), (Phase.LOST, 0.0, 25.5),
        (Phase.REST, 0.0, 9.0), (Phase.RETREAT, 0.0, 60.0),
    )  # fmt: skip
    assert found["worst_force_N"] == 25.5
