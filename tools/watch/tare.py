"""The tare of `push watch`: one second of readings, judged as a run judges its own, and told in words."""

from __future__ import annotations

from control.settings import Settings
from control.tare import SMALLEST_COUNT, add, judge
from robot_io.messages import Vector3
from robot_io.tick import FtReading, TareSums

TARE_S = 1.0
"""Enough for signs: with the sensor's own noise the bias is right within about 0.1 N."""
HANDS_OFF = "taring for a second: touch neither ball nor arm"


class WatchTare:
    """Counts readings from `begin` on until there are enough for a bias (N, and N*m, SENSOR frame)."""

    def __init__(self, settings: Settings, rate_hz: float) -> None:
        """rate_hz: readings a second that the sensor declares."""
        self._settings = settings
        self._wanted = max(SMALLEST_COUNT, round(rate_hz * TARE_S))
        self.begin()

    def begin(self) -> None:
        """Forget the bias and count anew."""
        self._sums = TareSums()
        self.bias: Vector3 | None = None
        self.bias_torque: Vector3 | None = None
        self.words = HANDS_OFF

    def take(self, readings: tuple[FtReading, ...]) -> None:
        """Add readings until there are enough."""
        settings = self._settings
        for reading in readings:
            if self.bias is not None:
                return
            values = (*reading.force, *reading.torque)
            self._sums = add(self._sums, values, self._wanted, settings.sensor_resolution)
            if self._sums.count == self._wanted:
                self._judge()

    def _judge(self) -> None:
        settings = self._settings
        found = judge(
            self._sums, settings.sensor_noise, settings.sensor_range, settings.sensor_resolution, settings.scatters
        )
        self.bias, self.bias_torque = found.tare.bias[:3], found.tare.bias[3:]
        self.words = f"tare doubtful: {found.what}" if found.what else "tared here"
