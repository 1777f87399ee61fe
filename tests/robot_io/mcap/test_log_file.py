"""Logs as files: other readers open them, damage is found wherever it is, a killed writer loses little."""

from __future__ import annotations

import random
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability

from robot_io.errors import LogDamaged, UsageError
from robot_io.log import ros_messages as ros
from robot_io.log.recovery import recover
from robot_io.mcap.log_file import McapLog
from robot_io.mcap.read import read_log, read_summary
from robot_io.mcap.walk import walk

CONFIG = 'kind = "sim"\n'
START_NS = 1_600_000_000_000_000_000


def wrench(n: int) -> ros.WrenchStamped:
    header = ros.Header(ros.ros_time(START_NS + n * 10_000_000), "world")
    return ros.WrenchStamped(header, ros.Wrench(ros.Vector3(n * 0.5, -n, 0.0), ros.Vector3(0.0, 0.0, n / 3)))


def write_some(path: Path, count: int = 300, *, flush_every: int = 25, finish: bool = True) -> McapLog:
    log = McapLog(path, config_text=CONFIG, metadata={"seed": "3", "program": "0.1.0"})
    log.channel("/robot_description", ros.STRING, latched=True)
    log.channel("/ft/wrench", ros.WRENCH_STAMPED)
    log.channel("/arm/joint_states", ros.JOINT_STATE)
    log.flush()
    log.write("/robot_description", START_NS, ros.STRING.encode(ros.String("<robot/>")))
    for n in range(count):
        now_ns = START_NS + n * 10_000_000
        log.write("/ft/wrench", now_ns, ros.WRENCH_STAMPED.encode(wrench(n)))
        joints = ros.JointState(wrench(n).header, ("a", "b"), (n * 0.25, 1.0), (), ())
        log.write("/arm/joint_states", now_ns + 1000, ros.JOINT_STATE.encode(joints))
        if n % flush_every == 0:
            log.flush()
    if finish:
        log.finish({"messages": str(log.messages)})
    else:
        log.flush()
        log.abandon()
    return log


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    write_some(path)
    return path


def test_our_reader_gives_back_what_was_written(whole):
    messages = list(read_log(whole))
    assert len(messages) == 601
    wrenches = [m for m in messages if m.topic == "/ft/wrench"]
    assert [ros.WRENCH_STAMPED.decode(m.payload) for m in wrenches] == [wrench(n) for n in range(300)]
    assert wrenches[7].log_time_ns == START_NS + 70_000_000
    assert wrenches[7].schema_name == "geometry_msgs/msg/WrenchStamped"


def test_summary_holds_config_facts_and_channel_table(whole):
    summary = read_summary(whole)
    assert summary.attachments == {"config.toml": CONFIG.encode()}
    assert summary.metadata == {"run": {"seed": "3", "program": "0.1.0"}, "run_end": {"messages": "601"}}
    assert [(c.topic, c.messages, c.latched) for c in summary.channels] == [
        ("/robot_description", 1, True),
        ("/ft/wrench", 300, False),
        ("/arm/joint_states", 300, False),
    ]
    assert (summary.start_ns, summary.end_ns) == (START_NS, START_NS + 2_990_000_000 + 1000)
    assert summary.library == "single-point-push"


def test_rosbags_and_mcap_ros2_read_equal_counts_and_values(whole):
    ours = [(m.topic, m.log_time_ns, m.payload) for m in read_log(whole)]
    with AnyReader([whole]) as bag:
        foreign = [(c.topic, time_ns, bytes(raw)) for c, time_ns, raw in bag.messages()]
        assert sorted(foreign) == sorted(ours)
        values = [bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages() if c.topic == "/ft/wrench"]
        assert [v.wrench.force.x for v in values] == [n * 0.5 for n in range(300)]
        assert [v.wrench.torque.z for v in values] == [n / 3 for n in range(300)]
        (latched,) = [c for c in bag.connections if c.topic == "/robot_description"]
        assert latched.ext.offered_qos_profiles[0].durability == QosDurability.TRANSIENT_LOCAL
    with whole.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        decoded = [d.decoded_message for d in reader.iter_decoded_messages(topics=["/arm/joint_states"])]
        assert [d.position[0] for d in decoded] == [n * 0.25 for n in range(300)]
        assert reader.get_summary().statistics.message_count == 601


def test_the_same_calls_give_the_same_bytes(whole, tmp_path):
    write_some(tmp_path / "other_name.mcap")
    assert (tmp_path / "other_name.mcap").read_bytes() == whole.read_bytes()


def test_an_existing_file_is_never_overwritten(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(UsageError, match="already"):
        McapLog(path, config_text="", metadata={})
    assert path.read_bytes() == b"precious"


def test_finish_twice_is_harmless(tmp_path):
    log = write_some(tmp_path / "run.mcap", 3)
    size = log.path.stat().st_size
    log.finish({})
    assert log.path.stat().st_size == size


@pytest.mark.parametrize("step", [7, pytest.param(1, marks=pytest.mark.long)])
def test_any_flipped_bit_anywhere_is_damage(whole, tmp_path, step):
    """The CRCs cover the whole file: header, chunks, indexes, attachment, summary, footer and closing mark."""
    path = tmp_path / "run.mcap"
    write_some(path, 4, flush_every=2)
    good = path.read_bytes()
    rng = random.Random(1)
    path = tmp_path / "flipped.mcap"
    for at in range(0, len(good), step):
        damaged = bytearray(good)
        damaged[at] ^= 1 << rng.randrange(8)
        path.write_bytes(damaged)
        with pytest.raises(LogDamaged):
            read_summary(path)


def test_zeroed_checksums_do_not_switch_the_check_off(tmp_path):
    path = tmp_path / "run.mcap"
    write_some(path, 4)
    raw = bytearray(path.read_bytes())
    raw[-12:-8] = bytes(4)
    path.write_bytes(raw)
    with pytest.raises(LogDamaged, match="summary"):
        read_summary(path)


def test_truncated_anywhere_says_so_and_recovers_to_a_prefix(whole, tmp_path):
    good = whole.read_bytes()
    ours = list(read_log(whole))
    rng = random.Random(2)
    source, target = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    saved = []
    for at in [0, 7, 8, 40, len(good) - 1, len(good) - 8, *(rng.randrange(8, len(good)) for _ in range(60))]:
        source.write_bytes(good[:at])
        with pytest.raises(LogDamaged, match=r"truncated|not an MCAP") as caught:
            list(read_log(source))
        assert "push log recover" in caught.value.do or "push run" in caught.value.do
        target.unlink(missing_ok=True)
        try:
            recovered = recover(source, target)
        except LogDamaged:
            assert not target.exists()
            assert at < 2000
            continue
        assert "truncated" in recovered.cause
        summary = read_summary(target)
        messages = list(read_log(target))
        assert messages == ours[: len(messages)]
        assert summary.attachments == {"config.toml": CONFIG.encode()}
        assert summary.metadata["run"]["seed"] == "3"
        assert summary.metadata["recovered"]["messages"] == str(len(messages)) == str(recovered.messages)
        saved.append((at, len(messages)))
    assert len(saved) > 40
    counts = [count for _, count in sorted(saved)]
    assert counts == sorted(counts)
    assert max(count for _, count in saved) == 601
    with AnyReader([target]) as bag:
        assert bag.message_count == recovered.messages


def test_recover_refuses_a_whole_log_and_an_existing_target(whole, tmp_path):
    with pytest.raises(UsageError, match="nothing to recover"):
        recover(whole, tmp_path / "out.mcap")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "out.mcap").write_bytes(b"precious")
    with pytest.raises(UsageError, match="already"):
        recover(whole, tmp_path / "out.mcap")
    assert (tmp_path / "out.mcap").read_bytes() == b"precious"


def test_a_bad_chunk_is_not_believed_and_what_is_before_it_can_be_saved(whole, tmp_path):
    raw = bytearray(whole.read_bytes())
    third_chunk = raw.index(b"zstd", raw.index(b"zstd", raw.index(b"zstd") + 1) + 1)
    raw[third_chunk + 100] ^= 0x10
    path = tmp_path / "bad.mcap"
    path.write_bytes(raw)
    with pytest.raises(LogDamaged, match="damaged"):
        list(read_log(path))
    recovered = recover(path, tmp_path / "out.mcap")
    assert recovered.messages == 1 + 2 * 26
    assert list(read_log(tmp_path / "out.mcap")) == list(read_log(whole))[: recovered.messages]


@pytest.mark.parametrize(("channels", "refused"), [(1000, False), (1001, True)])
def test_a_log_of_more_than_a_thousand_topics_is_refused(tmp_path, channels, refused):
    """Each costs memory while nothing has been read yet; ours have about thirty."""
    with (tmp_path / "x.mcap").open("wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start("ros2", "other")
        schema_id = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        for n in range(channels):
            channel_id = writer.register_channel(f"/topic{n}", "cdr", schema_id)
        writer.add_message(channel_id, 1, b"\0\1\0\0\2\0\0\0x\0", 1)
        writer.finish()
    if refused:
        with pytest.raises(LogDamaged, match="more than 1000 channels"):
            list(read_log(tmp_path / "x.mcap"))
    else:
        assert [message.topic for message in read_log(tmp_path / "x.mcap")] == ["/topic999"]


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89MCAP0\r\n" * 2, bytes(100)])
def test_files_that_are_no_logs_are_refused(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogDamaged) as caught:
        list(read_log(path))
    assert caught.value.do
    with pytest.raises(LogDamaged):
        recover(path, tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


def test_missing_files_are_a_usage_error(tmp_path):
    with pytest.raises(UsageError, match="cannot be read"):
        list(read_log(tmp_path / "none.mcap"))


def test_a_chunk_that_would_grow_without_bound_is_refused(tmp_path):
    """4 GiB of zeros pack into little; neither the claimed size nor the frame's own is believed."""
    packer = zstandard.ZstdCompressor().compressobj()
    bomb = b"".join(packer.compress(bytes(1 << 24)) for _ in range(16)) + packer.flush()
    for claimed in (1000, 1 << 28, 1 << 62):
        body = (
            struct.pack("<QQQI", 0, 0, claimed, 1)
            + struct.pack("<I", 4)
            + b"zstd"
            + struct.pack("<Q", len(bomb))
            + bomb
        )
        header = struct.pack("<I", 4) + b"ros2" + struct.pack("<I", 0)
        raw = b"\x89MCAP0\r\n" + record(1, header) + record(6, body)
        raw += record(15, struct.pack("<I", zlib.crc32(raw))) + b"\x89MCAP0\r\n"
        path = tmp_path / f"{claimed}.mcap"
        path.write_bytes(raw)
        with pytest.raises(LogDamaged):
            list(read_log(path))


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def test_a_huge_record_length_is_refused(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + struct.pack("<BQ", 1, 2**62) + b"\x89MCAP0\r\n")
    with pytest.raises(LogDamaged):
        list(read_log(path))


def test_a_message_shorter_than_its_head_is_refused(tmp_path):
    """In a chunk whose checksums are right, with another message behind it that would lend it bytes."""
    schema = struct.pack("<HI", 1, 1) + b"s" + struct.pack("<I", 7) + b"ros2msg" + struct.pack("<I", 0)
    channel = struct.pack("<HHI", 1, 1, 2) + b"/t" + struct.pack("<I", 3) + b"cdr" + struct.pack("<I", 0)
    for length in range(22):
        data = record(3, schema) + record(4, channel) + record(5, bytes([1, 0] * 11)[:length]) + record(5, bytes(22))
        body = struct.pack("<QQQII", 0, 0, len(data), zlib.crc32(data), 0) + struct.pack("<Q", len(data)) + data
        raw = b"\x89MCAP0\r\n" + record(1, struct.pack("<I", 4) + b"ros2" + struct.pack("<I", 0)) + record(6, body)
        path = tmp_path / f"{length}.mcap"
        path.write_bytes(raw + record(15, struct.pack("<I", zlib.crc32(raw))) + b"\x89MCAP0\r\n")
        with pytest.raises(LogDamaged, match="shorter than its header"):
            list(walk(path))


def test_a_log_still_being_written_is_read_as_far_as_it_goes(whole):
    """`grown` is asked before every read, never for more than a record, and for the end last."""
    size, asked = whole.stat().st_size, []
    assert list(walk(whole, grown=lambda wanted: asked.append(wanted) or size)) == list(walk(whole))
    assert asked[-1] > size, "to the end"
    assert asked[:-1] == sorted(asked[:-1])
    assert max(asked[:-1]) < size


WRITER = """
import sys, time
from pathlib import Path
from robot_io.log import ros_messages as ros
from robot_io.mcap.log_file import McapLog
log = McapLog(Path(sys.argv[1]), config_text="", metadata={})
log.channel("/chatter", ros.STRING)
for n in range(10**6):
    log.write("/chatter", 1 + n, ros.STRING.encode(ros.String(str(n))))
    if n % 100 == 99:
        log.flush()
        print(n + 1, flush=True)
        time.sleep(0.002)
"""


def test_a_killed_writer_loses_only_what_was_not_flushed(tmp_path):
    path = tmp_path / "run.mcap"
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True)
    try:
        for _ in range(30):
            assert writer.stdout.readline()
    finally:
        writer.kill()
        flushed = [int(line) for line in writer.stdout.read().splitlines()]
        writer.stdout.close()
        writer.wait()
    with pytest.raises(LogDamaged, match="truncated"):
        list(read_log(path))
    recovered = recover(path, tmp_path / "out.mcap")
    messages = list(read_log(tmp_path / "out.mcap"))
    assert [ros.STRING.decode(m.payload).data for m in messages] == [str(n) for n in range(recovered.messages)]
    assert recovered.messages >= max(flushed, default=3000) >= 3000


def test_a_full_disk_while_recovering_is_a_sentence_and_leaves_nothing(tmp_path):
    write_some(tmp_path / "cut.mcap", finish=False)
    code = (
        "import resource, sys, pathlib\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))\n"
        "from robot_io.log.recovery import recover\n"
        "from robot_io.errors import EnvironmentFault\n"
        "try: recover(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))\n"
        "except EnvironmentFault as fault: print(fault)\n"
    )
    words = [sys.executable, "-c", code, str(tmp_path / "cut.mcap"), str(tmp_path / "out.mcap")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=30, check=True)
    assert "File too large" in done.stdout
    assert not (tmp_path / "out.mcap").exists()
