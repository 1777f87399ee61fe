"""What the shipped sensors declare of themselves; the FT 300 is the default, also of logs from before kinds.

Robotiq FT 300 data sheet: range 300 N and 30 N*m, 100 Hz, noise of at most 1.2 N and 0.03 N*m. The stream counts in
0.01 N and 0.001 N*m.

UR e-Series user manuals 5.12, technical specifications: ranges of 30, 50, 100 and 160 N and 10 N*m, 500 Hz, and a
precision of 2, 3.5, 5 and 5 N (0.1 N*m of a UR3e, 0.2 N*m of the others), taken here for three standard deviations. No
resolution is stated; a hundredth of a newton is far below any noise.
"""

from __future__ import annotations

from robot_io.driver import SensorFacts

FT300 = "robotiq-ft300"
"""Its kind."""
FT300_FACTS = SensorFacts(
    range=(300.0, 300.0, 300.0, 30.0, 30.0, 30.0),
    rate_hz=100.0,
    resolution=(0.01, 0.01, 0.01, 0.001, 0.001, 0.001),
    noise=(1.2, 1.2, 1.2, 0.03, 0.03, 0.03),
    source="Robotiq FT 300 data sheet",
)


def _tool_force(range_N: float, precision_N: float, precision_Nm: float) -> SensorFacts:
    force_N, torque_Nm = precision_N / 3.0, precision_Nm / 3.0
    return SensorFacts(
        range=(range_N, range_N, range_N, 10.0, 10.0, 10.0),
        rate_hz=500.0,
        resolution=(0.01, 0.01, 0.01, 0.001, 0.001, 0.001),
        noise=(force_N, force_N, force_N, torque_Nm, torque_Nm, torque_Nm),
        source="UR e-Series user manual",
    )


TOOL_FORCE = "ur-tool-force"
"""The kind of an e-Series arm's own sensor."""
TOOL_FORCE_FACTS = {
    "UR3e": _tool_force(30.0, 2.0, 0.1),
    "UR5e": _tool_force(50.0, 3.5, 0.2),
    "UR10e": _tool_force(100.0, 5.0, 0.2),
    "UR16e": _tool_force(160.0, 5.0, 0.2),
}
