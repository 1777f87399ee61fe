"""Files by others: sound ones are read whatever the specification leaves to their writer, damaged ones are not."""

from __future__ import annotations

import random
import zlib
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from robot_io.errors import LogDamaged, UsageError
from robot_io.log.recovery import recover
from robot_io.log.ros_messages import STRING, String
from robot_io.mcap.log_file import McapLog
from robot_io.mcap.read import LogMessage, read_log, read_summary
from tests.robot_io.mcap import mcap_by_hand as by_hand

HELLO = by_hand.HELLO
OPENING = by_hand.header() + by_hand.schema() + by_hand.channel()
ONE = [LogMessage("/t", 5, HELLO, "std_msgs/msg/String")]


@pytest.fixture
def saved(tmp_path):
    """Return a function that saves bytes as a file."""

    def save(raw: bytes, name: str = "x.mcap") -> Path:
        path = tmp_path / name
        path.write_bytes(raw)
        return path

    return save


def by_mcap(path: Path, **options) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start("ros2", "another recorder")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        for topic in ("/a", "/b"):
            channel = writer.register_channel(topic, "cdr", schema)
            for n in range(50):
                writer.add_message(channel, n, HELLO, n)
        writer.add_attachment(0, 0, "notes.txt", "text/plain", b"")
        writer.add_attachment(0, 0, "photo.jpg", "image/jpeg", bytes(5000))
        writer.add_metadata("rig", {"who": "else"})
        writer.finish()
    return path


NO_SUMMARY = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}


@pytest.mark.parametrize("chunking", [{}, {"use_chunking": False}, {"chunk_size": 100}])
@pytest.mark.parametrize("crcs", [{}, {"enable_crcs": False}, {"enable_data_crcs": True}])
@pytest.mark.parametrize("compression", [{"compression": kind} for kind in CompressionType])
@pytest.mark.parametrize(
    "summary",
    [{}, {"use_statistics": False}, {"index_types": IndexType.ATTACHMENT}, {"use_summary_offsets": False}, NO_SUMMARY],
)
def test_whatever_the_mcap_package_s_writer_writes_is_read(tmp_path, chunking, crcs, compression, summary):
    path = by_mcap(tmp_path / "x.mcap", **chunking, **crcs, **compression, **summary)
    found = read_summary(path)
    assert [(c.topic, c.schema_name, c.messages) for c in found.channels] == [
        ("/a", "std_msgs/msg/String", 50),
        ("/b", "std_msgs/msg/String", 50),
    ]
    assert found.attachments == {"notes.txt": b"", "photo.jpg": bytes(5000)}
    assert found.metadata == {"rig": {"who": "else"}}
    assert [m.payload for m in read_log(path)] == [HELLO] * 100


def test_files_by_mcap_ros2_support_and_by_rosbags_are_read(tmp_path):
    path = tmp_path / "ros2.mcap"
    with path.open("wb") as file:
        writer = Ros2Writer(file)
        schema = writer.register_msgdef("std_msgs/msg/String", "string data")
        writer.write_message("/t", schema, {"data": "hello"}, 5, 5)
        writer.finish()
    (found,) = read_log(path)
    assert found == ONE[0]
    assert STRING.decode(found.payload) == String("hello")

    store = get_typestore(Stores.ROS2_HUMBLE)
    image = store.types["sensor_msgs/msg/CompressedImage"]
    stamp = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](1, 2), "camera")
    with BagWriter(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connection = bag.add_connection("/image", image.__msgtype__, typestore=store)
        payload = store.serialize_cdr(image(stamp, "jpeg", np.arange(200, dtype=np.uint8)), image.__msgtype__)
        bag.write(connection, 77, payload)
    (path,) = (tmp_path / "bag").glob("*.mcap")
    assert [(m.topic, m.log_time_ns, m.payload) for m in read_log(path)] == [("/image", 77, bytes(payload))]
    assert [channel.latched for channel in read_summary(path).channels] == [False]


@pytest.mark.parametrize(
    "raw",
    [
        by_hand.file(OPENING, by_hand.message()),
        by_hand.file(OPENING, by_hand.chunk(by_hand.message())),
        by_hand.file(OPENING, by_hand.chunk(by_hand.message(), crc=None)),
        by_hand.file(
            OPENING, by_hand.chunk(b""), by_hand.chunk(b"", "zstd"), by_hand.chunk(b"", "lz4"), by_hand.message()
        ),
        by_hand.file(OPENING, by_hand.chunk(by_hand.message(), "lz4", lz4.frame.compress(by_hand.message()))),
        by_hand.file(OPENING, by_hand.chunk(by_hand.message(), "zstd", zstandard.compress(by_hand.message()))),
        by_hand.file(OPENING, by_hand.message(), end=by_hand.data_end() + by_hand.schema() + by_hand.footer()),
    ],
    ids=["top level", "chunk", "its crc", "empty chunks", "lz4", "zstd", "summary start unsaid"],
)
def test_hand_made_files_are_read(saved, raw):
    assert list(read_log(saved(raw))) == ONE


def test_profiles_channel_numbers_and_topics_are_free(saved):
    """Numbers need not be in a row, several channels may have one topic, and a schema may be declared again."""
    raw = by_hand.file(
        by_hand.header(profile="ros1"),
        by_hand.schema(7),
        by_hand.channel(900, 7, "/t"),
        by_hand.channel(3, 0, "/t", "json"),
        by_hand.schema(7),
        by_hand.channel(900, 7, "/t"),
        by_hand.message(900),
        by_hand.message(3, b"{}"),
    )
    path = saved(raw)
    assert [m.payload for m in read_log(path)] == [HELLO, b"{}"]
    assert [(c.topic, c.schema_name, c.message_encoding, c.messages) for c in read_summary(path).channels] == [
        ("/t", "std_msgs/msg/String", "cdr", 1),
        ("/t", "", "json", 1),
    ]


@pytest.mark.parametrize("opcode", [0x10, 0x7F, 0x80, 0xFF])
def test_unknown_records_are_passed_over_wherever_they_stand(saved, opcode):
    odd = by_hand.record(opcode, b"whatever")
    content = odd + by_hand.message() + odd
    end = by_hand.data_end() + odd + by_hand.footer()
    assert list(read_log(saved(by_hand.file(OPENING, odd, by_hand.chunk(content), odd, end=end)))) == ONE


def test_fields_of_a_later_specification_are_passed_over(saved):
    more = b"\x01\x02\x03\x04\x05"
    raw = by_hand.file(
        by_hand.header(more=more),
        by_hand.schema(more=more),
        by_hand.channel(more=more),
        by_hand.attachment("a", b"abc", crc=None, more=more),
        by_hand.attachment("b", b"abcd", more=more),
        by_hand.metadata("m", more),
        by_hand.message(),
        end=by_hand.data_end(more=more) + by_hand.footer(more=more),
    )
    path = saved(raw)
    assert list(read_log(path)) == ONE
    assert read_summary(path).attachments == {"a": b"abc", "b": b"abcd"}


def test_a_checksum_that_is_there_is_checked(saved):
    for part in (by_hand.chunk(by_hand.message(), crc=1), by_hand.attachment("a", b"abc", crc=1)):
        with pytest.raises(LogDamaged, match="damaged: the checksum"):
            list(read_log(saved(by_hand.file(OPENING, part))))
    for end in (by_hand.data_end(1) + by_hand.footer(), by_hand.data_end() + by_hand.footer(crc=1)):
        with pytest.raises(LogDamaged, match="damaged: the checksum"):
            list(read_log(saved(by_hand.file(OPENING, end=end))))
    opened = by_hand.MAGIC + OPENING
    raw = opened + by_hand.data_end(zlib.crc32(opened)) + by_hand.footer() + by_hand.MAGIC
    assert list(read_log(saved(raw))) == []


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (by_hand.file(OPENING, by_hand.chunk(b"abc", "brotli")), "cannot be read here: .*'brotli'"),
        (by_hand.file(OPENING, by_hand.record(4, bytes(3))), "damaged"),
        (by_hand.file(OPENING, by_hand.record(0, b"")), "kind 0"),
        (by_hand.file(OPENING, by_hand.record(8, b"")), "kind 8"),
        (by_hand.file(OPENING, by_hand.chunk(by_hand.chunk(by_hand.message()))), "kind 6"),
        (by_hand.file(OPENING, by_hand.message(2)), "channel 2, which is not declared"),
        (by_hand.file(by_hand.header(), by_hand.channel()), "schema 1, which is not declared"),
        (by_hand.file(by_hand.header(), by_hand.schema(0)), "has no number"),
        (by_hand.file(OPENING, by_hand.channel(topic="/other")), "declared twice"),
        (by_hand.file(OPENING, by_hand.schema(data="bool x")), "declared twice"),
        (by_hand.file(OPENING, by_hand.chunk(by_hand.message(), "lz4", b"no lz4" * 9)), "cannot be unpacked"),
        (by_hand.file(OPENING, by_hand.chunk(by_hand.message(), "zstd", b"no zstd")), "damaged"),
        (by_hand.file(OPENING, by_hand.chunk(bytes(20), packed=bytes(19))), "another size"),
        (by_hand.file(OPENING, by_hand.message(), end=by_hand.data_end() + by_hand.footer(99)), "elsewhere"),
        (by_hand.file(OPENING, by_hand.record(3, by_hand.schema()[9:-3])), "damaged"),
        (by_hand.file(OPENING, by_hand.message(), end=b""), "truncated"),
        (by_hand.file(OPENING, by_hand.message(), end=by_hand.data_end()), "truncated"),
        (by_hand.file(OPENING, by_hand.record(9, bytes(24) + b"\xff" * 12)), "damaged: a record cannot be read"),
        (b"", "not an MCAP file, it is empty"),
        (b"\x89MCAP1\r\n", "not an MCAP file"),
    ],
)
def test_what_is_not_sound_is_refused_in_true_words(saved, raw, words):
    with pytest.raises(LogDamaged, match=words):
        list(read_log(saved(raw)))


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("said", [1000, 1 << 28, 1 << 62])
def test_a_chunk_that_would_grow_without_bound_is_refused(saved, compression, said):
    zeros = bytes(1 << 26)
    bomb = zstandard.compress(zeros) if compression == "zstd" else lz4.frame.compress(zeros)
    del zeros
    chunk = bytearray(by_hand.chunk(b"", compression, bomb))
    chunk[25:33] = said.to_bytes(8, "little")
    with pytest.raises(LogDamaged, match="another size" if said == 1000 else "at most 67108864 are read into memory"):
        list(read_log(saved(by_hand.file(OPENING, bytes(chunk)))))


def test_a_record_larger_than_memory_may_hold_is_refused_without_reading_it(tmp_path):
    path = tmp_path / "x.mcap"
    size = (64 << 20) + 1
    with path.open("wb") as file:
        file.write(by_hand.MAGIC + OPENING + b"\x09" + size.to_bytes(8, "little"))
        file.seek(size, 1)  # a hole
        file.write(by_hand.data_end() + by_hand.footer() + by_hand.MAGIC)
    with pytest.raises(LogDamaged, match=f"cannot be read here: a record has {size} bytes"):
        list(read_log(path))


def test_a_file_cut_off_anywhere_is_truncated_and_what_is_there_is_saved(tmp_path, saved):
    whole = by_mcap(tmp_path / "whole.mcap", use_chunking=False, enable_crcs=False).read_bytes()
    messages = list(read_log(tmp_path / "whole.mcap"))
    rng = random.Random(4)
    counts = []
    for at in sorted(rng.randrange(200, len(whole) - 1) for _ in range(40)):
        cut, out = saved(whole[:at]), tmp_path / f"{at}.mcap"
        with pytest.raises(LogDamaged, match="truncated"):
            list(read_log(cut))
        assert "truncated" in recover(cut, out).cause
        found = list(read_log(out))
        assert found == messages[: len(found)]
        assert read_summary(out).library == "another recorder"
        counts.append(len(found))
    assert counts == sorted(counts)
    assert counts[-1] == 100


def test_a_recovered_file_keeps_profile_and_channels_without_schema(tmp_path, saved):
    opening = by_hand.header(profile="other") + by_hand.channel(5, 0, "/j", "json")
    recover(saved(by_hand.MAGIC + opening + by_hand.message(5, b"{}")), tmp_path / "out.mcap")
    (channel,) = read_summary(tmp_path / "out.mcap").channels
    assert (channel.topic, channel.schema_name, channel.message_encoding, channel.messages) == ("/j", "", "json", 1)
    assert b"other" in (tmp_path / "out.mcap").read_bytes()[:40]


@pytest.mark.parametrize(
    "offered", [("durability: 1", True), ("durability: 2", False), ("durability: volatile", False)]
)
def test_a_topic_is_latched_when_its_quality_of_service_says_so(tmp_path, offered):
    words, latched = offered
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "rosbag2")
        writer.register_channel("/t", "cdr", 0, {"offered_qos_profiles": f"- history: 3\n  {words}\n  lifespan:\n"})
        writer.finish()
    assert [channel.latched for channel in read_summary(path).channels] == [latched]


def test_a_log_of_ours_is_held_to_what_our_writer_writes(tmp_path, saved):
    """Whoever says in the header that it is ours gets none of the freedom of others."""
    ours = by_hand.header(library="single-point-push") + by_hand.schema() + by_hand.channel()
    with pytest.raises(LogDamaged, match="damaged: a record of kind 3"):
        list(read_log(saved(by_hand.file(ours, by_hand.message()))))
    ours = by_hand.header(library="single-point-push")
    content = by_hand.schema() + by_hand.channel() + by_hand.message()
    for part, words in (
        (by_hand.chunk(content, "zstd", zstandard.compress(content)), "checksum of a chunk"),
        (by_hand.chunk(content, crc=None), "not ours"),
        (by_hand.attachment("config.toml", b"x"), "checksum of an attachment"),
        (by_hand.attachment("config.toml", b"x", crc=None), "checksum of its summary"),
        (by_hand.record(0x80, b""), "kind 128"),
    ):
        with pytest.raises(LogDamaged, match=f"damaged: .*{words}"):
            list(read_log(saved(by_hand.file(ours, part))))


def test_a_log_of_ours_without_its_checksums_is_damaged_wherever_one_is_taken_out(tmp_path, saved):
    path = tmp_path / "ours.mcap"
    log = McapLog(path, config_text="x = 1\n", metadata={})
    log.channel("/t", STRING)
    log.write("/t", 5, HELLO)
    log.finish({})
    raw = path.read_bytes()
    chunk = raw.index(b"\x04\x00\x00\x00zstd") - 4
    attachment = raw.index(b"x = 1\n") + 6
    for at in (chunk, attachment, len(raw) - 12):
        with pytest.raises(LogDamaged, match="damaged: the checksum"):
            list(read_log(saved(raw[:at] + bytes(4) + raw[at + 4 :])))


def test_a_pipe_is_refused_by_the_readers_that_read_twice(tmp_path):
    with pytest.raises(UsageError, match="only once"):
        list(read_log(Path("/dev/null")))


def test_a_file_without_checksums_spoilt_anywhere_is_read_or_refused(saved):
    """Nothing says that it is damaged then but its structure: no other error, nothing large, nothing endless."""
    content = OPENING[len(by_hand.header()) :] + by_hand.message()
    good = by_hand.file(
        by_hand.header(),
        by_hand.chunk(content, "lz4", lz4.frame.compress(content)),
        by_hand.chunk(content),
        by_hand.message(),
        by_hand.attachment("a", b"xyz"),
        by_hand.metadata("m"),
    )
    rng = random.Random(5)
    refused = 0
    for _ in range(1500):
        raw = bytearray(good)
        at = rng.randrange(len(raw))
        raw[at : at + rng.choice([0, 1, 4, 8])] = rng.choice([b"", b"\x00", b"\xff" * 4, b"\xff" * 8, rng.randbytes(1)])
        try:
            read_summary(saved(bytes(raw)))
        except LogDamaged:
            refused += 1
    assert 500 < refused < 1500
