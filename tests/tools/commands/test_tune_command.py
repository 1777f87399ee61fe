"""`push tune`: region, recommendation, costs, map, refusals; and what `push run` warns about."""

import json

import pytest

from robot_io.errors import ConfigError
from robot_io.rig.config import load_rig
from sim_backend.physics.gain_limits import PushedBody, limit
from tools import cli
from tools.terminal.gain_warning import gain_margin, gain_warning


def tune(capsys, *argv):
    code = cli.main(["tune", *map(str, argv), "--json"])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return code, json.loads(out.splitlines()[-1]), err


HEIGHT = ("--push-height-m", "0.15")


def test_a_recommendation_with_its_margin_costs_and_map(tmp_path, capsys):
    """By hand for the box of 0.5 m: 0.3 x 0.2 / (0.25^2 / 3 - 0.045^2 + 0.25 x 0.295); the ellipsoid has d 0.1913 m."""
    code, result, err = tune(capsys, "--out", tmp_path / "out", "--no-check", *HEIGHT)
    assert code == 0
    assert result["limit_k_y_rad_per_m"] == pytest.approx(0.6482, abs=1e-4)
    assert result["pessimistic_limit_k_y_rad_per_m"] == pytest.approx(0.5438, abs=1e-4)
    assert result["recommended"] == {"k_f": 0.3, "k_y_rad_per_m": 0.32}
    assert result["margin"] == pytest.approx(0.6482 / 0.32, abs=1e-3)
    assert result["offset_m_per_degree"] == pytest.approx(1.3 / 0.32 * 0.0174533, rel=1e-5)
    assert result["offset_m_per_newton"] == pytest.approx(1.3 / 0.32 / 15)
    assert "the pessimistic limit is 0.544 rad/m" in err
    assert "k_y as a share of its limit (1 is the edge of stability):" in err
    assert result["checks_passed"] is None
    for name in result["files"]:
        assert (tmp_path / "out" / name).stat().st_size > 5000
    shares = {preset["name"]: preset["share_of_limit"] for preset in result["presets"]}
    assert shares["rig emulated"] == pytest.approx(0.3085, abs=1e-4)
    assert shares["paper, hardware"] > 1 > shares["paper, simulation"]


def test_an_interrupt_leaves_no_empty_folder(tmp_path, monkeypatch):
    def interrupt(*_args):
        raise KeyboardInterrupt

    monkeypatch.setattr("tools.sweep.limit_checks.check_limits", interrupt)
    assert cli.main(["tune", "--out", str(tmp_path / "out")]) == 130
    assert not (tmp_path / "out").exists()


def test_pressure_at_the_corners_leaves_the_shipped_gains_their_margin(tmp_path, capsys):
    """By hand for the box of 0.7 m: d^2 is 0.35^2 - 0.045^2 along the push and twice 0.35^2 by the ellipsoid."""
    _, result, _ = tune(
        capsys, "--out", tmp_path / "out", "--no-check", "--size-m", "0.3,0.7", "--pressures", "uniform,rim", *HEIGHT
    )
    assert result["limit_k_y_rad_per_m"] == pytest.approx(0.3479, abs=1e-4)
    assert result["pessimistic_limit_k_y_rad_per_m"] == pytest.approx(0.2348, abs=1e-4)
    assert result["recommended"] == {"k_f": 0.3, "k_y_rad_per_m": 0.17}
    [shipped] = [entry for entry in result["presets"] if entry["name"] == "rig emulated"]
    assert shipped["share_of_limit"] == pytest.approx(0.575, abs=0.001)
    assert shipped["share_of_pessimistic_limit"] == pytest.approx(0.85, abs=0.005)


def test_one_slider_gives_its_own_limit(tmp_path, capsys):
    _, result, _ = tune(
        capsys, "--out", tmp_path / "out", "--no-check", "--shapes", "circle", "--size-m", "0.5,0.5",
        "--pressures", "rim", "--floor-friction", "0.3", "--anisotropy", "1.05", *HEIGHT,
    )  # fmt: skip
    # A rim's mean square distance less the lean, and 1 / 1.05 of it: across, friction is less by 1.05^2.
    body = PushedBody(True, 0.25, (0.25**2 / 2 - 0.045**2) ** 0.5 / 1.05, 0.05, 0.045, 1.05)
    assert result["assumed"] == 1
    assert result["limit_k_y_rad_per_m"] == pytest.approx(limit([body], 0.3))
    at = {entry["k_f"]: entry["k_y_rad_per_m"] for entry in result["limits"]}
    assert at[0.1] <= 0 < at[0.12]  # this floor needs k_f above 0.1025
    assert at[0.6] == pytest.approx(limit([body], 0.6))


def test_k_f_stays_clear_of_the_fast_loop(tmp_path, capsys):
    """On its corners a box of 0.7 m lets the force run away from 1.15 on, by the ellipsoid from half that."""
    _, result, err = tune(
        capsys, "--out", tmp_path / "out", "--no-check", "--shapes", "box", "--size-m", "0.7,0.7",
        "--pressures", "corners", "--k-f", "0.8", *HEIGHT,
    )  # fmt: skip
    assert result["fast_loop_k_f"] == pytest.approx(1.1475, abs=1e-4)
    assert result["pessimistic_fast_loop_k_f"] == pytest.approx(0.5643, abs=1e-4)
    assert result["recommended"]["k_f"] == 0.57
    assert "k_f 0.8 is not used" in err
    assert limit([PushedBody(False, 0.35, 0.35, 0.05, 0.045)], 1.01 * result["fast_loop_k_f"]) == 0


def test_tune_the_warning_and_doctor_judge_by_the_same(tmp_path, capsys):
    """A range of the rig binds all three, and so does a value of it that is set for once."""
    words = ("sliders.longest_m=0.9", "world.floor.push_height_m=0.1", "control.k_y_rad_per_m=0.4")
    _, result, _ = tune(
        capsys, "sim", *(w for word in words for w in ("--set", word)), "--no-check", "--out", tmp_path / "out"
    )
    rig = load_rig("sim", words)
    margin = gain_margin(rig)
    assert margin.limit_rad_per_m == result["limit_k_y_rad_per_m"]
    assert margin.pessimistic_rad_per_m == result["pessimistic_limit_k_y_rad_per_m"]
    assert f"{0.4 / result['limit_k_y_rad_per_m']:.2f} of the limit" in gain_warning(rig)


@pytest.mark.long
def test_simulation_agrees_to_a_percent(tmp_path, capsys):
    _, result, err = tune(capsys, "--out", tmp_path / "out", "--anisotropy", "1.03")
    assert result["checks_passed"] is True
    assert len(result["checks"]) == 4
    assert "simulated" in err


def test_the_integral_gets_half_of_its_limit(tmp_path, capsys):
    _, result, err = tune(capsys, "--law", "force-integral", "--no-check", "--out", tmp_path / "out")
    integral = result["integral"]
    assert 0.45 < integral["k_i_rad_per_m2"] / integral["limit_k_i_rad_per_m2"] <= 0.5
    assert "the integral's k_i" in err


@pytest.mark.parametrize(
    ("law", "words"), [("mine:Mine", "push study"), ("line", "no gain of it keeps an object"), ("open-loop", "no gain")]
)
def test_a_law_without_limits_is_refused_in_one_sentence(tmp_path, capsys, law, words):
    code, answer, err = tune(capsys, "--law", law, "--no-check", "--out", tmp_path / "out")
    assert code == 2
    assert words in f"{answer['error']['what']} {answer['error']['do']}"
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    "argv",
    [
        ["--size-m=0.3"],
        ["--size-m=0.7,0.3"],
        ["--size-m=nan,1"],
        ["--shapes=star"],
        ["--pressures="],
        ["--ball-radius-m=-1"],
        ["--anisotropy=0"],
        ["--slide-force-N=inf"],
        ["--k-f=nan"],
        ["--k-f=0"],
        ["--anisotropy=2"],
        ["--push-height-m=10"],
    ],
)
def test_bad_input_is_one_sentence(tmp_path, capsys, argv):
    code, answer, err = tune(capsys, *argv, "--no-check", "--out", tmp_path / "out")
    assert code == 2
    assert answer["error"]["code"] == 2
    assert len(err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_full_folder_is_left_alone(tmp_path, capsys):
    (tmp_path / "mine").write_text("precious")
    code, _, err = tune(capsys, "--no-check", "--out", tmp_path)
    assert code == 2
    assert "not empty" in err
    assert [p.name for p in tmp_path.iterdir()] == ["mine"]


def test_run_warns_of_an_integral_with_little_margin_only():
    assert gain_warning(load_rig("sim", ["control.law=force-integral"])) is None
    told = gain_warning(load_rig("sim", ["control.law=force-integral", "control.law_settings.k_i_rad_per_m2=0.1"]))
    assert told is not None
    assert "k_i 0.1" in told


def test_run_warns_of_gains_with_little_margin_only():
    assert gain_warning(load_rig("sim")) is None
    paper = gain_warning(load_rig("sim", ["control.k_f=0.1", "control.k_y_rad_per_m=0.3"]))
    assert paper is not None
    assert "0.1/0.3" in paper
    assert "\n" not in paper
    assert gain_warning(load_rig("sim", ["control.law=open-loop", "control.k_y_rad_per_m=2"])) is None
    assert gain_warning(load_rig("sim", ["world.slider.shape=circle", "control.k_y_rad_per_m=1.5"])) is not None
    assert all(gain_warning(load_rig(name)) is None for name in ("emulated", "barrel", "thing"))
    assert gain_warning(load_rig("paper-gains")) is not None


def test_run_warns_for_the_whole_range_of_sliders_that_the_rig_assumes():
    """Sticking box of length L, ball R, uniform, at height 0: k_y < k_f (L/2 - R) / (d^2 + L^2/4), d^2 = L^2/12."""
    limit_1m = 0.3 * (0.5 - 0.05) / (1 / 12 + 0.25)
    for share, warned in ((0.68, False), (0.72, True)):
        settings = [f"control.k_y_rad_per_m={share * limit_1m}", "sliders.longest_m=1.0", "world.floor.push_height_m=0"]
        for rig in ("sim", "thing"):
            assert (gain_warning(load_rig(rig, settings)) is not None) == warned
            assert gain_warning(load_rig(rig, settings[:1] + settings[2:])) is None
    simulated = gain_warning(load_rig("sim", ["world.slider.length_m=3", "world.slider.width_m=3"]))
    real = gain_warning(load_rig("thing", ["world.slider.length_m=3", "world.slider.width_m=3"]))
    assert simulated is not None  # no box of the range, but the one that is there
    assert real is None


def test_a_range_of_sliders_upside_down_is_refused(capsys):
    assert cli.main(["run", "sim", "--fast", "--set", "sliders.shortest_m=0.6"]) == 2
    assert "sliders.shortest_m must not be above sliders.longest_m" in capsys.readouterr().err


def test_sliders_that_would_all_tip_over_are_no_reason_to_fail():
    """Pushed at 2 m nothing of the range stays upright: then there is nothing to warn of."""
    assert gain_warning(load_rig("thing", ["world.floor.push_height_m=2"])) is None
    with pytest.raises(ConfigError, match="tips over"):
        gain_warning(load_rig("sim", ["world.floor.push_height_m=2"]))
