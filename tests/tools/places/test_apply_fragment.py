"""A rig takes a calibration: its file is edited, its comments stay, and what it was is kept."""

import stat

import pytest

from robot_io.errors import ConfigError, UsageError
from robot_io.rig.config import load_rig
from robot_io.rig.files import RIGS_DIR
from tools.places.apply_fragment import apply_fragment

FRAGMENT = """\
[frames]
contact_in_base_m = [1.0, 0.02, 0.15]
[calibration.contact]
made = "2026-07-01T12:00:00Z"
uncertainty = 0.005
unit = "m"
"""
RIG = """\
# Our robot.
extends = "emulated"   # the lab's scene
name = "mine"

[frames]
# measured with a tape
contact_in_base_m = [
  1.0, 0.0,   # ahead and left
  0.15,
]
[control]
k_f = 0.2  # tame
"""


@pytest.fixture
def put(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text.encode())
        return path

    return write


def test_own_lines_become_comments_and_the_file_as_it_was_is_kept(put):
    rig, fragment = put("rig.toml", RIG), put("calibration/contact.toml", FRAGMENT)
    kept = apply_fragment(rig, fragment)
    assert kept.name == "rig.toml.bak"
    assert kept.read_text() == RIG
    assert rig.read_text() == (
        "# Our robot.\n"
        'extends = "emulated"   # the lab\'s scene\n'
        'include = ["calibration/contact.toml"]\n'
        'name = "mine"\n'
        "\n"
        "[frames]\n"
        "# measured with a tape\n"
        "# replaced by calibration/contact.toml:\n"
        "# contact_in_base_m = [\n"
        "#   1.0, 0.0,   # ahead and left\n"
        "#   0.15,\n"
        "# ]\n"
        "[control]\n"
        "k_f = 0.2  # tame\n"
    )
    found = load_rig(rig)
    assert found.frames.contact_in_base_m == (1.0, 0.02, 0.15)
    assert found.control.k_f == 0.2
    assert found.calibration.contact.uncertainty == 0.005
    assert {path.name for path in rig.parent.iterdir()} == {"rig.toml", "rig.toml.bak", "calibration"}


def test_a_later_calibration_takes_the_place_of_an_earlier_one(put):
    rig, fragment = put("rig.toml", RIG), put("calibration/contact.toml", FRAGMENT)
    path = '[path]\ndirection_deg = 3.0\n[calibration.path]\nmade = "2026-07-01T12:00:00Z"\nuncertainty=1\nunit="deg"\n'
    apply_fragment(rig, fragment)
    apply_fragment(rig, put("calibration/path.toml", path))
    later = put("calibration/contact-2.toml", FRAGMENT.replace("0.02", "0.03").replace("2026-07", "2026-08"))
    assert apply_fragment(rig, later).name == "rig.toml.bak-3", "no earlier one is lost"
    assert 'include = ["calibration/path.toml", "calibration/contact-2.toml"]\n' in rig.read_text()
    found = load_rig(rig)
    assert found.frames.contact_in_base_m == (1.0, 0.03, 0.15)
    assert found.calibration.contact.made.month == 8
    assert found.path.direction_deg == 3.0


def test_a_table_in_the_rig_itself_gives_way_as_a_whole(put):
    own = RIG + '[calibration.contact]\nmade = 2025-01-01T00:00:00Z\nuncertainty = 1\nunit = "m"\nresidual = 0.5\n'
    rig = put("rig.toml", own)
    apply_fragment(rig, put("contact.toml", FRAGMENT))
    assert load_rig(rig).calibration.contact.residual is None
    assert load_rig(rig).calibration.contact.made.year == 2026


def test_an_include_over_several_lines_keeps_its_comments(put):
    put("gains.toml", "[control]\nk_y_rad_per_m = 0.1\n")
    rig = put("rig.toml", 'name = "mine"\ninclude = [\n  "gains.toml",  # by hand\n]\nextends = "emulated"\n')
    apply_fragment(rig, put("contact.toml", FRAGMENT))
    assert rig.read_text() == (
        'name = "mine"\n# include = [\n#   "gains.toml",  # by hand\n# ]\n'
        'include = ["gains.toml", "contact.toml"]\nextends = "emulated"\n'
    )


def test_windows_line_ends_and_a_byte_order_mark_stay(put):
    rig = put("rig.toml", "\ufeff" + RIG.replace("\n", "\r\n"))
    apply_fragment(rig, put("contact.toml", FRAGMENT))
    text = rig.read_bytes().decode()
    assert text.startswith("\ufeff# Our robot.\r\n")
    assert "\n" not in text.replace("\r\n", "")
    assert load_rig(rig).frames.contact_in_base_m == (1.0, 0.02, 0.15)


def test_permissions_and_links_stay(put, tmp_path):
    rig = put("real/rig.toml", RIG)
    rig.chmod(0o640)
    link = tmp_path / "link.toml"
    link.symlink_to(rig)
    apply_fragment(rig, put("contact.toml", FRAGMENT))
    assert stat.S_IMODE(rig.stat().st_mode) == 0o640
    later = put("contact-2.toml", FRAGMENT.replace("0.02", "0.03"))
    with pytest.raises(ConfigError):  # the rig's own include is relative to the link, and is not found from there
        apply_fragment(link, later)
    assert link.is_symlink()


def refused(kind, rig, fragment, before):
    with pytest.raises(kind) as caught:
        apply_fragment(rig, fragment)
    assert rig.read_text() == before
    assert not [path for path in rig.parent.iterdir() if ".bak" in path.name or "trial" in path.name]
    return str(caught.value)


def test_a_shipped_rig_is_refused_in_words(put):
    fragment = put("contact.toml", FRAGMENT)
    for rig in ("thing", RIGS_DIR / "thing.toml"):
        before = (RIGS_DIR / "thing.toml").read_text()
        with pytest.raises(UsageError, match="comes with the program and is not edited") as caught:
            apply_fragment(rig, fragment)
        assert 'extends = "thing"' in str(caught.value)
        assert (RIGS_DIR / "thing.toml").read_text() == before
    assert not (RIGS_DIR / "thing.toml.bak").exists()


def test_a_rig_that_could_not_be_used_afterwards_stays_as_it_is(put):
    turned = FRAGMENT.replace(
        "contact_in_base_m = [1.0, 0.02, 0.15]", "base_from_sensor = [[1, 0, 0], [0, 1, 0], [0, 0, 2]]"
    )
    rig = put("rig.toml", RIG)
    assert "not a rotation" in refused(ConfigError, rig, put("frame.toml", turned), RIG)
    with pytest.raises(ConfigError, match="no such rig file"):
        apply_fragment(rig.parent / "none.toml", rig)
    assert "cannot read it" in refused(ConfigError, rig, rig.parent / "none.toml", RIG)


def test_a_rig_that_could_not_be_used_before_says_why(put):
    fragment, text = put("contact.toml", FRAGMENT), RIG.replace("name =", 'include = ["contact.toml"]\nname =')
    rig = put("rig.toml", text)
    assert f"{rig}:8: `frames.contact_in_base_m` is also set at {fragment}:2" in refused(
        ConfigError, rig, fragment, text
    )


def test_what_has_no_line_of_its_own_is_left_to_the_person(put):
    text = RIG.partition("[frames]")[0] + "frames = { contact_in_base_m = [1.0, 0.0, 0.15] }\n"
    rig = put("rig.toml", text)
    assert "`frames.contact_in_base_m` is not on a line of its own" in refused(
        UsageError, rig, put("c.toml", FRAGMENT), text
    )


def test_an_include_that_would_be_replaced_in_part_is_left_to_the_person(put):
    put("mixed.toml", FRAGMENT + "[control]\nk_y_rad_per_m = 0.1\n")
    text = 'extends = "emulated"\nname = "mine"\ninclude = ["mixed.toml"]\n'
    rig = put("rig.toml", text)
    assert "also sets `control.k_y_rad_per_m`" in refused(UsageError, rig, put("contact.toml", FRAGMENT), text)


def test_a_text_that_only_looks_like_a_key_is_no_harm(put):
    text = 'extends = "emulated"\nname = "mine"\ndescription = """\ninclude = [\nframes.x = 1\n"""\n' + (
        "[frames]\ncontact_in_base_m = [1.0, 0.0, 0.15]\n"
    )
    rig = put("rig.toml", text)
    apply_fragment(rig, put("contact.toml", FRAGMENT))
    found = load_rig(rig)
    assert found.description == "include = [\nframes.x = 1\n"
    assert found.frames.contact_in_base_m == (1.0, 0.02, 0.15)


def test_a_rig_without_a_last_newline(put):
    rig = put("rig.toml", RIG.rstrip("\n"))
    apply_fragment(rig, put("contact.toml", FRAGMENT))
    assert load_rig(rig).control.k_f == 0.2
