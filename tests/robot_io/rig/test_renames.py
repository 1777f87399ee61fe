"""Keys that had other names: a rig file that uses one is told the new name, a log that does is read by its format."""

from __future__ import annotations

import pytest

from robot_io.errors import ConfigError
from robot_io.rig import renames
from robot_io.rig.config import load_rig, rig_to_toml
from robot_io.rig.logged import rig_of_log
from tools.cli import main

NAMES = {
    "ft.tare_seconds_s": "ft.tare_s",
    "limits.hold_slow_rad": "limits.drift_hold_rad",
    "limits.hold_stop_rad": "limits.drift_stop_rad",
}
VALUES = ("ft.tare_s=2.5", "limits.drift_hold_rad=0.0015", "limits.drift_stop_rad=0.004")
TODAY = rig_to_toml(load_rig("sim", VALUES))
FORMAT_1 = (
    TODAY.replace("\ntare_s =", "\ntare_seconds_s =")
    .replace("drift_hold_rad", "hold_slow_rad")
    .replace("drift_stop_rad", "hold_stop_rad")
)


@pytest.mark.parametrize("old", NAMES)
def test_an_old_key_names_the_new_one_in_one_sentence(old):
    with pytest.raises(ConfigError) as caught:
        load_rig("sim", [f"{old}=0.5"])
    assert caught.value.what == f"`{old}` is called `{NAMES[old]}` now"
    assert caught.value.where == f"--set {old}"


def test_config_check_prints_every_rename_with_its_line(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text(
        'extends = "sim"\n[ft]\ntare_seconds_s = 2.0\n[limits]\nhold_slow_rad = 0.001\nhold_stop_rad = 0.002\n'
        "[base]\nodometry_rate_hz = 50.0\n"
    )
    assert main(["config", "check", str(path)]) == 2
    told = capsys.readouterr().err
    for line, old in zip((3, 5, 6), NAMES, strict=True):
        assert f"{path}:{line}: `{old}` is called `{NAMES[old]}` now" in told
    assert f"{path}:8: `base.odometry_rate_hz` is no longer a key: leave it out" in told


def test_the_first_format_s_config_is_todays_rig():
    assert FORMAT_1.count("_s = 2.5\n") == 1
    found = rig_of_log(FORMAT_1, 1)
    assert found.rig == load_rig("sim", VALUES)
    assert found.notes == ()


def test_old_keys_in_a_log_of_today_are_mistakes():
    with pytest.raises(ConfigError, match="3 mistakes"):
        rig_of_log(FORMAT_1, 2)
    assert rig_of_log(TODAY, 2).rig == load_rig("sim", VALUES)


def test_a_retired_key_is_ignored_with_a_note_and_only_where_it_was_one():
    text = TODAY.replace("[base]\n", "[base]\nodometry_rate_hz = 50.0\n")
    found = rig_of_log(text, 1)
    assert found.rig == load_rig("sim", VALUES)
    assert found.notes == ("the log's `base.odometry_rate_hz` means nothing today and was ignored",)
    with pytest.raises(ConfigError, match="no longer a key"):
        rig_of_log(text, 2)


def test_a_missing_key_gets_the_default_of_the_log_s_format(monkeypatch):
    text = TODAY.replace("pose_rate_hz = 100.0\n", "")
    assert text != TODAY
    monkeypatch.setattr(renames, "EARLIER_DEFAULTS", (renames.EarlierDefault("base.pose_rate_hz", 50.0, 1),))
    assert rig_of_log(text, 1).rig.base.pose_rate_hz == 50.0
    assert rig_of_log(text, 2).rig.base.pose_rate_hz == 100.0
    assert rig_of_log(TODAY, 1).rig.base.pose_rate_hz == 100.0


def test_every_rename_leads_to_a_key_of_today():
    keys = {key for key in rig_to_toml(load_rig("sim")).split() if key.replace("_", "").isalnum()}
    for renamed in renames.RENAMED:
        assert renamed.new.rpartition(".")[2] in keys
        assert renamed.old.rpartition(".")[2] not in keys
