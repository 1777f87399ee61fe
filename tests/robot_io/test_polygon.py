"""Polygons on the floor, against figures that can be seen on squared paper."""

from __future__ import annotations

import math

import pytest

from robot_io.messages import Pose2D
from robot_io.polygon import distance_inside, flaw, longest_line_m, rectangle, room

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
NOTCHED = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0))
"""A square with a wedge cut into its upper side, down to (2, 1)."""


@pytest.mark.parametrize(
    ("point", "wanted"),
    [
        ((2.0, 2.0), 2.0),
        ((1.0, 2.0), 1.0),
        ((3.5, 3.0), 0.5),
        ((5.0, 2.0), -1.0),
        ((-3.0, -4.0), -5.0),
        ((7.0, 8.0), -5.0),
        ((0.0, 2.0), 0.0),
    ],
)
@pytest.mark.parametrize("way_round", [1, -1])
def test_the_distance_to_the_edge(point, wanted, way_round):
    assert distance_inside(SQUARE[::way_round], *point) == pytest.approx(wanted)


def test_a_wedge_belongs_to_the_outside():
    assert distance_inside(NOTCHED, 2.0, 2.0) < 0.0
    assert distance_inside(NOTCHED, 2.0, 0.5) == pytest.approx(0.5)


def test_a_rectangle_stands_where_its_pose_says():
    corners = rectangle(Pose2D(1.0, 2.0, math.pi / 2), (-0.5, 0.5), (-0.25, 0.25))
    found = [(round(x, 12), round(y, 12)) for x, y in corners]
    assert found == [(1.25, 1.5), (1.25, 2.5), (0.75, 2.5), (0.75, 1.5)]


@pytest.mark.parametrize(
    ("x", "y", "wanted"),
    [
        ((1.0, 2.0), (1.0, 3.0), 1.0),
        ((0.25, 3.0), (1.0, 3.0), 0.25),
        ((1.0, 4.5), (1.0, 3.0), -0.5),
        ((-1.0, 5.0), (1.0, 2.0), -1.0),
    ],
)
def test_the_room_of_a_rectangle(x, y, wanted):
    assert room(SQUARE, rectangle(Pose2D(), x, y)) == pytest.approx(wanted)


def test_a_corner_that_points_inwards_may_not_reach_between_those_of_the_rectangle():
    """All four corners of the second are inside; the tip of the wedge is 0.5 m inside it."""
    assert room(NOTCHED, rectangle(Pose2D(), (0.5, 3.5), (0.25, 0.75))) == pytest.approx(0.25)
    assert room(NOTCHED, rectangle(Pose2D(), (1.0, 3.0), (0.5, 1.5))) == pytest.approx(-0.5)


def test_a_wall_that_goes_right_through_leaves_no_room():
    """Thin, and longer than the rectangle: none of its corners is inside, and none of the rectangle's outside."""
    walled = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.01, 4.0), (2.0, 0.1), (1.99, 4.0), (0.0, 4.0))
    assert room(walled, rectangle(Pose2D(), (1.0, 3.0), (1.0, 2.0))) < 0.0
    assert room(walled, rectangle(Pose2D(), (0.5, 1.5), (1.0, 2.0))) > 0.3


@pytest.mark.parametrize(
    ("polygon", "word"),
    [
        (SQUARE, ""),
        (NOTCHED, ""),
        (SQUARE[::-1], ""),
        (SQUARE[:3], ""),
        (SQUARE[:2], "three corners"),
        ((), "three corners"),
        (((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)), "no area"),
        (((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, -1.0)), "crosses"),
    ],
)
def test_what_is_no_floor_is_said(polygon, word):
    found = flaw(polygon)
    assert word in found
    assert bool(found) == bool(word)


def test_the_longest_line():
    assert longest_line_m(((0.0, 0.0), (3.0, 0.0), (3.0, 4.0))) == 5.0
