"""The shipped rigs: their levels, addresses, scene, and the frames that follow from the held pose."""

import json
import math

import msgspec
import numpy as np
import pytest

from robot_io.errors import ConfigError
from robot_io.rig.config import load_rig
from robot_io.rig.files import shipped_rigs
from tools.rig import resolve_rig

# Denavit-Hartenberg parameters of the UR10 (Universal Robots' published table): d, a in m, alpha in rad.
UR10_D = (0.1273, 0.0, 0.0, 0.163941, 0.1157, 0.0922)
UR10_A = (0.0, -0.612, -0.5723, 0.0, 0.0, 0.0)
UR10_ALPHA = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)


def flange_rotation(joints):
    rotation = np.eye(3)
    for angle, twist in zip(joints, UR10_ALPHA, strict=True):
        c, s, ca, sa = math.cos(angle), math.sin(angle), math.cos(twist), math.sin(twist)
        rotation = rotation @ np.array([[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0.0, sa, ca]])
    return rotation


def test_shipped_names():
    assert {"sim", "emulated", "thing", "paper-gains", "barrel"} <= set(shipped_rigs())


@pytest.mark.parametrize("name", shipped_rigs())
def test_every_shipped_rig_resolves_under_its_own_name(name):
    assert resolve_rig(name).name == name


@pytest.mark.parametrize("name", shipped_rigs())
def test_sensor_axes_follow_from_the_held_pose(name):
    rig = load_rig(name)
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # arm mounted turned by +90 degrees
    expected = turned @ flange_rotation(rig.arm.held_pose_rad)
    # The pose is given to four decimals, so the axes agree to about 1e-5.
    np.testing.assert_allclose(np.array(rig.frames.base_from_sensor), expected, atol=2e-5)


@pytest.mark.parametrize("name", shipped_rigs())
def test_sensor_axes_by_hand(name):
    axes = np.array(load_rig(name).frames.base_from_sensor).T
    a = math.pi / 2 - 1.3100
    np.testing.assert_allclose(axes[0], (0.0, math.sin(a), math.cos(a)), atol=1e-9)
    np.testing.assert_allclose(axes[1], (0.0, -math.cos(a), math.sin(a)), atol=1e-9)
    np.testing.assert_allclose(axes[2], (1.0, 0.0, 0.0), atol=1e-9)


def test_sim_is_the_same_scene_as_emulated():
    sim, emulated = (msgspec.to_builtins(load_rig(name)) for name in ("sim", "emulated"))
    for table in ("frames", "path", "control", "limits", "world", "loop"):
        assert sim[table] == emulated[table]
    assert [sim[device].pop("level") for device in ("ft", "arm", "base")] == ["sim"] * 3
    assert [emulated[device].pop("level") for device in ("ft", "arm", "base")] == ["emulated"] * 3
    assert [sim[d] for d in ("ft", "arm", "base")] == [emulated[d] for d in ("ft", "arm", "base")]


def test_thing_is_the_authors_robot_and_all_hardware():
    rig = load_rig("thing")
    assert {rig.ft.level, rig.arm.level, rig.base.level} == {"hardware"}
    assert (rig.arm.host, rig.base.url) == ("192.168.131.40", "ws://192.168.131.1:9090")
    assert rig.ft.port.startswith("/dev/serial/by-id/")


def test_lab_scene_needs_about_15_newton():
    slider = load_rig("emulated").world.slider
    assert slider.mass_kg * 9.81 * slider.floor_friction == pytest.approx(15.0, abs=0.1)
    start = load_rig("emulated").world.start
    assert (start.lateral_offset_m, start.edge_offset_m, start.heading_deg, start.gap_m) == (0.05, 0.03, 3.0, 0.05)


def test_paper_gains():
    control = load_rig("paper-gains").control
    assert (control.k_f, control.k_y_rad_per_m) == (0.1, 0.3)


@pytest.mark.parametrize(
    ("rig", "overrides", "words"),
    [
        ("sim", ["base.level=emulated"], "all three devices or none"),
        ("emulated", ["ft.level=sim"], "ft would be sim and arm and base not"),
        ("emulated", ["ft.level=hardware"], "`ft.port` is missing"),
        ("thing", ['arm.host=""', 'base.url=""'], "`arm.host` is missing, and arm is at level hardware; `base.url`"),
        ("thing", ["base.url=http://127.0.0.1:9090"], "does not start with ws://"),
        ("emulated", ["frames.base_from_sensor=[[1,0,0],[0,1,0],[0,0,-1]]"], "not a rotation"),
        ("emulated", ["frames.base_from_sensor=[[1,0,0],[0,1,0.001],[0,0,1]]"], "not a rotation"),
        ("emulated", ["limits.max_force_N=151"], "above the ceiling"),
        ("ur10e-emulated", ["limits.max_force_N=91"], "above 90 N, 0.9 of the range of the sensor's weakest axis"),
        ("ur10e-emulated", ["limits.max_torque_Nm=9.5"], "above 9 N*m"),
        ("emulated", ["ft.kind=ur-tool-force"], "`ft.options.model` is missing"),
        ("ur10e-emulated", ["ft.options.model=UR10"], "UR10 is none: a CB3 arm only estimates forces"),
        ("ur10e-emulated", ["ft.port=/dev/ttyUSB0"], "`ft.port` is not needed: ur-tool-force is at `arm.host`"),
        ("ur10e-emulated", ["arm.level=hardware", "arm.host=127.0.0.9"], "`ft.level` must be the arm's, 'hardware'"),
    ],
)
def test_contradictions_are_one_sentence(rig, overrides, words):
    with pytest.raises(ConfigError) as caught:
        resolve_rig(rig, overrides)
    assert words in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(("model", "range_N"), [("UR3e", 30.0), ("UR5e", 50.0), ("UR10e", 100.0), ("UR16e", 160.0)])
def test_the_range_of_an_arms_own_sensor_is_its_models(model, range_N):
    """From the user manuals; the rig's limits then must be within it."""
    lower = ["limits.max_force_N=25", "limits.slow_force_N=20"]
    rig = resolve_rig("ur10e-emulated", [f"ft.options.model={model}", *lower])
    assert rig.ft.declared.range == (range_N,) * 3 + (10.0,) * 3
    assert rig.ft.declared.rate_hz == 500.0


def test_an_arms_own_sensor_is_at_the_arm():
    rig = resolve_rig("ur10e-emulated", ["ft.level=hardware", "arm.level=hardware", "arm.host=127.0.0.9"])
    assert rig.ft.port == "127.0.0.9"


def test_hardware_and_emulated_mix():
    rig = resolve_rig("thing", ["base.level=emulated"])
    assert (rig.ft.level, rig.base.level) == ("hardware", "emulated")


@pytest.mark.parametrize("name", ["../../x", "/abs", "a/b", "", ".", "..", "a\nb", "-rf", "x" * 65])
def test_a_rig_whose_name_is_no_name_is_refused(name):
    with pytest.raises(ConfigError, match="is not a name"):
        resolve_rig("emulated", [f"name={json.dumps(name)}"])


@pytest.mark.parametrize("name", ["thing", "our lab-2", "paper_gains", "Pr\u00fcfstand 1.5", "x" * 64])
def test_a_name_may_have_spaces_and_letters_of_any_language(name):
    assert resolve_rig("emulated", [f"name={json.dumps(name)}"]).name == name
