"""What a person does to the emulated robot by hand is seen by the drivers: the arm's joints, and the tool's weight."""

import os
import time

import pytest

from robot_io.ft300 import Ft300
from robot_io.ur10 import Ur10
from tools.doctor.emulated import emulators
from tools.rig import resolve_rig

QUIET = (
    *("world.sensor.noise_force_N=0", "world.sensor.noise_torque_Nm=0"),
    "world.sensor.bias=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]",
)


def until(device, wanted, within_s=20.0):
    """Wait until the device says this, to 0.02 (N, rad)."""
    deadline_s = time.monotonic() + within_s
    newest = ()
    while time.monotonic() < deadline_s:
        for sample in device.drain():
            value = sample.value
            newest = value.position if hasattr(value, "position") else (value.fx, value.fy, value.fz)
            if newest == pytest.approx(wanted, abs=0.02):
                return
        time.sleep(0.01)
    raise AssertionError(f"it says {newest}, not {wanted}")


@pytest.mark.long
def test_the_drivers_see_the_moved_arm_and_what_hangs_on_it():
    """0.6 kg weigh 5.886 N; with the last joint at pi/2 the sensor's x points up (docs/frames-and-signs.md)."""
    read_end, write_end = os.pipe()
    held, moved = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.3100), (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.5708)
    try:
        with (
            emulators(resolve_rig("emulated", QUIET), "", (), read_end) as rig,
            Ft300(rig.ft.port) as sensor,
            Ur10(rig.arm.host) as arm,
        ):
            until(arm, held)
            until(sensor, (-5.69, -1.52, 0.0))
            os.write(write_end, b'{"arm_rad": [1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.5708]}\n')
            until(arm, moved)
            until(sensor, (-5.89, 0.0, 0.0))
            os.write(write_end, b'{"hand": {"force_body_N": [-10, 0, 0], "for_s": 60}}\n')
            until(sensor, (-5.89, 0.0, -10.0))
    finally:
        os.close(read_end)
        os.close(write_end)
