"""The rows of the force sensor that an e-Series arm has itself, from what its driver gives for a while."""

from __future__ import annotations

import select
import time

from robot_io.errors import DeviceError
from robot_io.messages import SensorWrench
from robot_io.rig.config import RigConfig
from robot_io.ur10.tool_force import UrToolForce
from tools.doctor.check import Check, Rows
from tools.doctor.ft_checks import judge_rate, judge_readings

LISTEN_S = 1.5
NETWORK_FIX = "Check the network to the arm: a wired link, and nothing else that fills it"
NOT_THERE = {
    "permission": "it is reached over the network",
    "lock": "it is the arm's: one lock for both",
    "latency-timer": "there is no adapter",
    "crc": "TCP looks after its bytes",
    "echo": "there is no line that could echo",
}


def tool_force_checks(rig: RigConfig) -> list[Check]:
    """Return the rows of the sensor of the arm at the rig's host; at most 6 s. Nothing is written to the controller."""
    rows = Rows("ft")
    for name, why in NOT_THERE.items():
        rows.skip(name, why)
    sensor = UrToolForce.from_rig(rig.ft.port, rig.ft.options)
    try:
        info = sensor.open()
        rows.ok("port", f"RTDE and dashboard answer at {rig.ft.port}")
        rows.ok(
            "identity", " ".join(filter(None, (info.model, info.version, info.serial, *info.remarks))), info.version
        )
        sensor.start()
        readings, span_s = _listen(sensor)
    except DeviceError as error:
        rows.error("identity" if "port" in rows.found else "port", error)
        return rows.all("the sensor was not reached")
    finally:
        sensor.close()
    told = f"{len(readings)} readings in {span_s:.1f} s"
    judge_rate(rows, len(readings) / span_s, rig.ft.declared.rate_hz, "Hz", told, NETWORK_FIX)
    judge_readings(rows, rig, readings)
    return rows.all("too few readings came")


def _listen(sensor: UrToolForce) -> tuple[tuple[SensorWrench, ...], float]:
    """Return the readings of a while, and how long it was in s."""
    began_s = time.monotonic()
    readings: list[SensorWrench] = []
    while (passed_s := time.monotonic() - began_s) < LISTEN_S:
        select.select([sensor.fileno()], [], [], LISTEN_S - passed_s)
        samples = sensor.drain()
        if not samples and sensor.fileno() >= 0 and sensor.health().cause:
            break  # lost: what came is judged
        readings += [sample.value for sample in samples]
    return tuple(readings), passed_s
