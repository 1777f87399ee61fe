"""The readings behind an estimate, step by step, as CSV beside the fragment: so that it can be worked out again."""

from __future__ import annotations

from tools.calibrate.estimators.estimate import Array

COLUMNS = ("step", "t_s", "fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm", "x_m", "y_m", "yaw_rad")


class Raw:
    """Collects what was read; forces in the SENSOR frame with bias and tool weight in them, poses in WORLD."""

    def __init__(self) -> None:
        self._lines = [",".join(COLUMNS)]
        self._steps = 0

    def forces(self, times_s: Array, values: Array) -> None:
        """Note one step's readings (N, N*m, in rows), taken at `times_s`."""
        self._steps += 1
        for t, row in zip(times_s.tolist(), values.tolist(), strict=True):
            self._lines.append(f"{self._steps},{t:.4f},{','.join(f'{value:.6g}' for value in row)},,,")

    def poses(self, rows: Array) -> None:
        """Note one step's poses (x, y in m, yaw in rad, in rows), in order of time."""
        self._steps += 1
        for row in rows.tolist():
            self._lines.append(f"{self._steps},,,,,,,,{','.join(f'{value:.6f}' for value in row)}")

    @property
    def empty(self) -> bool:
        """Whether nothing was read."""
        return self._steps == 0

    def text(self) -> str:
        """Return the table."""
        return "\n".join(self._lines) + "\n"
