"""The figures of the live line are those of the robot, not of the law alone."""

import pytest

from robot_io.messages import ArmRecord, BaseRecord, BodyTwist, WorldTwist
from robot_io.tick import ControlState, FtInput, HostInput, Mode, TickInput, TickOutput, TickState
from tools.run.run_state import status_line

TICK = TickInput(
    100, 10**9, 0, HostInput(0, 0, True, True, True, False, 0), FtInput((), 2, 0, 0, 0), ArmRecord(), BaseRecord()
)


@pytest.mark.parametrize(
    ("mode", "command", "shown"),
    [(Mode.PUSHING, BodyTwist(0.06, -0.08, 0.1), 0.1), (Mode.STOP, BodyTwist(), 0.0), (Mode.HOLD, BodyTwist(), 0.0)],
)
def test_the_speed_is_the_one_that_safety_lets_through(mode, command, shown):
    wanted = BodyTwist(0.1, 0.0, 0.0)
    output = TickOutput(mode, (), WorldTwist(0.1, 0.0, 0.0), wanted, command, 0.0, 0.0, False, 0)
    assert status_line(TICK, TickState(ControlState(speed=0.1)), output)["speed"] == pytest.approx(shown)
