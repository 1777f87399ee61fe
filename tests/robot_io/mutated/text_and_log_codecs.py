"""The bridge's JSON, the gate's frame, CDR and log files, spoilt: each is read or refused as it should be, and no more.

Each function prepares a codec and returns its turn: take in one spoilt frame. A turn raises whatever is wrong.
"""

from __future__ import annotations

import json
import math
import random
from pathlib import Path
from typing import Any

import zstandard
from mcap.records import Header

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.of_others import ReaderOfOthers
from robot_io.cdr.schema import shape_from_schema
from robot_io.errors import LogDamaged
from robot_io.ipc.gate_frame import GateFrame, pack_frame, unpack_frame
from robot_io.log.channels import BY_TOPIC
from robot_io.mcap.log_file import LIBRARY, McapLog
from robot_io.mcap.read import read_log
from robot_io.mcap.walk import walk
from robot_io.messages import BasePose, BodyTwist, Pose2D, SliderPose
from robot_io.ridgeback.feeds import FeedReader
from robot_io.ridgeback.intake import Intake
from robot_io.rig.topics import TopicsConfig
from tests.robot_io.mcap import mcap_by_hand as by_hand
from tests.robot_io.mutated.bytes_changed import TELLING, Turn, changed

GOLDEN_LOG = Path(__file__).parents[2] / "golden" / "logs" / "sim-format-4.mcap"


JSON_PIECES = (
    *(b"null", b"1e999", b"-1e999", b"NaN", b"-0", b"true", b'"x"', b"{}", b"[]", b"1" * 400, b"0.1e-400", b"1e308"),
    *(b"[" * 3000, b'{"a":' * 2000, b'"' + b"y" * 5000 + b'"', b"\\u0000", b"\\ud800", b'"', b",", b"}", b"\xff\xfe"),
)


def rosbridge(_folder: Path) -> Turn:
    """Return a turn of the bridge's JSON: a pose that may be used is finite, and nothing is kept of what is refused."""
    header = {"seq": 1, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "/world"}
    vector, unit = {"x": 0.1, "y": -0.2, "z": 0.3}, {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8}
    transform = {"header": header, "child_frame_id": "b", "transform": {"translation": vector, "rotation": unit}}
    twist = {"linear": vector, "angular": vector}
    pose = {"pose": {"position": vector, "orientation": unit}, "covariance": [0.0] * 36}
    odometry = {"header": header, "child_frame_id": "b", "pose": pose, "twist": {"twist": twist, "covariance": [0.0]}}
    status = {"header": header, "stop_engaged": False, "drivers_active": True, "measured_battery": 25.5}
    topics = TopicsConfig(slider_pose="/box")
    messages = {
        topics.base_pose: transform, topics.slider_pose: transform, topics.odometry: odometry,
        topics.status: status, topics.command: twist,
    }  # fmt: skip
    sound = [json.dumps({"op": "publish", "topic": name, "msg": msg}).encode() for name, msg in messages.items()]
    sound.append(b'{"op":"service_response","id":"1","values":{"type":"a/b"},"result":true}')
    intake = Intake(FeedReader(topics, "mocap", Pose2D(0.1, 0.0, 0.2)), lambda: 5)

    class _Link:
        behind = False
        frames: tuple[tuple[bytes, int], ...] = ()

        def receive(self) -> tuple[tuple[bytes, int], ...]:
            return self.frames

    link: Any = _Link()

    def turn(draw: random.Random) -> None:
        link.frames = ((changed(draw, sound[int(draw.random() * len(sound))], sound, JSON_PIECES), 3),)
        for sample in intake.take(link):
            value = sample.value
            if isinstance(value, BasePose | SliderPose) and not value.flaw:
                assert all(map(math.isfinite, (value.pose.x, value.pose.y, value.pose.yaw)))
                assert abs(value.pose.yaw) <= math.pi * (1 + 1e-12)
        assert len(intake.refused._kept) <= 16

    return turn


def gate_frame(_folder: Path) -> Turn:
    """Return a turn of the frame from control to gate: it is read only where it is whole."""
    frames = [GateFrame(n, 10 * n, 10**10 + n, 2, BodyTwist(0.1 * n, -0.01, 0.0)) for n in range(4)]
    sound = [pack_frame(frame) for frame in frames]

    def turn(draw: random.Random) -> None:
        data = changed(draw, sound[int(draw.random() * 4)], sound)
        frame = unpack_frame(data)
        assert frame is None or data in sound or pack_frame(frame) == data

    return turn


def _logged() -> dict[str, list[bytes]]:
    """Return a few payloads of every topic of a kept log."""
    found: dict[str, list[bytes]] = {}
    for topic, _, payload, _ in read_log(GOLDEN_LOG):
        kept = found.setdefault(topic, [])
        if len(kept) < 3:
            kept.append(payload)
    return found


def cdr(_folder: Path) -> Turn:
    """Return a turn of CDR payloads: damage, or a message that is written as the very same bytes."""
    kinds: list[tuple[CdrType[Any], list[bytes]]] = [
        (BY_TOPIC[topic].cdr_type, payloads) for topic, payloads in _logged().items() if len(payloads[0]) < 1500
    ]
    mixed = [payload for _, payloads in kinds for payload in payloads]

    def turn(draw: random.Random) -> None:
        kind, payloads = kinds[int(draw.random() * len(kinds))]
        data = changed(draw, payloads[int(draw.random() * len(payloads))], mixed)
        try:
            value = kind.decode(data)
        except LogDamaged:
            return
        again = kind.encode(value)
        assert again == data or kind.decode(again) is not None, data.hex()

    return turn


def cdr_of_others(_folder: Path) -> Turn:
    """Return a turn of CDR payloads by others, in either byte order: damage, or a message."""
    kinds = []
    for topic, payloads in _logged().items():
        kind = BY_TOPIC[topic].cdr_type
        if len(payloads[0]) < 1500:
            kinds.append((ReaderOfOthers(kind.name, shape_from_schema(kind.name, kind.schema_text)), payloads))
    mixed = [payload for _, payloads in kinds for payload in payloads]

    def turn(draw: random.Random) -> None:
        reader, payloads = kinds[int(draw.random() * len(kinds))]
        data = changed(draw, payloads[int(draw.random() * len(payloads))], mixed, (*TELLING, b"\x00\x00", b"\x00\x01"))
        try:
            reader.decode(data)
        except LogDamaged:
            return

    return turn


def _small_logs(folder: Path) -> list[bytes]:
    """Return one log of ours and several as others may write them."""
    path = folder / "ours.mcap"
    log = McapLog(path, config_text="x = 1\n", metadata={})
    log.channel("/t", BY_TOPIC["/robot_description"].cdr_type)
    log.write("/t", 5, by_hand.HELLO)
    log.finish({})
    opening = by_hand.schema() + by_hand.channel()
    content = opening + by_hand.message()
    plain = by_hand.file(by_hand.header(), opening, by_hand.message(), by_hand.metadata("m"))
    chunks = by_hand.file(by_hand.header(), by_hand.chunk(content), by_hand.attachment("a", b"xyz"))
    zstd = by_hand.file(by_hand.header(), by_hand.chunk(content, "zstd", zstandard.compress(content)))
    return [path.read_bytes(), plain, chunks, zstd]


def mcap(folder: Path) -> Turn:
    """Return a turn of whole log files: damage, or at most as many records as the file has bytes."""
    sound = _small_logs(folder)
    path = folder / "spoilt.mcap"
    path.write_bytes(sound[0])
    told = list(walk(path))[1:]

    def turn(draw: random.Random) -> None:
        data = changed(draw, sound[int(draw.random() * len(sound))], sound)
        path.write_bytes(data)
        try:
            items = list(walk(path))
        except LogDamaged:
            return
        assert len(items) <= len(data)
        # The checksum of all data may be left out: the parts have their own.
        if isinstance(items[0], Header) and items[0].library == LIBRARY:
            assert items[1:] == told, "a log of ours that was spoilt was believed"

    return turn
