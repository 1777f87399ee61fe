"""`[world.truth]`: the world errs against the rig as docs/frames-and-signs.md says, with numbers worked out by hand.

a = pi/2 - 1.3100 rad; a vector (x, y, z) of the base reads (sin a y + cos a z, -cos a y + sin a z, x) in the sensor
that the rig has. 15 N ahead on the object are the reaction (-15, 0, 0). A sensor turned by +3 degrees reads it as the
rig's sensor would read it turned by -3 degrees: (-15 cos 3, 15 sin 3, 0) = (-14.979443, 0.785039, 0).
"""

import json
import math

import pytest
from msgspec.structs import replace

from control.wrench import force_on_slider_world
from robot_io.clock import NS_PER_MS, VirtualClock
from robot_io.messages import BasePose, Pose2D, SliderPose
from robot_io.ridgeback.feeds import FeedReader
from robot_io.ridgeback.rosbridge_codec import Published
from robot_io.rig.world import TruthConfig
from sim_backend.ridgeback.feeds import FeedWriter
from sim_backend.ridgeback.settings import ridgeback_settings
from sim_backend.sim.ridgeback import SimRidgeback
from sim_backend.world.sensor_model import SensorModel
from sim_backend.world.truth import point_of, true_frames
from sim_backend.world.world import World
from tools.rig import resolve_rig

QUIET = ("world.sensor.noise_force_N=0", "world.sensor.noise_torque_Nm=0", "world.sensor.tool_mass_kg=0")
NO_BIAS = "world.sensor.bias=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"
STILL = ("world.mocap_noise_m=0", "world.mocap_noise_deg=0", "world.start.spread=0")


def rig_with(*settings):
    return resolve_rig("sim", [*QUIET, NO_BIAS, *STILL, *settings])


def read_ahead(rig):
    """Return what the sensor reads while 15 N push the object straight ahead, the robot heading along x."""
    return SensorModel(rig, 0).true_reading((15.0, 0.0), (1.0, 0.0), 0.0)


def test_a_sensor_turned_to_the_left_reports_forces_turned_to_the_right():
    rig = rig_with("world.truth.sensor_yaw_deg=3")
    reading = read_ahead(rig)
    assert reading[:3] == pytest.approx((0.202422, -0.758493, -14.979443), abs=2e-6)
    found = force_on_slider_world(reading[:3], (0.0, 0.0, 0.0), rig.frames.base_from_sensor, 0.0)
    assert found == pytest.approx((14.979443, -0.785039, 0.0), abs=2e-6)
    assert math.degrees(math.atan2(found[1], found[0])) == pytest.approx(-3.0, abs=1e-6)


def test_turning_the_rigs_frame_by_as_much_makes_it_right():
    rig = rig_with("world.truth.sensor_yaw_deg=3")
    found = force_on_slider_world(read_ahead(rig)[:3], (0.0, 0.0, 0.0), true_frames(rig).base_from_sensor, 0.0)
    assert found == pytest.approx((15.0, 0.0, 0.0), abs=1e-9)


def test_the_turned_axes_are_those_of_the_hand():
    """Z, forward in the rig, points 3 degrees to the left: (cos 3, sin 3, 0); X stays as high as it was."""
    rows = true_frames(rig_with("world.truth.sensor_yaw_deg=3")).base_from_sensor
    assert [row[2] for row in rows] == pytest.approx((0.998630, 0.052336, 0.0), abs=1e-6)
    assert rows[2] == pytest.approx((0.9661850, 0.2578500, 0.0), abs=1e-6)


def test_the_tools_weight_does_not_show_the_yaw():
    """Gravity is along the axis that the sensor is turned about."""
    plain, turned = (
        SensorModel(resolve_rig("sim", [*QUIET[:2], NO_BIAS, *more]), 0).true_reading((0.0, 0.0), (1.0, 0.0), 0.0)
        for more in ((), ("world.truth.sensor_yaw_deg=3",))
    )
    assert plain == pytest.approx(turned, abs=1e-12)
    assert plain[0] == pytest.approx(-5.686965, abs=2e-6)


@pytest.mark.parametrize("direction_deg", [0.0, 90.0])
def test_the_true_ball_starts_where_the_scene_says_and_the_rig_believes_it_elsewhere(direction_deg):
    """The scene puts the ball 5 cm left of the path; with the rig's contact point it would be 3 cm."""
    path = f"path.direction_deg={direction_deg}"
    rig = rig_with(path, "world.truth.contact_offset_m=[0.01, 0.02]")
    assert true_frames(rig).contact_in_base_m == pytest.approx((1.01, 0.02, 0.15))
    base = World(rig, 0, 0).read_base(0).pose
    straight = World(rig_with(path), 0, 0).read_base(0).pose
    ahead, left = math.cos(math.radians(direction_deg)), math.sin(math.radians(direction_deg))
    assert base.x - straight.x == pytest.approx(-0.01 * ahead + 0.02 * left, abs=1e-12)
    assert base.y - straight.y == pytest.approx(-0.01 * left - 0.02 * ahead, abs=1e-12)


def test_the_marker_is_ahead_left_and_turned():
    """Base at (1, 2) heading along +y: 1 cm ahead is +y, 2 cm to the left is -x."""
    rig = rig_with("world.truth.marker_offset=[0.01, 0.02, 0.1]")
    writer = FeedWriter(1, lambda _: {"secs": 0, "nsecs": 0}, ridgeback_settings(rig, 0).base_from_marker)
    topic = rig.base.topics.base_pose
    message = writer.base_transform(topic, Pose2D(1.0, 2.0, math.pi / 2), 0)
    seen = message["transform"]["translation"]
    assert (seen["x"], seen["y"]) == pytest.approx((0.98, 2.01))
    reader = FeedReader(rig.base.topics, "mocap", Pose2D(*rig.frames.base_from_marker))
    [sample] = reader.read(Published(topic, json.dumps(message).encode()), 0)
    assert sample.value.pose.yaw == pytest.approx(math.pi / 2 + 0.1)


def test_a_rig_that_knows_its_marker_in_part_sees_the_rest():
    """The rig has the marker 20 cm ahead, turned by +90 degrees; it is 1 cm further ahead.

    The base, heading along +y, is then believed 1 cm further ahead than it is.
    """
    rig = rig_with("frames.base_from_marker=[0.2, 0.0, 1.5707963267948966]", "world.truth.marker_offset=[0.01, 0, 0]")
    for level in (emulated_pose, simulated_pose):
        assert level(rig) == pytest.approx((1.0, 2.01, math.pi / 2)), level.__name__


def emulated_pose(rig):
    settings = ridgeback_settings(rig, 0)
    message = FeedWriter(1, lambda _: {"secs": 0, "nsecs": 0}, settings.base_from_marker).base_transform(
        rig.base.topics.base_pose, Pose2D(1.0, 2.0, math.pi / 2), 0
    )
    reader = FeedReader(rig.base.topics, "mocap", Pose2D(*rig.frames.base_from_marker))
    [sample] = reader.read(Published(rig.base.topics.base_pose, json.dumps(message).encode()), 0)
    return sample.value.pose.x, sample.value.pose.y, sample.value.pose.yaw


class Standing(World):
    """A world whose base and object stand where the test wants them."""

    def read_base(self, t_ns):
        pose = Pose2D(1.0, 2.0, math.pi / 2)
        return replace(super().read_base(t_ns), pose=pose, rolled=pose)

    def read_slider(self, t_ns):
        return Pose2D(2.0, 1.0, math.pi / 2)


def simulated(rig, kind, pose_source="mocap"):
    clock = VirtualClock(0)
    base = SimRidgeback(Standing(rig, 0, 0), clock, settings=ridgeback_settings(rig, 0), pose_source=pose_source)
    with base:
        clock.advance_to(100 * NS_PER_MS)
        return next(sample.value.pose for sample in base.drain() if isinstance(sample.value, kind))


def simulated_pose(rig):
    pose = simulated(rig, BasePose)
    return pose.x, pose.y, pose.yaw


def test_a_pose_without_markers_has_no_error_of_theirs():
    rig = rig_with("world.truth.marker_offset=[0.01, 0.02, 0.1]")
    assert simulated(rig, BasePose, "joint_states") == Pose2D(1.0, 2.0, math.pi / 2)
    assert simulated_pose(rig) == pytest.approx((0.98, 2.01, math.pi / 2 + 0.1))


def test_the_objects_point_lies_ahead_of_its_middle():
    rig = rig_with("world.truth.slider_offset_m=[0.1, 0.02]")
    seen = simulated(rig, SliderPose)
    assert (seen.x, seen.y, seen.yaw) == pytest.approx((1.98, 1.1, math.pi / 2))
    assert point_of(Pose2D(2.0, 1.0, 0.3), (0.0, 0.0)) == Pose2D(2.0, 1.0, 0.3)


def test_by_default_there_is_no_error_not_even_of_rounding():
    rig = resolve_rig("sim")
    assert rig.world.truth == TruthConfig()
    assert true_frames(rig) is rig.frames
    assert ridgeback_settings(rig, 0).marker_error == Pose2D()
