"""Force signs and axes on both sides of the sensor, against numbers worked out on paper.

The mounting of the shipped rigs, a = pi/2 - 1.3100 rad, sin a = 0.2578500, cos a = 0.9661850; the sensor's axes
in the base's frame (x forward, y left, z up) are
    X = (0, sin a, cos a)     mostly up
    Y = (0, -cos a, sin a)    to the right
    Z = (1, 0, 0)             forward
so a vector (x, y, z) of the base reads (sin a y + cos a z, -cos a y + sin a z, x) in the sensor. The sensor
measures the reaction on the tool: minus the force on the object.
"""

from __future__ import annotations

import math
import struct
from itertools import combinations

import libscrc
import pytest
from msgspec.structs import replace

import control.wrench
import sim_backend.world.sensor_model
from control.ft_input import ft_input
from control.settings import Settings
from control.step import step
from robot_io.ft300.codec import StreamParser, wrench_from_counts
from robot_io.ft300.driver import Ft300
from robot_io.messages import Pose2D, Stamped
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlState, FtReading, TickInput
from sim_backend.physics.contact_outcome import ContactMode, ContactOutcome
from sim_backend.world.world import World
from tests.mutants import sign_mutants
from tools.rig import resolve_rig

SIN_A, COS_A = 0.2578500, 0.9661850
MOUNTING = ((0.0, 0.0, 1.0), (SIN_A, -COS_A, 0.0), (COS_A, SIN_A, 0.0))
"""Rows of base_from_sensor: the columns are X, Y and Z above."""

SKEW = ((2 / 3, -1 / 3, 2 / 3), (2 / 3, 2 / 3, -1 / 3), (-1 / 3, 2 / 3, 2 / 3))
"""A mounting without a zero in it, for the signs that the shipped one multiplies by nothing. Axes in the base:
X = (2, 2, -1)/3, Y = (-1, 2, 2)/3, Z = (2, -1, 2)/3."""

BIAS = (-20.68, 21.95, -48.70, -0.097, 1.172, -0.321)
QUARTER = math.pi / 2

# name, force on the slider in the world (N), heading of the base (rad), contact point and sensor origin in the
# base (m), the six raw numbers without bias and tool weight (N, N*m).
CASES = {
    # Straight ahead. Reaction (-15, 0, 0) in the base -> (0, 0, -15). The lever (0.20, 0, 0) is along it: no moment.
    "ahead": ((15.0, 0.0), 0.0, (1.05, 0.0), (0.85, 0.0, 0.15), (0.0, 0.0, -15.0, 0.0, 0.0, 0.0)),
    # The same push with robot and path turned by 90 degrees to the left: the sensor turns with them.
    "ahead, turned left": ((0.0, 15.0), QUARTER, (1.05, 0.0), (0.85, 0.0, 0.15), (0.0, 0.0, -15.0, 0.0, 0.0, 0.0)),
    # 10 N to the left (+y) on the slider as well: reaction (-15, -10, 0).
    #   force: (sin a (-10), -cos a (-10), -15) = (-2.578500, 9.661850, -15)
    #   moment: (0.2, 0, 0) x (-15, -10, 0) = (0, 0, 0.2 (-10)) = (0, 0, -2)
    #           -> (cos a (-2), sin a (-2), 0) = (-1.932370, -0.515700, 0)
    "lateral": (
        (15.0, 10.0),
        0.0,
        (1.05, 0.0),
        (0.85, 0.0, 0.15),
        (-2.578500, 9.661850, -15.0, -1.932370, -0.515700, 0.0),
    ),
    # Robot turned left, force on the slider along world +x, which is the robot's right (0, -15, 0):
    # reaction (0, 15, 0) -> (15 sin a, -15 cos a, 0) = (3.867750, -14.492775, 0)
    #   moment: (0.2, 0, 0) x (0, 15, 0) = (0, 0, 3) -> (3 cos a, 3 sin a, 0) = (2.898555, 0.773550, 0)
    "sideways, turned left": (
        (15.0, 0.0),
        QUARTER,
        (1.05, 0.0),
        (0.85, 0.0, 0.15),
        (3.867750, -14.492775, 0.0, 2.898555, 0.773550, 0.0),
    ),
    # Every part of the lever: sensor 0.1 m above the ball, contact 3 cm left: lever (0.19, 0.03, -0.10),
    # reaction (-15, -10, 0):
    #   ry Fz - rz Fy = 0 - (-0.10)(-10)          = -1
    #   rz Fx - rx Fz = (-0.10)(-15) - 0          =  1.5
    #   rx Fy - ry Fx = 0.19 (-10) - 0.03 (-15)   = -1.45
    #   -> (1.5 sin a - 1.45 cos a, -1.5 cos a - 1.45 sin a, -1) = (-1.014193, -1.823160, -1)
    "lever": (
        (15.0, 10.0),
        0.0,
        (1.04, 0.03),
        (0.85, 0.0, 0.25),
        (-2.578500, 9.661850, -15.0, -1.014193, -1.823160, -1.0),
    ),
    # Robot turned by 30 degrees (cos 0.8660254, sin 0.5), force on the slider (10, -6):
    #   in the base: (10 c - 6 s, -6 c - 10 s) = (5.660254, -10.196152); reaction (-5.660254, 10.196152, 0)
    #   force: (10.196152 sin a, -10.196152 cos a, -5.660254) = (2.629078, -9.851369, -5.660254)
    #   moment: (0.2, 0, 0) x reaction = (0, 0, 2.039230) -> (1.970274, 0.525816, 0)
    "turned by 30 degrees": (
        (10.0, -6.0),
        math.pi / 6,
        (1.05, 0.0),
        (0.85, 0.0, 0.15),
        (2.629078, -9.851369, -5.660254, 1.970274, 0.525816, 0.0),
    ),
}


def rig_with(sensor_origin, mounting=MOUNTING, *, tool_mass_kg=0.0, bias=(0.0,) * 6) -> RigConfig:
    rig = resolve_rig("sim")
    frames = replace(rig.frames, base_from_sensor=mounting, sensor_in_base_m=sensor_origin)
    sensor = replace(
        rig.world.sensor,
        bias=bias,
        tool_mass_kg=tool_mass_kg,
        tool_com_in_sensor_m=(0.01, 0.02, 0.06),
        noise_force_N=0.0,
        noise_torque_Nm=0.0,
    )
    return replace(rig, frames=frames, world=replace(rig.world, sensor=sensor))


def world_side_is_right(module=sim_backend.world.sensor_model, mounting=MOUNTING) -> bool:
    for force, yaw, contact, origin, raw in CASES.values():
        model = module.SensorModel(rig_with(origin, mounting), 0)
        if model.true_reading(force, contact, yaw) != pytest.approx(raw, abs=2e-6):
            return False
    # 0.6 kg at (0.01, 0.02, 0.06) m of the sensor: weight (0, 0, -5.886) N
    #   force: (-5.886 cos a, -5.886 sin a, 0) = (-5.686965, -1.517705, 0)
    #   moment: (cy Fz - cz Fy, cz Fx - cx Fz, cx Fy - cy Fx)
    #         = (0.06 x 1.517705, 0.06 x -5.686965, 0.01 x -1.517705 + 0.02 x 5.686965) = (.091062, -.341218, .098562)
    by_hand = (-5.686965, -1.517705, 0.0, 0.091062, -0.341218, 0.098562)
    # Skewed: weight (0, 0, -5.886) -> (1.962, -3.924, -3.924)
    #   moment: (0.02 (-3.924) + 0.06 (3.924), 0.06 (1.962) + 0.01 (3.924), -0.01 (3.924) - 0.02 (1.962))
    skewed = (1.962, -3.924, -3.924, 0.15696, 0.15696, -0.07848)
    for how, wanted in ((mounting, by_hand), (SKEW, skewed)):
        weighed = module.SensorModel(rig_with((0.85, 0.0, 0.15), how, tool_mass_kg=0.6, bias=BIAS), 0)
        with_bias = [a + b for a, b in zip(wanted, BIAS, strict=True)]
        if weighed.true_reading((0.0, 0.0), (1.05, 0.0), 0.4) != pytest.approx(with_bias, abs=2e-6):
            return False
    # Skewed, 9 N ahead and 3 N left on the slider: reaction (-9, -3, 0)
    #   force: ((-18 - 6)/3, (9 - 6)/3, (-18 + 3)/3) = (-8, 1, -5)
    #   sensor at (0.8, -0.1, 0.3), contact at (1.0, 0.2) 0.15 m high: lever (0.2, 0.3, -0.15)
    #   moment: (-(-0.15)(-3), (-0.15)(-9), 0.2 (-3) - 0.3 (-9)) = (-0.45, 1.35, 2.1)
    #   -> ((-0.9 + 2.7 - 2.1)/3, (0.45 + 2.7 + 4.2)/3, (-0.9 - 1.35 + 4.2)/3) = (-0.1, 2.45, 0.65)
    model = module.SensorModel(rig_with((0.8, -0.1, 0.3), SKEW), 0)
    found = model.true_reading((9.0, 3.0), (1.0, 0.2), 0.0)
    if found != pytest.approx((-8.0, 1.0, -5.0, -0.1, 2.45, 0.65), abs=1e-9):
        return False
    # A hand on the ball, (-10, 5, 2) N in the base: it acts on the tool, so there is no minus.
    #   force: (5 sin a + 2 cos a, -5 cos a + 2 sin a, -10) = (3.221620, -4.315225, -10)
    #   sensor at (0.9, 0.1, 0.25), ball at (1.0, 0, 0.15): lever (0.1, -0.1, -0.1)
    #   moment: ((-0.1) 2 - (-0.1) 5, (-0.1)(-10) - 0.1 (2), 0.1 (5) - (-0.1)(-10)) = (0.3, 0.8, -0.5)
    #   -> (0.8 sin a - 0.5 cos a, -0.8 cos a - 0.5 sin a, 0.3) = (-0.276813, -0.901873, 0.3)
    pressed = module.SensorModel(rig_with((0.9, 0.1, 0.25), mounting), 0).with_hand((0.0,) * 6, (-10.0, 5.0, 2.0))
    return pressed == pytest.approx((3.221620, -4.315225, -10.0, -0.276813, -0.901873, 0.3), abs=2e-6)


def driver_side_is_right(module=control.wrench, mounting=MOUNTING) -> bool:
    for force, yaw, _, _, raw in CASES.values():
        reading = tuple(r + b for r, b in zip(raw[:3], BIAS[:3], strict=True))
        found = module.force_on_slider_world(reading, BIAS[:3], mounting, yaw)
        if found != pytest.approx((*force, 0.0), abs=5e-6):
            return False
    # Pressing down on the object with 4 N: reaction (0, 0, 4) in the base -> (4 cos a, 4 sin a, 0).
    pressed = module.force_on_slider_world((3.864740, 1.031400, 0.0), (0.0, 0.0, 0.0), mounting, 1.0)
    if pressed != pytest.approx((0.0, 0.0, -4.0), abs=5e-6):
        return False
    # Skewed: (-8, 1, -5) is 9 N ahead and 3 N left (worked out above), and 6 N down is the reaction (0, 0, 6),
    # which reads (-2, 4, 4).
    ahead = module.force_on_slider_world((-8.0, 1.0, -5.0), (0.0, 0.0, 0.0), SKEW, 0.0)
    down = module.force_on_slider_world((-2.0, 4.0, 4.0), (0.0, 0.0, 0.0), SKEW, 0.0)
    return ahead == pytest.approx((9.0, 3.0, 0.0), abs=1e-9) and down == pytest.approx((0.0, 0.0, -6.0), abs=1e-9)


def test_the_shipped_mounting_is_the_one_of_the_hand_calculation():
    assert sum(resolve_rig("emulated").frames.base_from_sensor, ()) == pytest.approx(sum(MOUNTING, ()), abs=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_the_simulated_sensor_reads_the_hand_numbers(name):
    force, yaw, contact, origin, raw = CASES[name]
    model = sim_backend.world.sensor_model.SensorModel(rig_with(origin), 0)
    assert model.true_reading(force, contact, yaw) == pytest.approx(raw, abs=2e-6)


def test_the_simulated_sensor_adds_bias_and_tool_weight():
    assert world_side_is_right()


def test_the_world_gives_the_sensor_the_place_of_the_contact_as_the_turned_robot_sees_it():
    """The case "lever" with the robot turned left: ahead is world +y, left is world -x."""
    force, _, contact, origin, raw = CASES["lever"]
    rig = rig_with(origin)
    world = World(replace(rig, path=replace(rig.path, direction_deg=90.0)), 0, 0)
    base = world.read_base(0).pose
    assert base.yaw == pytest.approx(QUARTER)
    world._contact = ContactOutcome(
        ContactMode.STICKING, -force[1], force[0], contact_x=base.x - contact[1], contact_y=base.y + contact[0]
    )
    assert world.read_ft(0) == pytest.approx(raw, abs=2e-6)


@pytest.mark.parametrize("name", CASES)
def test_control_finds_the_force_on_the_slider_from_the_hand_numbers(name):
    force, yaw, _, _, raw = CASES[name]
    found = control.wrench.force_on_slider_world(raw[:3], (0.0, 0.0, 0.0), MOUNTING, yaw)
    assert found == pytest.approx((*force, 0.0), abs=5e-6)


def test_control_removes_the_bias_and_keeps_the_vertical():
    assert driver_side_is_right()


@pytest.mark.parametrize("name", CASES)
def test_the_whole_step_finds_the_force_and_rotates_by_the_measured_yaw(name):
    """Through `step`, with the bias of a tare: it is the pose's heading that turns the force, not the path's."""
    force, yaw, _, _, raw = CASES[name]
    rig = rig_with((0.85, 0.0, 0.15))
    settings = Settings.of(replace(rig, control=replace(rig.control, force_filter_tau_s=0.0)))
    state = ControlState(phase=2, tared=True, bias_force=BIAS[:3], bias_torque=BIAS[3:], last_reading_ns=1)
    reading = FtReading(2, 1, tuple(r + b for r, b in zip(raw[:3], BIAS[:3], strict=True)), raw[3:])
    inp = good_input(reading, yaw)
    after, _ = step(settings, state, inp)
    assert after.force_valid
    assert after.force_world == pytest.approx((*force, 0.0), abs=5e-6)


def test_from_the_bytes_of_the_sensor_to_the_force_no_axis_changes_place():
    """The case "lateral" (six different numbers) as a packet: through codec, loop and step to (15, 10)."""
    raw = tuple(r + b for r, b in zip(CASES["lateral"][4], BIAS, strict=True))
    body = b"\x20\x4e" + struct.pack("<3h", *(round(100 * r) for r in raw[:3]))
    body += struct.pack("<3h", *(round(1000 * r) for r in raw[3:]))
    (counts,) = StreamParser().feed(body + struct.pack("<H", libscrc.modbus(body)))
    given = ft_input([Stamped(wrench_from_counts(counts), 1, 2)], Ft300("/dev/none").health(), 1)
    (reading,) = given.readings
    assert (*reading.force, *reading.torque) == pytest.approx(raw, abs=0.0051)
    assert reading.torque == pytest.approx(raw[3:], abs=0.00051)
    rig = rig_with((0.85, 0.0, 0.15))
    settings = Settings.of(replace(rig, control=replace(rig.control, force_filter_tau_s=0.0)))
    state = ControlState(phase=2, tared=True, bias_force=BIAS[:3], bias_torque=BIAS[3:], last_reading_ns=1)
    after, _ = step(settings, state, good_input(reading, 0.0))
    assert after.force_world == pytest.approx((15.0, 10.0, 0.0), abs=0.011)


def good_input(reading: FtReading, yaw: float) -> TickInput:
    from tests.safety.fold_bench import FoldBench

    inp = FoldBench().good_input()
    base = replace(inp.base, pose=Pose2D(0.0, 0.0, yaw))
    return replace(inp, now_ns=3, ft=replace(inp.ft, readings=(reading,)), base=base)


# --- the test of the tests: one wrong sign, one wrong axis ---------------------------------------------------


def wrong_mountings():
    for axis in range(3):
        yield (
            f"sensor axis {'XYZ'[axis]} reversed",
            tuple(tuple(-v if c == axis else v for c, v in enumerate(row)) for row in MOUNTING),
        )
        yield (
            f"base axis {'xyz'[axis]} reversed",
            tuple(tuple(-v for v in row) if r == axis else row for r, row in enumerate(MOUNTING)),
        )
    for i, j in combinations(range(3), 2):
        order = [0, 1, 2]
        order[i], order[j] = j, i
        yield f"sensor axes {'XYZ'[i]} and {'XYZ'[j]} swapped", tuple(tuple(row[c] for c in order) for row in MOUNTING)
        yield f"base axes {'xyz'[i]} and {'xyz'[j]} swapped", tuple(MOUNTING[r] for r in order)
    yield "transposed", tuple(zip(*MOUNTING, strict=True))


WRONG_MOUNTINGS = dict(wrong_mountings())


@pytest.mark.parametrize("name", WRONG_MOUNTINGS)
def test_a_reversed_or_swapped_axis_shows_on_either_side(name):
    assert not world_side_is_right(mounting=WRONG_MOUNTINGS[name])
    assert not driver_side_is_right(mounting=WRONG_MOUNTINGS[name])


DRIVER_SIGNS = sign_mutants("control.wrench", "force_on_slider_world")
WORLD_SIGNS = sign_mutants(
    "sim_backend.world.sensor_model",
    *("__init__", "turn_to", "true_reading", "with_hand", "_in_sensor", "_cross", "_sum6"),
)


@pytest.mark.parametrize("make", [m for _, m in DRIVER_SIGNS], ids=[name for name, _ in DRIVER_SIGNS])
def test_one_wrong_sign_in_control_shows(make):
    assert not driver_side_is_right(make())


@pytest.mark.parametrize("make", [m for _, m in WORLD_SIGNS], ids=[name for name, _ in WORLD_SIGNS])
def test_one_wrong_sign_in_the_simulated_sensor_shows(make):
    assert not world_side_is_right(make())


def test_there_are_signs_to_get_wrong():
    assert len(DRIVER_SIGNS) >= 12
    assert len(WORLD_SIGNS) >= 20
