"""A calibration as a file: what it says, that it is a rig's, and that it never takes another file's place."""

import tomllib
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from robot_io.errors import ConfigError, EnvironmentFault, UsageError
from robot_io.rig.calibration import Calibration
from robot_io.rig.config import load_rig
from tools.places.fragment import Fragment, default_path, fragment_text, write_fragment

MADE = datetime(2026, 7, 1, 12, 30, 15, tzinfo=UTC)
CALIBRATION = Calibration(MADE, 0.3, "deg", 0.05, "cord, 4 directions", "mine")
FRAGMENT = Fragment("frame", {"frames.contact_in_base_m": (1.0, 0.02, 0.15)}, CALIBRATION, ("the arm\nstood still",))


def test_its_text_is_pinned():
    assert fragment_text(FRAGMENT) == (
        "# Calibration `frame` of the rig mine, 2026-07-01 12:30+00:00.\n"
        "# A rig takes it by `include` (docs/rig-files.md).\n"
        "# the arm stood still\n"
        "\n"
        "[frames]\n"
        "contact_in_base_m = [1.0, 0.02, 0.15]\n"
        "\n"
        "[calibration]\n"
        "\n"
        "[calibration.frame]\n"
        'made = "2026-07-01T12:30:15Z"\n'
        "uncertainty = 0.3\n"
        'unit = "deg"\n'
        "residual = 0.05\n"
        'source = "cord, 4 directions"\n'
        'rig = "mine"\n'
    )


def test_it_can_be_included_as_written(tmp_path):
    path = tmp_path / "calibration" / "frame.toml"
    write_fragment(path, FRAGMENT)
    (tmp_path / "rig.toml").write_text('extends = "emulated"\ninclude = ["calibration/frame.toml"]\nname = "mine"\n')
    rig = load_rig(tmp_path / "rig.toml")
    assert rig.calibration.frame == CALIBRATION
    assert rig.frames.contact_in_base_m == (1.0, 0.02, 0.15)
    assert list(path.parent.iterdir()) == [path]


def test_one_without_keys_says_only_how_it_was_made():
    bias = Fragment("bias", {}, Calibration(MADE, (0.1, 0.1), "N, N"))
    read = tomllib.loads(fragment_text(bias))
    assert list(read) == ["calibration"]
    assert read["calibration"]["bias"]["uncertainty"] == [0.1, 0.1]


@pytest.mark.parametrize(
    ("what", "keys"),
    [
        ("frame", {"frames.contact_in_base": (1.0, 0.0, 0.1)}),
        ("frame", {"frames.contact_in_base_m": (1.0, float("nan"), 0.1)}),
        ("frame", {"frames.contact_in_base_m": (1000.0, 0.0, 0.1)}),
        ("frames", {}),
    ],
)
def test_what_is_no_rigs_is_refused_before_anything_is_written(tmp_path, what, keys):
    with pytest.raises(ConfigError):
        write_fragment(tmp_path / "below" / "x.toml", Fragment(what, keys, CALIBRATION))
    assert list(tmp_path.iterdir()) == []


def test_no_file_is_overwritten(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text("precious")
    with pytest.raises(UsageError, match="there is a file of this name already"):
        write_fragment(path, FRAGMENT)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]


def test_where_it_cannot_be_written_is_a_sentence(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(EnvironmentFault, match="cannot be written"):
        write_fragment(tmp_path / "file" / "x.toml", FRAGMENT)


def test_the_default_name_is_free(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for expected in ("frame-2026-07-01.toml", "frame-2026-07-01-2.toml", "frame-2026-07-01-3.toml"):
        path = default_path("frame", MADE)
        assert path == Path("calibration") / expected
        write_fragment(path, FRAGMENT)
    assert default_path("contact", MADE).name == "contact-2026-07-01.toml"


def test_uncertainties_keep_every_bit():
    exact = Calibration(MADE, 0.1 + 0.2, "deg")
    read = tomllib.loads(fragment_text(Fragment("frame", {}, exact)))["calibration"]["frame"]
    assert msgspec.convert(read, Calibration) == exact
