import math
import re
import string
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_io.errors import ConfigError, UsageError
from robot_io.rig import toml as toml_text
from robot_io.rig.config import ControlConfig, RigConfig, load_rig, rig_from_toml, rig_to_toml
from robot_io.rig.files import shipped_rigs
from robot_io.rig.types import row_of, table_of

DIMENSIONLESS = {
    "ros_version": "a version number",
    "k_f": "gain of an angle on an angle",
    "contact_samples": "a count",
    "envelope_factor": "a ratio",
    "floor_friction": "a coefficient",
    "contact_friction": "a coefficient",
    "spread": "a ratio",
    "base_tick_rate_error": "a ratio",
    "slip": "a share",
    "phase": "a part of a period",
    "arm_phase": "a part of a period",
    "base_phase": "a part of a period",
    "along_over_across": "a ratio of frictions",
    "patch_strength": "a part of the mean",
    "pressure": "a name, or points in m, m and a share",
    "support_points": "a number of points",
    "cpu": "the number of a processor",
    "impratio": "a ratio",
    "base_from_sensor": "a rotation matrix",
    "base_from_marker": "m, m, rad: in the docstring",
    "marker_offset": "m, m, rad: in the docstring",
    "bias": "N and N*m: in the docstring",
    "range": "N and N*m: in the docstring",
    "resolution": "N and N*m: in the docstring",
    "noise": "N and N*m: in the docstring",
    "options": "only the kind knows",
    "law_settings": "only the law knows",
    "uncertainty": "in `unit`",
    "residual": "in `unit`",
}
SUFFIXES = (
    *("_m", "_s", "_ms", "_us", "_minutes", "_days", "_N", "_Nm", "_rad", "_deg", "_hz", "_kg", "_MB"),
    *("_m_per_s", "_rad_per_s", "_m_per_s2", "_rad_per_s2", "_per_s", "_rad_per_m"),
)


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def numeric_keys(kind: type[msgspec.Struct]):
    for field in msgspec.structs.fields(kind):
        if table := table_of(field.type) or row_of(field.type):
            yield from numeric_keys(table)
        elif re.search(r"\b(float|int)\b|Literal\[\d", str(field.type)):
            yield field.name


def test_every_quantity_names_its_unit():
    keys = list(numeric_keys(RigConfig))
    assert len(keys) > 50
    assert [key for key in keys if not key.endswith(SUFFIXES) and key not in DIMENSIONLESS] == []
    assert set(DIMENSIONLESS) <= set(keys), "the list of dimensionless keys may only shrink"


@pytest.mark.parametrize("name", shipped_rigs())
def test_resolved_rig_reads_back_equal(name):
    rig = load_rig(name)
    assert rig_from_toml(rig_to_toml(rig)) == rig


def test_a_rig_with_lists_of_tables_and_times_reads_back_equal():
    forces = ("[-10, 0.1, 0]", "[1, 2, 3]")
    hand = ", ".join(f"{{at_s = 1, for_s = 0.5, force_body_N = {force}}}" for force in forces)
    made = ["calibration.path.made=2026-07-01T12:00:00.25+02:00", "calibration.path.uncertainty=[0.005, 0.2]"]
    rig = load_rig("sim", [f"world.hand=[{hand}]", *made, 'calibration.path.unit="m, deg"'])
    assert [press.force_body_N for press in rig.world.hand] == [(-10.0, 0.1, 0.0), (1.0, 2.0, 3.0)]
    assert rig_from_toml(rig_to_toml(rig)) == rig


def test_mistakes_in_a_list_of_tables_have_its_first_line(tmp_path):
    path = write(tmp_path / "r.toml", 'extends = "sim"\n[world.sensor]\nphase = 0.1\n[[world.hand]]\nat_s = 1.0\n')
    with pytest.raises(ConfigError, match="required field `for_s`") as caught:
        load_rig(path)
    assert caught.value.where == f"{path}:4"
    write(path, 'extends = "sim"\n[[world.hand]]\nat_s = 1\nfor_s = 1\nforce_body_N = [nan, 0, 0]\n')
    with pytest.raises(ConfigError, match="not finite") as caught:
        load_rig(path)
    assert caught.value.where == f"{path}:2"


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(st.dictionaries(st.text(string.ascii_lowercase + "_", min_size=1, max_size=8), st.one_of(
    finite, st.integers(-(2**53), 2**53), st.booleans(),
    st.text(st.characters(codec="utf-8")), st.lists(finite, max_size=4),
), max_size=6))  # fmt: skip
def test_emitted_toml_keeps_every_value(table):
    data = {"top": 1.5, "table": {"inner": table}}
    read, _ = toml_text.parse(toml_text.emit(data), "x")
    assert read == data
    assert repr(read) == repr(data)  # types and signs of zero too


def test_unknown_key_names_the_nearest_and_its_line(tmp_path):
    path = write(tmp_path / "r.toml", 'extends = "emulated"\n\n[control]\nfrce_min_N = 4.0\n')
    with pytest.raises(ConfigError) as caught:
        load_rig(path)
    assert caught.value.where == f"{path}:4"
    assert "`control.frce_min_N`" in caught.value.what
    assert "did you mean `force_min_N`?" in caught.value.what


def test_all_mistakes_are_reported_at_once(tmp_path):
    path = write(
        tmp_path / "r.toml",
        'extends = "emulated"\nlop = 1\n[control]\npush_speed_m_per_s = 5.0\nk_f = "big"\n'
        '[base]\nlevel = "real"\n[base.topics]\ncommandd = ""\n[path]\norigin_m = [0.0]\n',
    )
    with pytest.raises(ConfigError) as caught:
        load_rig(path)
    text = str(caught.value)
    for line, words in {
        2: "`lop`", 4: "push_speed_m_per_s` = 5.0: expected `float` <= 0.5", 5: "k_f` = 'big'",
        7: "expected one of sim, emulated, hardware", 9: "did you mean `command`?", 11: "`path.origin_m`",
    }.items():  # fmt: skip
        assert any(f"{path}:{line}: " in row and words in row for row in text.splitlines()), (line, words, text)
    assert "6 mistakes" in text


def test_missing_table_is_named(tmp_path):
    path = write(tmp_path / "r.toml", 'name = "x"\n')
    with pytest.raises(ConfigError, match="`frames` is missing"):
        load_rig(path)


@pytest.mark.parametrize("value", ["inf", "nan", "-inf", "1" + "0" * 400])
def test_numbers_must_be_finite(value):
    with pytest.raises(ConfigError, match=r"not finite|too large|out of range"):
        load_rig("emulated", [f"world.start.lateral_offset_m={value}"])


def test_broken_toml_names_file_and_line(tmp_path):
    path = write(tmp_path / "r.toml", 'name = "x"\n[ft\n')
    with pytest.raises(ConfigError) as caught:
        load_rig(path)
    assert caught.value.where == f"{path}:2"


@pytest.mark.timeout(20)
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("k_f = " + "1" * 5000, "not TOML"),
        ("loop.rate_hz = 0x" + "f" * 5000, "out of range"),
        (".".join("a" * 20_000) + " = 1", "nested too deeply"),
        ("\n".join(f"k{i} = 1" for i in range(20_000)), "too many for a rig"),
        ('description = """\n' + " " * 60_000 + '\n"""', "`name` is missing"),
        ('description = """\n[' + " " * 60_000 + '\n"""', "`name` is missing"),
    ],
)
def test_a_hostile_text_is_a_sentence_in_little_time(text, words):
    """A rig may come out of a log, which is untrusted: squares and cubes of its length must not be computed."""
    with pytest.raises(ConfigError) as caught:
        rig_from_toml(text)
    assert words in str(caught.value)


def test_the_line_of_a_key_is_found_however_it_is_spaced():
    text = '  [ base . topics ]  # here\n\tcommand\t= "/a"\n"status"="/b"\n'
    origins = toml_text.parse(text, "rig")[1]
    lines = {("base", "topics"): 1, ("base", "topics", "command"): 2, ("base", "topics", "status"): 3}
    assert origins == {key: f"rig:{line}" for key, line in lines.items()}


def test_overrides_take_toml_values_minus_and_bare_words():
    rig = load_rig(
        "emulated",
        ["path.direction_deg=-30", "control.law=open-loop", "base.topics.ros_version=2", "ft.port=x=y"],
    )
    assert rig.path.direction_deg == -30.0
    assert rig.control.law == "open-loop"
    assert rig.base.topics.ros_version == 2
    assert rig.ft.port == "x=y"
    assert rig.control.k_f == load_rig("emulated").control.k_f


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("control.kf=0.1", "did you mean `k_f`"),
        ("control.k_f=fast", "expected `float`, got `str`"),
        ("control.k_f.x=1", "is a value, not a table"),
        ("control=1", "is a table, not a value"),
        ("control.k_f", "not of the form key=value"),
        ("=1", "not of the form key=value"),
        ("control.k_f=1\nextra=2", "expected `float`"),
    ],
)
def test_bad_overrides_are_usage_errors(setting, words):
    with pytest.raises(UsageError) as caught:
        load_rig("emulated", [setting])
    assert words in str(caught.value)
    assert "--set" in caught.value.where


def test_unknown_rig_names_the_shipped_ones():
    with pytest.raises(ConfigError) as caught:
        load_rig("emulatd")
    assert "Did you mean `emulated`?" in str(caught.value)
    assert "sim, thing" in str(caught.value)
    with pytest.raises(ConfigError, match="no such rig file"):
        load_rig("missing/rig.toml")


def test_extends_another_file_and_never_itself(tmp_path):
    write(tmp_path / "base.toml", 'extends = "emulated"\nname = "base"\n[control]\nk_f = 0.15\n')
    child = write(tmp_path / "child.toml", 'extends = "base.toml"\n[control]\nk_y_rad_per_m = 0.25\n')
    rig = load_rig(child)
    assert (rig.name, rig.control.k_f, rig.control.k_y_rad_per_m) == ("base", 0.15, 0.25)
    write(tmp_path / "base.toml", 'extends = "child.toml"\n')
    with pytest.raises(ConfigError, match="extends itself"):
        load_rig(child)


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    rig = tmp_path / "bom.toml"
    rig.write_text('extends = "emulated"\nname = "bom"\n', encoding="utf-8-sig")
    assert load_rig(rig).name == "bom"


def test_directory_and_binary_are_sentences(tmp_path):
    binary = tmp_path / "b.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="cannot read"):
        load_rig(binary)
    with pytest.raises(ConfigError, match="no such rig file"):
        load_rig(tmp_path / "nothing.toml")


def test_defaults_are_the_agreed_ones():
    control = ControlConfig()
    assert (control.push_speed_m_per_s, control.k_f, control.k_y_rad_per_m) == (0.1, 0.3, 0.2)
    assert math.isclose(load_rig("emulated").loop.rate_hz, 100.0)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("k_f=0.1", "unknown key `k_f`, did you mean `control.k_f`?"),
        ("direction_deg=3", "did you mean `path.direction_deg`?"),
        ("topics.command=/x", "did you mean `base.topics.command`?"),
        ("level=sim", "did you mean `ft.level`, `arm.level` or `base.level`?"),
        ("control.direction_deg=3", "did you mean `path.direction_deg`?"),
        ("kf=0.1", "did you mean `control.k_f`?"),
        ("friktion=0.1", "unknown key `friktion`"),
    ],
)
def test_a_bare_key_suggests_its_whole_name(setting, words):
    with pytest.raises(ConfigError) as caught:
        load_rig("emulated", [setting])
    assert words in str(caught.value)
