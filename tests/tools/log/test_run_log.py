"""The log as level `sim` writes it inline: the same bytes each time, the chain, and whose pose the slider's is."""

from __future__ import annotations

import zlib
from pathlib import Path

import pytest

from robot_io.log.chain import TickChain
from robot_io.log.channels import Kind
from robot_io.log.ros_messages import POSE_STAMPED, TF_MESSAGE, Header, PoseStamped, planar_pose, ros_time
from robot_io.log.world_messages import STATE_CDR, WorldState
from robot_io.mcap.read import read_log
from robot_io.messages import BodyTwist, Pose2D
from robot_io.rig.config import load_rig, rig_to_toml
from tools.log.run_log import RunLog

STATE = STATE_CDR.encode(
    WorldState(0, Pose2D(), BodyTwist(), Pose2D(1.0, 2.0, 0.5), 15.0, 0.0, 0.9, 2.0, 1),
)
SEEN = POSE_STAMPED.encode(PoseStamped(Header(ros_time(0), "world"), planar_pose(7.0, 8.0, 0.0)))


def write(path: Path, *overrides: str, rig: str = "emulated") -> dict[str, list[bytes]]:
    config = rig_to_toml(load_rig(rig, overrides))
    log = RunLog(path, config_text=config, metadata={"seed": "1"}, wall_offset_ns=10**18)
    for n in range(20):
        log.record(Kind.WORLD_STATE, n * 10_000_000, STATE)
        log.record(Kind.SLIDER_POSE, n * 10_000_000 + 5, SEEN)
    log.finish({})
    payloads: dict[str, list[bytes]] = {}
    for message in read_log(path):
        payloads.setdefault(message.topic, []).append(message.payload)
    return payloads


def test_the_same_records_give_the_same_bytes(tmp_path):
    write(tmp_path / "a.mcap")
    write(tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize("rig", ["emulated", "sim"])
@pytest.mark.parametrize(("topic", "x"), [("/vicon/slider/slider", 7.0), ("", 1.0)])
def test_the_slider_is_where_it_was_seen_and_without_cameras_where_the_world_says(tmp_path, topic, x, rig):
    payloads = write(tmp_path / "run.mcap", f'base.topics.slider_pose="{topic}"', rig=rig)
    transforms = [TF_MESSAGE.decode(payload).transforms[0] for payload in payloads["/tf"]]
    assert len(transforms) == 5, "one in 40 ms of the 20 in 200 ms"
    assert {(t.child_frame_id, t.transform.translation.x) for t in transforms} == {("slider", x)}
    poses = [POSE_STAMPED.decode(payload).pose.position.x for payload in payloads["/slider/pose"]]
    assert (poses.count(7.0), poses.count(1.0)) == ((20, 0) if topic else (20, 5))


def test_the_chain_holds_and_a_change_a_gap_and_a_swap_break_it():
    plain = [bytes((0, 1, 0, 0)) + bytes(4) + bytes([n] * 9) for n in range(5)]
    writer = TickChain()
    linked = [writer.link(payload) for payload in plain]
    assert linked[0] == plain[0]
    assert linked[3][4:8] == zlib.crc32(linked[2]).to_bytes(4, "little")
    assert writer.crc32 == zlib.crc32(linked[4])

    def verdicts(payloads: list[bytes]) -> list[bool]:
        reader = TickChain()
        return [reader.holds(payload) for payload in payloads]

    assert verdicts(linked) == [True] * 5
    changed = [*linked[:2], linked[2][:-1] + b"\xff", *linked[3:]]
    assert verdicts(changed) == [True, True, True, False, True]
    assert verdicts(linked[:2] + linked[3:]) == [True, True, False, True]
    assert verdicts([linked[0], linked[2], linked[1], *linked[3:]]) == [True, False, False, False, True]
    assert verdicts([b"\x00\x01"]) == [False]
