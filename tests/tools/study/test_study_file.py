"""What the file of a study may say, and which pushes come of it."""

import msgspec
import pytest

from robot_io.errors import ConfigError
from robot_io.rig.config import rig_from_toml
from tools.study.pushes import combinations, draws, pushes_of, text
from tools.study.study_file import find_study, load_study, read_study, shipped_studies


def study(text, folder="/nowhere"):
    return read_study(f'[study]\nname = "s"\n{text}', "s.toml", folder)


def test_a_grid_is_every_combination_the_last_axis_and_the_seed_fastest():
    found = study('seeds = 2\n[axes]\ncontrol.k_f = [0.1, 0.3]\n"control.law" = ["force", "line"]')
    pushes = pushes_of(found)
    assert [push.run for push in pushes] == list(range(8))
    assert [(push.axes["control.k_f"], push.axes["control.law"], push.seed) for push in pushes] == [
        (k, law, seed) for k in ("0.1", "0.3") for law in ("force", "line") for seed in (0, 1)
    ]
    rig = rig_from_toml(pushes[-1].rig)
    assert (rig.control.k_f, rig.control.law, rig.ft.level) == (0.3, "line", "sim")


def test_a_zip_is_side_by_side():
    found = study('mode = "zip"\n[axes]\ncontrol.k_f = [0.1, 0.3]\ncontrol.distance_m = [1.0, 2.0]')
    assert list(combinations(found)) == [
        {"control.k_f": 0.1, "control.distance_m": 1.0},
        {"control.k_f": 0.3, "control.distance_m": 2.0},
    ]


def test_each_seed_draws_the_same_for_every_law_and_whatever_other_axes_there_are():
    one = study(
        'mode = "random"\nseeds = 40\n[axes]\ncontrol.law = ["force", "line"]\nworld.start.heading_deg = [-3, 5]'
    )
    more = study(
        'mode = "random"\nseeds = 40\n[axes]\nworld.start.lateral_offset_m = [-0.1, 0.1]\n'
        "world.start.heading_deg = [-3, 5]\nworld.truth.sensor_yaw_deg = { one_of = [-1.0, 1.0] }"
    )
    drawn = [draws(one, seed)["world.start.heading_deg"] for seed in one.seeds]
    assert drawn == [draws(more, seed)["world.start.heading_deg"] for seed in more.seeds]
    assert all(-3 <= value <= 5 for value in drawn)
    assert len(set(drawn)) == 40
    assert {draws(more, seed)["world.truth.sensor_yaw_deg"] for seed in more.seeds} == {-1.0, 1.0}
    assert len(list(combinations(one))) == 2


def test_an_axis_may_be_a_table_or_a_list():
    found = study(
        "[axes]\nworld.slider = [{ shape = 'circle', radius_m = 0.2 }, { width_m = 0.6 }]\n"
        "world.hand = [[], [{ at_s = 6.0, for_s = 9.0, force_body_N = [0.0, 0.1, 0.0] }]]"
    )
    pushes = pushes_of(found)
    assert pushes[0].axes["world.slider"] == "shape=circle radius_m=0.2"
    rigs = [rig_from_toml(push.rig) for push in pushes]
    assert [(rig.world.slider.shape, rig.world.slider.width_m) for rig in rigs[1:3]] == [
        ("circle", 0.4),
        ("rectangle", 0.6),
    ]
    assert rigs[1].world.hand[0].force_body_N == (0.0, 0.1, 0.0)


def test_any_rig_is_simulated_also_one_of_hardware():
    [push] = pushes_of(study('rig = "thing"'))
    rig = rig_from_toml(push.rig)
    assert {rig.ft.level, rig.arm.level, rig.base.level} == {"sim"}


def test_a_rig_beside_the_study_is_found(tmp_path):
    (tmp_path / "mine.toml").write_text('extends = "sim"\nname = "mine"\n[control]\nk_f = 0.7\n')
    [push] = pushes_of(study('rig = "mine.toml"', str(tmp_path)))
    assert rig_from_toml(push.rig).control.k_f == 0.7


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("seeds = 0", "seeds"),
        ("seeds = [1, 1]", "different"),
        ('mode = "all"', "grid, random, zip"),
        ("sedes = 3", "seeds"),
        ("[axes]\ncontrol.k_f = 0.1", "list"),
        ("[axes]\ncontrol.k_f = []", "list"),
        ('mode = "zip"\n[axes]\ncontrol.k_f = [0.1]\ncontrol.distance_m = [1.0, 2.0]', "one length"),
        ('mode = "random"\n[axes]\ncontrol.k_f = [0.3, 0.1]', "range"),
        ('mode = "random"\n[axes]\ncontrol.k_f = { one_of = [] }', "one_of"),
        ('law = "line"\n[axes]\n"control.law" = ["force"]', "twice"),
        ("[settings]\ncontrol.k_f = 0.1\n[axes]\ncontrol.k_f = [0.2]", "Leave one out"),
        ("seeds = 1000000\n[axes]\ncontrol.k_f = [0.1, 0.2]", "more than"),
    ],
)
def test_a_mistake_in_the_file_is_one_sentence_that_names_it(wrong, told):
    with pytest.raises(ConfigError) as found:
        study(wrong)
    assert told in str(found.value)
    assert "s.toml" in str(found.value)
    assert found.value.exit_code == 2


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("[axes]\ncontrol.k_g = [0.1]", "control.k_g"),
        ("[axes]\ncontrol.k_f = [0.1, 7.0]", "control.k_f = 7.0"),
        ('[axes]\ncontrol.law = ["forse"]', "force"),
        ('rig = "smi"', "sim"),
    ],
)
def test_a_push_that_is_no_rig_is_refused_with_its_values(wrong, told):
    with pytest.raises(ConfigError) as found:
        pushes_of(study(wrong))
    assert told in str(found.value)
    assert len(str(found.value).splitlines()) == 1


def test_cells_are_plain():
    assert [text(value) for value in (0.1, 3, True, "x", [1, "a"], {"a": 1.5, "b": {"c": "d"}})] == [
        "0.1", "3", "true", "x", '[1, "a"]', "a=1.5 b.c=d",
    ]  # fmt: skip


@pytest.mark.parametrize("name", shipped_studies())
def test_every_shipped_study_is_one(name):
    found = load_study(find_study(name))
    assert found.name == name
    assert found.axes


def test_the_experiments_start_as_far_out_as_the_paper_never_did():
    # 0.8 of half the box's width of 0.6 m, and of the barrel's radius of 0.25 m; the same starts for each law
    for name, outermost in (("experiment-box", 0.24), ("experiment-barrel", 0.2)):
        pushes = pushes_of(msgspec.structs.replace(load_study(find_study(name)), seeds=(0,)))
        starts = {}
        for push in pushes:
            rig = rig_from_toml(push.rig)
            assert (rig.control.k_f, rig.control.k_y_rad_per_m, rig.control.distance_m) == (0.1, 0.3, 6.0)
            assert rig.world.floor.patch_strength > 0
            starts.setdefault(rig.control.law, []).append(rig.world.start)
        assert len(starts) >= 4
        assert all(found == starts["force"] for found in starts.values())
        assert max(start.edge_offset_m for start in starts["force"]) == outermost
        assert min(start.edge_offset_m for start in starts["force"]) == -outermost


def test_a_near_name_is_offered():
    with pytest.raises(ConfigError, match="floors"):
        find_study("floor")
