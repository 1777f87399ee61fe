from robot_io.clock import NS_PER_MS as MS
from sim_backend.ridgeback.twist_mux import JOYSTICK, TwistMux

CMD_VEL = "/cmd_vel"
MARKER = "/twist_marker_server/cmd_vel"


def test_alone_the_external_input_drives():
    assert TwistMux().passes(CMD_VEL, 0)


def test_joystick_masks_until_half_a_second_after_its_last_message():
    mux = TwistMux()
    assert mux.passes(CMD_VEL, 0)
    assert mux.passes(JOYSTICK, 10 * MS)
    assert not mux.passes(CMD_VEL, 20 * MS)
    assert not mux.passes(CMD_VEL, 510 * MS)
    assert mux.passes(CMD_VEL, 511 * MS)


def test_priorities_between_others():
    mux = TwistMux()
    assert mux.passes(MARKER, 0)
    assert mux.passes("/bluetooth_teleop/cmd_vel", 1)
    assert not mux.passes(MARKER, 2)
    assert mux.passes(JOYSTICK, 3)
    assert not mux.passes("/bluetooth_teleop/cmd_vel", 4)


def test_lock_drops_everybody_and_never_expires():
    mux = TwistMux()
    mux.locked = True
    assert not mux.passes(CMD_VEL, 0)
    assert not mux.passes(JOYSTICK, 10**15)
    mux.locked = False
    assert mux.passes(JOYSTICK, 10**15 + 1)
