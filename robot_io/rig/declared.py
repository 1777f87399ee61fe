"""What the FT 300 declares of itself: the default of a rig, and what logs of before kinds were made with.

Robotiq FT 300 data sheet: range 300 N and 30 N*m, 100 Hz, noise of at most 1.2 N and 0.03 N*m. The stream counts in
0.01 N and 0.001 N*m.
"""

from __future__ import annotations

from robot_io.driver import SensorFacts

FT300_FACTS = SensorFacts(
    range=(300.0, 300.0, 300.0, 30.0, 30.0, 30.0),
    rate_hz=100.0,
    resolution=(0.01, 0.01, 0.01, 0.001, 0.001, 0.001),
    noise=(1.2, 1.2, 1.2, 0.03, 0.03, 0.03),
    source="Robotiq FT 300 data sheet",
)
