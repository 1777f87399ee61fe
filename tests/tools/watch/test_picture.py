"""What `push watch` makes of what was heard: on a screen of any width, in one line, and as JSON."""

import json
import math
import struct

import msgspec
import pytest

from robot_io.clock import NS_PER_S
from robot_io.messages import (
    ArmState,
    BaseOdometry,
    BasePose,
    BaseReport,
    BaseStatus,
    BodyTwist,
    JointState,
    Pose2D,
    SensorWrench,
    Stamped,
)
from safety.faults import FAULTS
from tools.rig import resolve_rig
from tools.watch.live_topics import LiveTopics
from tools.watch.reports import DeviceReport
from tools.watch.screen import one_line, picture
from tools.watch.seen import Seen, Stage
from tools.watch.view import as_json, view_of

NOW_NS = 100 * NS_PER_S
HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.3100)
BIAS = (-20.0, 22.0, -48.0)


def stamped(value, seq, age_ms):
    return Stamped(value, seq, NOW_NS - age_ms * 10**6)


def wrenches(count, first_age_ms, seq, fz):
    """Readings every 10 ms, noisy by a fraction of a newton, so that no axis looks dead."""
    return tuple(
        stamped(
            SensorWrench(
                BIAS[0] + 0.3 * math.sin(i), BIAS[1] + 0.3 * math.cos(2 * i), BIAS[2] + fz + 0.3 * math.sin(3 * i + 1),
                0.01 * math.sin(i), 0.01 * math.cos(i), 0.01 * math.sin(2 * i),
            ),
            seq + i,
            first_age_ms - 10 * i,
        )
        for i in range(count)
    )  # fmt: skip


def a_seen_robot(fz=-15.0, joints=HELD, y=0.02):
    seen = Seen(resolve_rig("emulated"))
    seen.take_device(DeviceReport("ft", "up", ft=wrenches(120, 2000, 0, 0.0)))
    seen.take_device(DeviceReport("ft", "up", ft=wrenches(40, 400, 160, fz)))
    arm = JointState(joints, (0.0,) * 6, ArmState.HOLDING, 0, 1.0)
    seen.take_device(DeviceReport("arm", "up", arm=(stamped(arm, 1, 20), stamped(arm, 2, 12))))
    pose = BasePose(Pose2D(-0.5, y, 0.0))
    seen.take_device(
        DeviceReport(
            "base",
            "up",
            base=(
                stamped(pose, 1, 110),
                stamped(pose, 2, 10),
                stamped(BaseOdometry(BodyTwist(0.1, 0.0, 0.0)), 1, 50),
                stamped(BaseReport(BaseStatus(False, True, 25.5)), 1, 700),
            ),
        )
    )
    return seen


def lines_of(seen, columns=100, now_ns=NOW_NS):
    return [line.text for line in picture(view_of(seen, "devices opened here", now_ns), columns, unicode=True)]


def test_the_sign_is_said_in_words_with_its_axis_and_an_arrow():
    text = "\n".join(lines_of(a_seen_robot()))
    assert "↓  BACKWARD  15." in text
    assert "(-x BODY)" in text
    assert "y_c     +0.020 m (left of the path)" in text
    assert "theta_f" in text


def test_ages_and_rates_are_those_of_the_newest_samples():
    told = as_json(view_of(a_seen_robot(), "here", NOW_NS))
    assert told["ft"]["rate_hz"] == pytest.approx(100.0, abs=2.0)
    assert told["ft"]["age_ms"] == pytest.approx(10.0)
    assert told["arm"]["age_ms"] == pytest.approx(12.0)
    assert told["base"]["pose_rate_hz"] == pytest.approx(10.0)
    assert told["base"]["odometry_age_ms"] == pytest.approx(50.0)
    later = as_json(view_of(a_seen_robot(), "here", NOW_NS + 3 * NS_PER_S))
    assert later["ft"]["late"]
    assert later["ft"]["rate_hz"] is None
    assert later["force_on_ball_body_N"] is None, "an old force is not shown as the present one"


def test_the_json_has_one_schema_and_only_numbers_that_json_knows():
    seen = a_seen_robot()
    pose = BasePose(Pose2D(math.nan, math.nan, math.nan), "null in the message")
    seen.take_device(DeviceReport("base", "up", base=(stamped(pose, 3, 1),)))
    told = json.loads(json.dumps(as_json(view_of(seen, "here", NOW_NS)), allow_nan=False))
    assert told["schema"] == 1
    assert told["base"]["pose"] == [None, None, None]
    assert told["base"]["pose_flaw"] == "null in the message"
    assert told["lateral_m"] is None
    assert told["force_on_ball_path_N"] is None
    assert told["force_on_ball_body_N"][0] == pytest.approx(-15.0, abs=0.3)
    assert told["arm"]["arm_state"] == "holding"
    assert told["run"] is None


@pytest.mark.parametrize("columns", [20, 40, 69, 70, 80, 200])
def test_no_line_is_wider_than_the_terminal(columns):
    lines = lines_of(a_seen_robot(), columns)
    assert max(map(len, lines)) <= columns
    if columns >= 40:
        text = "\n".join(lines)
        assert "BACKWARD" in text
        assert "BODY " in text
        assert len(lines) <= 24, "it fits an ordinary terminal"


def test_an_arm_elsewhere_names_the_joint():
    text = "\n".join(lines_of(a_seen_robot(joints=(*HELD[:3], HELD[3] + 0.2, *HELD[4:]))))
    assert "OFF THE HELD POSE, +0.200 rad (wrist 1)" in text


def style_of(seen, device):
    found = picture(view_of(seen, "here", NOW_NS), 200, unicode=True)
    return next(line.style for line in found if line.text.startswith(device))


def test_what_a_push_does_not_allow_is_marked():
    assert [style_of(a_seen_robot(), device) for device in ("ft", "arm", "base")] == ["", "", ""]
    assert style_of(a_seen_robot(joints=(0.0, *HELD[1:])), "arm") == "bad"
    for status in (BaseStatus(True, True, 25.0), BaseStatus(False, False, 25.0)):
        seen = a_seen_robot()
        seen.take_device(DeviceReport("base", "up", base=(stamped(BaseReport(status), 2, 5),)))
        assert style_of(seen, "base") == "bad"
    later = picture(view_of(a_seen_robot(), "here", NOW_NS + NS_PER_S), 200, unicode=True)
    assert "OLD" in next(line.text for line in later if line.text.startswith("ft"))


def test_one_line_has_it_all():
    line = one_line(view_of(a_seen_robot(), "here", NOW_NS))
    for piece in ("BACKWARD 15.", "(-x)", "PATH -15.", "theta_f", "y_c +0.020 m", "ft: 100 Hz", "arm: ", "no stop"):
        assert piece in line, piece
    assert "\n" not in line


def test_a_lost_device_is_said_in_words_and_marked():
    seen = a_seen_robot()
    seen.take_device(DeviceReport("base", "lost", "ws://127.0.0.1:1: nothing listens. Start rosbridge"))
    found = picture(view_of(seen, "here", NOW_NS), 100, unicode=True)
    [line] = [line for line in found if line.text.startswith("base")]
    assert line.text == "base LOST: ws://127.0.0.1:1: nothing listens. Start rosbridge"
    assert line.style == "bad"
    assert "LOST" in one_line(view_of(seen, "here", NOW_NS))


def test_a_run_is_shown_with_its_faults_in_words():
    seen = a_seen_robot()
    seen.stage = Stage("PUSH", "SLOW", 0.31, ("F50-slow",))
    text = "\n".join(lines_of(seen))
    assert "run: PUSH SLOW  0.31 m" in text
    assert f"F50-slow {FAULTS['F50-slow'].text}" in text
    assert "t tares" not in text, "its tare is the run's"


def test_a_sensor_that_was_away_is_tared_again():
    seen = a_seen_robot()
    seen.take_device(DeviceReport("ft", "lost", "the line is gone"))
    seen.take_device(DeviceReport("ft", "opening"))
    view = view_of(seen, "here", NOW_NS)
    assert view.force is None
    assert "touch neither ball nor arm" in view.tare
    seen.take_device(DeviceReport("ft", "up", ft=wrenches(120, 1190, 0, -8.0)))
    force = view_of(seen, "here", NOW_NS).force
    assert force is not None
    assert force.body[0] == pytest.approx(0.0, abs=0.3), "what pressed meanwhile is taken for the new zero"


def test_a_tare_while_somebody_presses_is_doubted():
    seen = Seen(resolve_rig("emulated"))
    for i, fz in enumerate((0.0, -5.0, -10.0, -15.0)):
        seen.take_device(DeviceReport("ft", "up", ft=wrenches(30, 1200 - 300 * i, 30 * i, fz)))
    assert "doubtful" in seen.tare_words
    assert "fz" in seen.tare_words


def test_reports_survive_their_way():
    from tools.watch.reports import ReportSender, report_link

    reader, far = report_link()
    sender = ReportSender(far)
    sent = DeviceReport("base", "up", base=(stamped(BasePose(Pose2D(1.0, 2.0, 3.0)), 1, 5),))
    for _ in range(3):
        sender.send(sent)
    found = reader.read()
    assert len(found) == 3
    assert msgspec.structs.asdict(found[0])["base"][0].value == BasePose(Pose2D(1.0, 2.0, 3.0))
    for _ in range(100_000):
        sender.send(sent)  # nobody reads: it never waits
    reader.close()
    sender.send(sent)
    far.close()


class Kept:
    """Takes the place of a viewer's feed."""

    def __init__(self):
        self.payloads = {}

    def add(self, topic, _log_time_ns, payload):
        self.payloads[topic] = payload

    def flush(self):
        pass


def test_the_live_wrench_has_the_torque_about_the_sensor():
    """A moment of 2 N*m about the sensor's z, the base turned by 90 degrees: -R_z(90) base_from_sensor (0, 0, 2)."""
    seen = Seen(resolve_rig("emulated"))
    seen.take_device(DeviceReport("ft", "up", ft=wrenches(120, 2000, 0, 0.0)))
    seen.take_device(DeviceReport("base", "up", base=(stamped(BasePose(Pose2D(-0.5, 0.0, math.pi / 2)), 1, 1),)))
    turned = tuple(stamped(SensorWrench(*BIAS, 0.0, 0.0, 2.0), 300 + i, 250 - 10 * i) for i in range(25))
    seen.take_device(DeviceReport("ft", "up", ft=turned))
    view = view_of(seen, "test", NOW_NS)
    x, y, z = (row[2] for row in seen.rig.frames.base_from_sensor)
    expected = (2.0 * y, -2.0 * x, -2.0 * z)
    assert view.torque_on_object == pytest.approx(expected, abs=0.02)
    feed = Kept()
    LiveTopics(seen.rig, feed).show(view)
    assert struct.unpack("<3d", feed.payloads["/ft/wrench"][-24:]) == pytest.approx(expected, abs=0.02)
    assert b"ft_sensor_world" in feed.payloads["/ft/wrench"]
