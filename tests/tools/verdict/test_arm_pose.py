"""An arm that is not at the rig's held pose: the joint, the figure, and whole turns, which cannot be seen."""

import math

import pytest
from msgspec.structs import replace

from robot_io.rig.config import load_rig
from tools.verdict.arm_pose import arm_pose_notes

HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.3100)
RIG = replace(load_rig("emulated"), arm=replace(load_rig("emulated").arm, held_pose_rad=HELD))


def notes(joints, faults=("R04",)):
    return arm_pose_notes(RIG, {"faults": list(faults), "joints_rad": list(joints)})


def moved(joint, by):
    return [q + (by if number == joint else 0.0) for number, q in enumerate(HELD, 1)]


def test_a_joint_that_is_off_is_named_with_its_figures():
    [note] = notes(moved(2, 0.3))
    assert note.startswith("arm joint 2 (shoulder) is at 0.1255 rad, the rig's held pose has -0.1745 rad: +0.3000 rad")
    assert "0.05 rad are allowed" in note


@pytest.mark.parametrize(("turns", "words"), [(1, "one whole turn"), (-1, "one whole turn"), (2, "2 whole turns")])
def test_whole_turns_are_counted(turns, words):
    [note] = notes(moved(6, turns * math.tau + 0.01))
    assert "joint 6 (wrist 3)" in note
    assert words in note


def test_a_turn_and_more_is_no_whole_turn():
    [note] = notes(moved(6, math.tau + 0.2))
    assert "whole turn" not in note
    assert "+6.4832 rad" in note


def test_joints_at_their_place_and_other_ends_give_no_word():
    assert notes(HELD) == []
    assert notes(moved(2, 0.3), faults=("F64",)) == []
    assert notes([None, *HELD[1:]]) == []
