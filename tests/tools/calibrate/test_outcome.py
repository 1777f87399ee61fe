"""What is written of an estimate: the fragment, its readings, and what then is left of a hidden error."""

import math
import tomllib

import numpy as np
import pytest

from robot_io.rig.config import load_rig
from tests.tools.calibrate.feeds import rot
from tools.calibrate.estimators.estimate import Estimate
from tools.calibrate.outcome import as_json, lines, saved, still_hidden
from tools.calibrate.raw import Raw

HIDDEN = (
    "world.truth.sensor_yaw_deg=3.0",
    "world.truth.contact_offset_m=[0.01, 0.02]",
    "world.truth.marker_offset=[0.1, 0.0, 0.2]",
)


def found(what="contact", keys=None, value=(1.0, 0.0)):
    many = len(value)
    unit = ", ".join(["m"] * many)
    return Estimate(what, value, (0.00123456,) * many, unit, (0.0001,) * many, "by hand", keys or {})


@pytest.fixture
def rig():
    return load_rig("emulated", HIDDEN)


def test_the_world_stays_where_it_was_when_frames_are_mended(rig):
    rows = (rot("z", 2.5) @ np.array(rig.frames.base_from_sensor)).tolist()
    left = still_hidden(found("frame", {"frames.base_from_sensor": rows}), rig)
    assert left == {"world.truth.sensor_yaw_deg": pytest.approx(0.5, abs=1e-5)}
    left = still_hidden(found(keys={"frames.contact_in_base_m": (1.009, 0.021, 0.15)}), rig)
    assert left == {"world.truth.contact_offset_m": pytest.approx((0.001, -0.001))}
    left = still_hidden(found("marker", {"frames.base_from_marker": (0.1, 0.0, 0.19)}), rig)
    assert left == {"world.truth.marker_offset": pytest.approx((0.0, 0.0, 0.01))}
    assert still_hidden(found("path", {"path.direction_deg": 1.0}), rig) == {}


def test_a_real_robot_hides_nothing_in_its_fragment(tmp_path, rig):
    keys = {"frames.contact_in_base_m": (1.0, 0.0, 0.15)}
    for level, expected in (("hardware", False), ("emulated", True)):
        told = load_rig("emulated", [*HIDDEN, f"base.level={level}", "base.url=ws://127.0.0.1:1"])
        written = saved(found(keys=keys), told, None, tmp_path / f"{level}.toml", None)
        assert ("truth" in written.fragment.read_text()) is expected


def test_readings_never_replace_another_file(tmp_path, rig):
    (tmp_path / "mine.csv").write_text("keep\n")
    raw = Raw()
    raw.forces(np.array([0.0, 0.01]), np.arange(12.0).reshape(2, 6))
    raw.poses(np.array([[1.0, 2.0, math.pi]]))
    written = saved(found(), rig, raw, tmp_path / "mine.toml", None)
    assert (tmp_path / "mine.csv").read_text() == "keep\n"
    assert written.readings == tmp_path / "mine-2.csv"
    assert written.readings.read_text().splitlines()[1:] == [
        "1,0.0000,0,1,2,3,4,5,,,",
        "1,0.0100,6,7,8,9,10,11,,,",
        "2,,,,,,,,1.000000,2.000000,3.141593",
    ]
    told = as_json(found(), written, [])
    assert told["uncertainty"] == (0.00123, 0.00123)
    assert told["log"] == str(written.readings)
    assert as_json(found(value=(1.5,)), written, [])["value"] == 1.5
    assert lines(found(), written, None)[0] == "contact: +1.0000 m +- 0.0012 (k = 2)"


@pytest.mark.parametrize(
    ("what", "names"),
    [
        ("bias", "fx, fy, fz, mx, my, mz of the sensor"),
        ("contact", "ahead, left"),
        ("marker", "ahead, left, turned to the left"),
        ("path", "x, y, direction"),
    ],
)
def test_several_values_are_named(what, names, tmp_path, rig):
    value = (1.0,) * len(names.replace("turned to the left", "turned").split(", "))
    told = lines(found(what, value=value), saved(found(), rig, None, tmp_path / "a.toml", None), None)
    assert told[len(value)] == f"in this order: {names}"


def test_one_value_needs_no_name(tmp_path, rig):
    told = lines(found("frame", value=(1.0,)), saved(found(), rig, None, tmp_path / "a.toml", None), None)
    assert told[1] == "by by hand"


def test_nothing_read_leaves_no_file_of_readings(tmp_path, rig):
    assert saved(found(), rig, Raw(), tmp_path / "a.toml", None).readings is None
    assert [path.name for path in tmp_path.iterdir()] == ["a.toml"]


def weighed():
    return Estimate("frame", (0.3,), (0.2,), "deg", (0.1,), "weight of the tool", {}, unseen="yaw")


def frame_of(written):
    return tomllib.loads(written.fragment.read_text())["calibration"]["frame"]


def test_a_weight_after_a_cord_keeps_the_cords_date(tmp_path):
    """The yaw in the rig is still the cord's: as old as that, and measured."""
    corded = 'calibration.frame={made = 2026-07-01T12:00:00+00:00, uncertainty = 0.5, unit = "deg", source = "a cord"}'
    frame = frame_of(saved(weighed(), load_rig("emulated", [corded]), None, tmp_path / "frame.toml", None))
    assert frame["made"] == "2026-07-01T12:00:00Z"
    assert "unseen" not in frame
    assert frame["source"] == "weight of the tool; yaw as of 2026-07-01, by a cord"


def test_a_weight_alone_or_after_a_weight_leaves_the_yaw_unseen(tmp_path, rig):
    before = (
        "calibration.frame={made = 2026-07-01T12:00:00+00:00, uncertainty = 0.5, "
        'unit = "deg", source = "weight of the tool", unseen = "yaw"}'
    )
    for number, told in enumerate((rig, load_rig("emulated", [before]))):
        frame = frame_of(saved(weighed(), told, None, tmp_path / f"{number}.toml", None))
        assert frame["unseen"] == "yaw"
        assert frame["made"] != "2026-07-01T12:00:00Z"
