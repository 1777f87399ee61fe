"""The sensor's part of a tick's input, made of what its driver reports."""

from __future__ import annotations

from robot_io.messages import DeviceHealth, SensorWrench, Stamped
from robot_io.tick import FtInput, FtReading, link_number


def ft_input(
    readings: list[Stamped[SensorWrench]] | tuple[Stamped[SensorWrench], ...], health: DeviceHealth, taken: int
) -> FtInput:
    """Return the sensor's part of a tick's input; `taken`: all readings so far, if the driver does not count them."""
    counters = health.counters
    return FtInput(
        tuple(
            FtReading(s.received_ns, s.seq, (s.value.fx, s.value.fy, s.value.fz), (s.value.mx, s.value.my, s.value.mz))
            for s in readings
        ),
        link_number(health.state),
        counters.get("packets_ok", taken),
        counters.get("crc_fail", 0),
        counters.get("junk_bytes", 0),
        counters.get("bias_jumps", 0),
    )
