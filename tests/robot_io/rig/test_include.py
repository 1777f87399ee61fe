"""`include` of a rig file: the order of what counts, the lines of what clashes, and the calibrations it brings."""

import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from robot_io.errors import ConfigError
from robot_io.rig.calibration import WHATS
from robot_io.rig.config import load_rig, origins_of, rig_from_toml, rig_to_toml

CONTACT = """\
[frames]
contact_in_base_m = [1.0, 0.02, 0.15]

[calibration.contact]
made = "2026-07-01T12:00:00+02:00"
uncertainty = 0.005
unit = "m"
"""


@pytest.fixture
def rig(tmp_path):
    """Return a function that writes `rig.toml`, and the files beside it that are given by name."""

    def write(text, **others):
        for name, content in others.items():
            (tmp_path / f"{name}.toml").write_text(content, encoding="utf-8")
        path = tmp_path / "rig.toml"
        path.write_text(f'extends = "emulated"\nname = "mine"\n{text}', encoding="utf-8")
        return path

    return write


def refused(path):
    with pytest.raises(ConfigError) as caught:
        load_rig(path)
    return caught.value


def test_first_the_extended_rig_then_the_included_files_then_its_own_keys(rig, tmp_path):
    (tmp_path / "base.toml").write_text(
        'extends = "emulated"\nname = "base"\n[control]\nk_f = 0.11\nforce_min_N = 4.0\n[frames]\n'
        "contact_in_base_m = [0.9, 0.0, 0.15]\n"
    )
    path = tmp_path / "rig.toml"
    path.write_text('extends = "base.toml"\ninclude = ["contact.toml"]\n[control]\nforce_min_N = 6.0\n')
    (tmp_path / "contact.toml").write_text(CONTACT)
    found = load_rig(path)
    assert (found.name, found.control.k_f, found.control.force_min_N) == ("base", 0.11, 6.0)
    assert found.frames.contact_in_base_m == (1.0, 0.02, 0.15)
    assert found.frames.sensor_in_base_m == (0.85, 0.0, 0.15)


def test_an_extended_rig_brings_what_it_includes(rig, tmp_path):
    rig('include = ["contact.toml"]\n', contact=CONTACT)
    (tmp_path / "below").mkdir()
    child = tmp_path / "below" / "child.toml"
    child.write_text('extends = "../rig.toml"\nname = "child"\n')
    assert load_rig(child).frames.contact_in_base_m == (1.0, 0.02, 0.15)
    child.write_text('extends = "../rig.toml"\n[frames]\ncontact_in_base_m = [2.0, 0.0, 0.15]\n')
    assert load_rig(child).frames.contact_in_base_m == (2.0, 0.0, 0.15), "it may override what it extends"


def test_a_key_in_the_file_and_in_what_it_includes_names_both_lines(rig, tmp_path):
    path = rig('include = ["contact.toml"]\n[frames]\ncontact_in_base_m = [1.0, 0.0, 0.15]\n', contact=CONTACT)
    error = refused(path)
    assert error.where == f"{path}:5"
    assert error.what == f"`frames.contact_in_base_m` is also set at {tmp_path}/contact.toml:2"


def test_a_key_in_two_included_files_names_both_lines(rig, tmp_path):
    other = "# one line above\n[frames]\ncontact_in_base_m = [1.0, 0.0, 0.2]\n"
    error = refused(rig('include = ["contact.toml", "other.toml"]\n', contact=CONTACT, other=other))
    assert error.where == f"{tmp_path}/other.toml:3"
    assert error.what == f"`frames.contact_in_base_m` is also set at {tmp_path}/contact.toml:2"


def test_every_clash_is_told_at_once(rig, tmp_path):
    error = refused(rig('include = ["contact.toml", "again.toml"]\n', contact=CONTACT, again=CONTACT))
    assert "4 keys are set twice" in error.what
    for line, key in ((2, "frames.contact_in_base_m"), (5, "calibration.contact.made")):
        assert f"{tmp_path}/again.toml:{line}: `{key}` is also set at {tmp_path}/contact.toml:{line}" in error.what


def test_a_value_of_a_list_of_tables_clashes_as_a_whole(rig, tmp_path):
    error = refused(rig('include = ["a.toml"]\n[faults]\ninject = []\n', a='\n[faults]\ninject = ["x"]\n'))
    assert (error.where, error.what) == (
        f"{tmp_path}/rig.toml:5",
        f"`faults.inject` is also set at {tmp_path}/a.toml:3",
    )


@pytest.mark.parametrize("word", ['include = ["contact.toml"]', 'extends = "sim"'])
def test_what_is_included_cannot_include_or_extend(rig, tmp_path, word):
    error = refused(rig('include = ["a.toml"]\n', a=f"\n{word}\n", contact=CONTACT))
    assert error.where == f"{tmp_path}/a.toml:2"
    assert f"a file that is included cannot say `{word.split()[0]}`" in error.what


@pytest.mark.parametrize("value", ['"contact.toml"', "[1]", "3", '{ file = "a" }'])
def test_include_is_a_list_of_files(rig, value):
    path = rig(f"include = {value}\n")
    error = refused(path)
    assert error.where == f"{path}:3"
    assert "`include` is a list of files" in error.what


def test_a_file_that_is_not_there_is_named_with_the_line_of_the_include(rig, tmp_path):
    path = rig('include = ["calibration/none.toml"]\n')
    error = refused(path)
    assert (error.where, error.what) == (f"{path}:3", f"there is no file {tmp_path}/calibration/none.toml to include")


def test_paths_are_relative_to_the_rig_and_a_tilde_is_the_home(rig, tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "contact.toml").write_text(CONTACT)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir("/")
    assert load_rig(rig('include = ["~/contact.toml"]\n')).frames.contact_in_base_m[1] == 0.02
    assert load_rig(rig('include = ["home/contact.toml"]\n')).frames.contact_in_base_m[1] == 0.02
    assert "there is no user" in refused(rig('include = ["~nobody-of-this-name/a.toml"]\n')).what


def test_mistakes_in_an_included_file_have_its_lines(rig, tmp_path):
    spoilt = CONTACT.replace("made = ", "mad = ").replace("0.005", '"small"')
    text = str(refused(rig('include = ["contact.toml"]\n', contact=spoilt)))
    for where, what in (
        (f"{tmp_path}/contact.toml:5", "`calibration.contact.mad`, did you mean"),
        (f"{tmp_path}/contact.toml:6", "`calibration.contact.uncertainty` = 'small'"),
        (f"{tmp_path}/contact.toml:4", "`calibration.contact.made` is missing"),
    ):
        assert any(where in line and what in line for line in text.splitlines()), (where, text)


def test_the_resolved_rig_needs_no_files(rig, tmp_path):
    path = rig('include = ["contact.toml"]\n', contact=CONTACT)
    found = load_rig(path)
    text = rig_to_toml(found)
    for file in tmp_path.iterdir():
        file.unlink()
    assert rig_from_toml(text) == found
    assert found.calibration.contact.made == datetime(2026, 7, 1, 10, tzinfo=UTC)


def test_six_things_can_be_calibrated_and_a_time_needs_its_zone(rig):
    assert WHATS == ("bias", "sign", "frame", "contact", "marker", "path")
    several = '[calibration.WHAT]\nmade = 2026-07-01T12:00:00Z\nuncertainty = [0.005, 0.3]\nunit = "m, deg"\n'
    found = load_rig(rig("".join(several.replace("WHAT", what) for what in WHATS)))
    assert tuple(found.calibration.made()) == WHATS
    assert found.calibration.path.uncertainty == (0.005, 0.3)
    assert found.calibration.max_age_days == 30.0
    path = rig(several.replace("WHAT", "frame").replace("00Z", "00"))
    error = refused(path)
    assert error.where == f"{path}:4"
    assert "timezone" in error.what


def test_ages_are_in_days(rig):
    found = load_rig(rig('include = ["contact.toml"]\n', contact=CONTACT))
    later = datetime(2026, 7, 31, 22, tzinfo=UTC)
    assert found.calibration.ages_days(later.timestamp()) == {"contact": 30.5}


def test_the_origin_of_a_value_is_the_fragment(rig, tmp_path):
    path = rig('include = ["contact.toml"]\n[control]\nk_f = 0.2\n', contact=CONTACT)
    found = origins_of(path, ["control.k_y_rad_per_m=0.1"])
    assert found["frames", "contact_in_base_m"] == f"{tmp_path}/contact.toml:2"
    assert found["control", "k_f"] == f"{path}:5"
    assert found["control", "k_y_rad_per_m"] == "--set control.k_y_rad_per_m"
    assert found["frames", "sensor_in_base_m"].endswith("rig/emulated.toml:45")
    assert ("control", "retreat_m") not in found


def push(*argv):
    program = Path(sys.executable).parent / "push"
    return subprocess.run([program, *argv], capture_output=True, text=True, timeout=30, check=False)


def test_config_show_tells_the_origins(rig, tmp_path):
    path = rig('include = ["contact.toml"]\n', contact=CONTACT)
    shown = push("config", "show", str(path), "--origin").stdout
    assert f"contact_in_base_m = [1.0, 0.02, 0.15]  # {tmp_path}/contact.toml:2\n" in shown
    assert "retreat_m = 0.05  # default\n" in shown
    assert rig_from_toml(shown) == load_rig(path), "it is still a rig"
    told = msgspec.json.decode(push("config", "show", str(path), "--origin", "--json").stdout)
    assert told["origins"]["frames.contact_in_base_m"] == f"{tmp_path}/contact.toml:2"
    refusal = push("config", "check", str(path), "--origin")
    assert refusal.returncode == 2
    assert "--origin goes with `show` only" in refusal.stderr
