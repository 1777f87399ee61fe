"""What a 3-D viewer is told of a rig: frames that form one tree, shapes of the rig, rotations that rotate."""

from __future__ import annotations

import itertools
import math
import random
from xml.etree import ElementTree

import pytest

from robot_io.log.ros_messages import PATH, STRING, TF_MESSAGE
from robot_io.rig.config import load_rig
from tools.log.scene_topics import _quaternion, scene_messages, urdf


def rotate(q, v):
    """v turned by the quaternion q, from q v q* written out."""
    x, y, z, w = q.x, q.y, q.z, q.w
    tx, ty, tz = (2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0]))
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def rotations():
    """All 24 right-angled ones and some random ones, as rows."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            rows = tuple(tuple(signs[r] if c == order[r] else 0.0 for c in range(3)) for r in range(3))
            if determinant(rows) > 0:
                yield rows
    dice = random.Random(1)
    for _ in range(20):
        a, b, c = (dice.uniform(-math.pi, math.pi) for _ in range(3))
        yield (
            (math.cos(a) * math.cos(b), math.cos(a) * math.sin(b) * math.sin(c) - math.sin(a) * math.cos(c),
             math.cos(a) * math.sin(b) * math.cos(c) + math.sin(a) * math.sin(c)),
            (math.sin(a) * math.cos(b), math.sin(a) * math.sin(b) * math.sin(c) + math.cos(a) * math.cos(c),
             math.sin(a) * math.sin(b) * math.cos(c) - math.cos(a) * math.sin(c)),
            (-math.sin(b), math.cos(b) * math.sin(c), math.cos(b) * math.cos(c)),
        )  # fmt: skip


def determinant(m):
    (a, b, c), (d, e, f), (g, h, i) = m
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def test_the_quaternion_turns_vectors_as_the_matrix_does():
    seen = 0
    for rows in rotations():
        q = _quaternion(rows)
        for v in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.3, -0.4, 2.0)):
            assert rotate(q, v) == pytest.approx([sum(r[i] * v[i] for i in range(3)) for r in rows], abs=1e-12)
        seen += 1
    assert seen == 44


@pytest.mark.parametrize("name", ["sim", "emulated", "thing"])
def test_the_robot_description_is_one_tree_with_the_frames_of_tf(name):
    rig = load_rig(name)
    root = ElementTree.fromstring(urdf(rig))
    links = {link.get("name") for link in root.iter("link")}
    children = {joint.find("child").get("link"): joint.find("parent").get("link") for joint in root.iter("joint")}
    assert links - set(children) == {"world"}
    assert set(children) | {"world"} == links
    assert ("slider" in links) == (rig.base.level != "hardware")
    ball = next(joint for joint in root.iter("joint") if joint.get("name") == "pusher_joint")
    assert tuple(map(float, ball.find("origin").get("xyz").split())) == rig.frames.contact_in_base_m


def test_a_barrel_is_drawn_as_a_cylinder():
    rig = load_rig("emulated", ['world.slider.shape="circle"', "world.slider.radius_m=0.3"])
    (cylinder,) = ElementTree.fromstring(urdf(rig)).iter("cylinder")
    assert cylinder.get("radius") == "0.3"


def test_path_and_fixed_frames_are_those_of_the_rig():
    rig = load_rig("emulated", ["path.direction_deg=90", "path.origin_m=[1.0, 2.0]", "control.distance_m=3.0"])
    by_topic = {m.topic: m for m in scene_messages(rig, 7_000_000_005)}
    path = PATH.decode(by_topic["/path"].payload)
    first, last = path.poses[0].pose, path.poses[-1].pose
    assert (first.position.x, first.position.y) == (1.0, 2.0)
    assert last.position.y == pytest.approx(2.0 + 3.0 + rig.path.expected_contact_m)
    assert last.orientation.z == pytest.approx(math.sin(math.pi / 4))
    assert path.header.stamp.sec == 7
    fixed = TF_MESSAGE.decode(by_topic["/tf_static"].payload)
    assert [t.child_frame_id for t in fixed.transforms] == ["ft_sensor", "contact_ball"]
    assert STRING.decode(by_topic["/robot_description"].payload).data == urdf(rig)
