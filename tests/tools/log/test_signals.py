"""`/control/signals` and the wrench of one push at level sim, against what the push is known to do."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path
from typing import Any

import pytest
from rosbags.highlevel import AnyReader

from control.sensing import sense
from control.settings import Settings
from robot_io.cdr.schema import type_from_schema
from robot_io.log.signals import FAULT_IDS, SIGNALS, fault_code, fault_id_of
from robot_io.mcap.read import read_log, read_summary
from robot_io.messages import ArmRecord, BaseRecord, BodyTwist, Pose2D, WorldTwist
from robot_io.rig.config import load_rig
from robot_io.tick import (
    ControlState,
    ControlTick,
    FtInput,
    FtReading,
    HostInput,
    Mode,
    Phase,
    TickInput,
    TickOutput,
    TickState,
)
from safety.faults import FAULTS
from sim_backend.ridgeback.settings import RidgebackSettings
from tests.push_runs import QUICK, finished
from tools.log.signals import strongest
from tools.log.stamp_ages import StampAges
from tools.log.torque import TorqueOf


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("signals")
    out = folder / "run"
    done = finished(folder / "state", "run", "sim", "--fast", *QUICK, "--distance-m", "0.3", "--out", str(out))
    assert done.code == 0, done.err
    return out / "run.mcap"


@pytest.fixture(scope="module")
def messages(log) -> dict[str, list[tuple[int, Any]]]:
    """Every decodable message by topic, read by rosbags and the definitions in the file alone."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([log]) as reader:
        for connection, time_ns, raw in reader.messages():
            found.setdefault(connection.topic, []).append((time_ns, reader.deserialize(raw, connection.msgtype)))
    return found


def test_there_is_one_for_each_tick_stamped_with_its_log_time(messages):
    signals = messages["/control/signals"]
    assert [time_ns for time_ns, _ in signals] == [time_ns for time_ns, _ in messages["/control/tick"]]
    for time_ns, one in signals:
        assert one.header.stamp.sec * 10**9 + one.header.stamp.nanosec == time_ns


def test_their_numbers_are_those_of_the_push(messages):
    pushing = [one for _, one in messages["/control/signals"] if one.phase == Phase.PUSH]
    assert {one.contact for one in pushing} == {1}
    assert {one.fault for one in pushing} == {0}
    ahead = pushing[len(pushing) // 2 :][:100]
    rig = load_rig("sim")
    for one in ahead:
        assert one.mode == Mode.PUSHING
        assert one.speed_sent == pytest.approx(rig.control.push_speed_m_per_s, abs=0.02)
        assert one.speed_measured == pytest.approx(one.speed_sent, abs=0.03)
        assert math.hypot(one.force_along_n, one.force_across_n) == pytest.approx(one.force_n, rel=1e-5)
        assert math.atan2(one.force_across_n, one.force_along_n) == pytest.approx(one.theta_f_rad, abs=1e-4)
        assert one.corridor_left_m == pytest.approx(rig.goal.corridor_m - abs(one.lateral_m), abs=1e-6)
        assert 0.0 <= one.ft_age_ms < 30.0
        assert 0.0 <= one.pose_age_ms < 30.0
        assert 0.0 <= one.odom_age_ms < 60.0
        assert 0.0 <= one.arm_age_ms < 30.0
        # 0.1 m/s for 70 ms, and braking at 2.5 m/s^2: about 9 mm.
        assert 0.004 < one.stop_distance_m < 0.02
    progress = [one.progress_m for one in pushing]
    assert all(after > before - 0.005 for before, after in itertools.pairwise(progress)), "measured, with noise"
    assert progress[-1] == pytest.approx(0.3, abs=0.02)


def test_what_is_not_known_yet_is_nan_and_not_zero(messages):
    _, first = messages["/control/signals"][0]
    assert math.isnan(first.theta_f_rad)
    assert math.isnan(first.heading_error_rad)


def test_no_standard_message_holds_a_nan(log):
    summary = read_summary(log)
    types = {c.topic: type_from_schema(c.schema_name, c.schema_text) for c in summary.channels}
    standard = {c.topic for c in summary.channels if not c.schema_name.startswith("push_msgs")}
    assert {"/ft/wrench", "/base/odom", "/base/pose", "/tf"} <= standard
    for message in read_log(log):
        if message.topic in standard:
            assert not re.search(r"=-?(nan|inf)\b", str(types[message.topic].decode(message.payload))), message.topic


def test_a_reader_of_others_finds_the_names_of_all_values_in_the_definitions(log):
    with AnyReader([log]) as reader:
        types = {c.topic: reader.typestore.types[c.msgtype] for c in reader.connections}
        names = {
            name: getattr(types["/control/signals"], name) for name in dir(types["/control/signals"]) if name.isupper()
        }
        assert (names["PHASE_PUSH"], names["MODE_STOP"], names["CONTACT_LOST"]) == (3, 5, 2)
        assert names["FAULT_F20_STOP"] == 2003
        assert types["/rosout"].WARN == 30
        status = reader.typestore.types["diagnostic_msgs/msg/DiagnosticStatus"]
        assert (status.OK, status.WARN, status.ERROR, status.STALE) == (0, 1, 2, 3)


def test_latency_of_motion_capture_is_what_the_simulation_adds(log):
    said = read_summary(log).metadata["run_end"]["latency /base/pose"]
    assert said.startswith(f"{RidgebackSettings().mocap_latency_s * 1000:.1f} ms from stamp to arrival")


def test_every_row_of_the_fault_table_has_its_number():
    assert set(FAULT_IDS) == set(FAULTS)
    codes = [fault_code(one) for one in FAULT_IDS]
    assert len(set(codes)) == len(codes)
    assert max(codes) < 65_535
    assert [fault_code(one) for one in ("F06", "F20-hold", "F67-late", "R02", "nonsense", "F99999")] == [
        600, 2002, 6705, 50_200, 65_535, 65_535,
    ]  # fmt: skip
    assert fault_id_of(2003) == "F20-stop"
    assert fault_id_of(0) == fault_id_of(1) == ""


def test_the_strongest_fault_counts():
    assert strongest(()) == 0
    assert strongest(("F60-late", "F20-hold", "F20-stop", "F21")) == fault_code("F20-stop")


def test_their_definition_is_small():
    assert SIGNALS.fixed_size is False, "a header has a name"
    assert "uint8 phase\nuint8 mode\nuint8 contact\nuint16 fault\n" in SIGNALS.schema_text
    assert "float32 progress_m\n" in SIGNALS.schema_text


def test_the_torque_is_computed_as_the_force_is():
    """Readings whose torque equals their force: what control makes of the force, this makes of the torque."""
    rig = load_rig("sim")
    settings, torque = Settings.of(rig), TorqueOf(rig)
    state = ControlState(phase=Phase.PUSH, tared=True, bias_force=(1.0, -2.0, 3.0), bias_torque=(1.0, -2.0, 3.0))
    for n in range(60):
        now_ns, wild = n * 10_000_000, 400.0 if n == 20 else 0.0
        values = (5.0 + math.sin(n / 7) + wild, -n * 0.1, 2.0)
        pause = 25 <= n < 40  # longer than a reading counts
        readings = () if pause else (FtReading(now_ns - 1_000_000, n, values, values),)
        base = BaseRecord(pose=Pose2D(0.0, 0.0, 0.01 * n), pose_valid=True)
        host = HostInput(0, 0, True, True, True, False, 0)
        inp = TickInput(n, now_ns, 0, host, FtInput(readings, 2, n, 0, 0), ArmRecord(), base)
        before, state = state, sense(settings, state, readings, base.pose.yaw, now_ns)
        out = TickOutput(2, (), WorldTwist(), BodyTwist(), BodyTwist(), 0.0, 0.0, False, 0)
        kept = (TickState(control=before),) if n == 0 else ()
        found = torque.of(ControlTick(0, 0, inp, kept, TickState(control=state), out))
        assert found == state.force_world, n


def test_ages_without_stamps_say_nothing_and_those_of_another_clock_only_how_they_vary():
    ages = StampAges()
    stamp = b"\x00\x01\x00\x00" + (5).to_bytes(4, "little") + (1_000_000).to_bytes(4, "little") + b"more"
    for _ in range(3):
        ages.note(stamp, 5_001_000_000)
    assert ages.latency(0.0, 0.0) is None
    for late_ms in range(1, 101):
        ages.note(stamp, 5_001_000_000 + late_ms * 1_000_000)
    found = ages.latency(None, 0.0)
    assert (found.least_ms, found.most_ms, found.messages) == (0.0, 100.0, 103)
    assert found.median_ms == pytest.approx(50.0, abs=3.0)
    assert found.latency_ms is None
    assert "not known" in found.in_words()
    ahead = ages.latency(0.25, 0.002)
    assert ahead.latency_ms == pytest.approx(found.median_ms + 250.0)
    assert "known to 2.0 ms" in ahead.in_words()


def test_many_messages_are_kept_in_part_and_the_extremes_all():
    ages = StampAges()
    stamp = b"\x00\x01\x00\x00" + bytes(8)
    for n in range(20_000):
        ages.note(stamp, n if n != 777 else 10**9)
    assert len(ages._ages_ns) < 4096
    assert ages.latency(None, 0.0).most_ms == 1000.0
    ages.note(b"short", 0)
    assert ages.messages == 20_000
