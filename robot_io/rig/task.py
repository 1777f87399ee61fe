"""What is to be done: `[path]`, `[sliders]`, `[workspace]`, `[goal]` of a rig file, and `[faults]` on demand."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from robot_io.polygon import Polygon, flaw
from robot_io.rig.types import InRoom, Positive, Table


class PathConfig(Table, frozen=True):
    """The straight path in the WORLD frame: a point on it (from which distance is expected) and its direction."""

    origin_m: InRoom = (0.0, 0.0)
    direction_deg: Annotated[float, Meta(ge=-180, le=180)] = 0.0
    expected_contact_m: Annotated[float, Meta(ge=0, le=2)] = 0.05
    """Distance from where the approach starts to where the object is expected."""


class SlidersConfig(Table, frozen=True):
    """What this rig is meant to push, boxes and barrels: `push run` warns of gains with little margin for some."""

    shortest_m: Positive = 0.3
    """Length along the push, or diameter, of the smallest ..."""
    longest_m: Positive = 0.5
    """... and of the largest."""
    pressure: Literal["uniform", "rim", "point", "frame", "corners", "centre"] = "uniform"


class WorkspaceConfig(Table, frozen=True):
    """Where base and object may be, in the WORLD frame: `x_m` with `y_m`, or `polygon_m`.

    The base slows down and stops (F55) before its outline leaves it; so it does for the object where its pose is known.
    Without one, the base may be up to 1 m beside its path and beyond the end of it, as it lies from the start.
    """

    x_m: InRoom | None = None
    """From and to."""
    y_m: InRoom | None = None
    """From and to."""
    polygon_m: Annotated[tuple[InRoom, ...], Meta(max_length=100)] | None = None
    """Corners x, y in order; the edges must not cross."""

    @property
    def corners(self) -> Polygon:
        """Return its corners (m, WORLD frame), none where no workspace is given."""
        if self.x_m is not None and self.y_m is not None:
            (left, right), (low, high) = self.x_m, self.y_m
            return ((left, low), (right, low), (right, high), (left, high))
        return self.polygon_m or ()

    def problems(self) -> list[str]:
        """Return what is wrong with it, in words."""
        ranges = {"x_m": self.x_m, "y_m": self.y_m}
        given = [key for key, value in ranges.items() if value is not None]
        if self.polygon_m is not None:
            if given:
                return ["`workspace` has `polygon_m` and `x_m` or `y_m`: give one of the two forms"]
            why = flaw(self.polygon_m)
            return [f"`workspace.polygon_m` is no floor: {why}"] if why else []
        if len(given) == 1:
            return [f"`workspace.{given[0]}` needs `{'y_m' if given == ['x_m'] else 'x_m'}` beside it"]
        return [
            f"`workspace.{key}` = [{value[0]:g}, {value[1]:g}] does not go from the smaller to the larger"
            for key, value in ranges.items()
            if value is not None and value[0] >= value[1]
        ]


class GoalConfig(Table, frozen=True):
    """Where the contact ball has to be for a push to count as done. It decides the verdict and never stops the base."""

    corridor_m: Annotated[float, Meta(gt=0, le=10)] = 0.5
    """How far the ball may be from the path at any time of the push, to either side."""
    end_tolerance_m: Annotated[float, Meta(gt=0, le=10)] = 0.3
    """How far it may be at the end. A push that starts further off may end as far off as it started."""


class LogConfig(Table, frozen=True):
    """What is recorded, and into how many files (docs/logs.md)."""

    topics: Literal["all", "lean"] = "all"
    """`lean`: topics that are derived for viewers come 25 times a second instead of in every tick."""
    split_minutes: Annotated[float, Meta(ge=0, le=1440)] = 0.0
    """Begin a new file after so many minutes, `run_001.mcap`, `run_002.mcap`, ...; 0: one file, `run.mcap`."""
    split_MB: Annotated[float, Meta(ge=0, le=100_000)] = 0.0
    """Begin a new file once this one has so many megabytes; 0: no matter how large."""

    @property
    def in_parts(self) -> bool:
        """Whether there may be more than one file."""
        return self.split_minutes > 0 or self.split_MB > 0


class FaultsConfig(Table, frozen=True):
    """Faults to inject at levels sim and emulated, for rehearsals and tests (docs/faults.md)."""

    inject: tuple[str, ...] = ()
    """Each `DEVICE.KIND[=VALUE] at T s [for T s]`, as after `push run --fault`."""
