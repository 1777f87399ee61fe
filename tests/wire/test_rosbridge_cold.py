"""The base's driver with a bridge that has just been started, answers slowly, or hangs."""

import time

import pytest

from robot_io.errors import DeviceProtocolError
from robot_io.messages import BodyTwist
from robot_io.ridgeback import Ridgeback
from robot_io.rig.topics import TopicsConfig
from tests.wire.bridge_process import running_bridge, until
from tests.wire.test_rosbridge_faults import drive, drive_until_lost, moving

QUICK = TopicsConfig(status="")


def test_a_bridge_whose_rosapi_is_still_starting_is_asked_again():
    with running_bridge(bridge={"cold_s": 60.0}) as bridge:
        bridge.do("cold", 1.2)
        began_s = time.monotonic()
        with Ridgeback(bridge.url, topics=QUICK) as base:
            assert base.health().counters["unanswered_checks"] == 0
            assert base.command(BodyTwist(0.1)) == BodyTwist(0.1)
        assert time.monotonic() - began_s > 0.9


def test_a_wrong_type_is_named_by_a_bridge_that_starts():
    topics = TopicsConfig(status="", command_type="geometry_msgs/TwistStamped")
    with running_bridge() as bridge:
        bridge.do("cold", 0.8)
        with pytest.raises(DeviceProtocolError, match="/cmd_vel carries geometry_msgs/Twist"):
            Ridgeback(bridge.url, topics=topics).open()


@pytest.mark.long
def test_answers_that_take_longer_than_a_second_count():
    with running_bridge(bridge={"answer_delay_s": 1.4}) as bridge, Ridgeback(bridge.url, topics=QUICK) as base:
        assert base.health().counters["unanswered_checks"] == 0


@pytest.mark.long
def test_a_rosapi_that_never_comes_is_given_up_and_said():
    with running_bridge(bridge={"cold_s": 60.0}) as bridge:
        base = Ridgeback(bridge.url, topics=QUICK)
        began_s = time.monotonic()
        info = base.open()
        assert 2.5 < time.monotonic() - began_s < 9.0
        assert "5 of 5 questions" in info.remarks[0]
        base.close()


def test_a_hang_leaves_fewer_than_ten_commands_that_move():
    """At 100 Hz; whatever the bridge still has to deliver when it goes on, zeros follow."""
    with running_bridge() as bridge, Ridgeback(bridge.url, topics=QUICK) as base:
        drive(base, 0.3)
        froze_ns = bridge.do("freeze", 1.0)
        sent = drive_until_lost(base)
        assert len([stamp for stamp, twist in sent if stamp > froze_ns and twist != BodyTwist()]) <= 8
        drive(base, 1.0)
        assert until(lambda: bridge.heard()[-1][1:] == (0.0, 0.0, 0.0))
        assert len(moving(bridge.heard(), froze_ns)) <= 8
