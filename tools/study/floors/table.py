"""How far a push on a simpler floor ends up from the same push under Coulomb friction: the table of the docs."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import median

from sim_backend.physics.floor import FloorEffects
from sim_backend.physics.support import MOST_POINTS, PressureName
from tools.study.floors.closed_loop import push, rms_m, shift_m
from tools.study.floors.starts import STARTS

PRESSURES: tuple[PressureName, ...] = ("uniform", "centre", "frame", "corners")
FLOORS = {
    "along-push": FloorEffects(shift_m=shift_m(), turning="along-push"),
    "ellipsoid": FloorEffects(shift_m=shift_m()),
    "ellipsoid, height 0": FloorEffects(),
}
EXACT = FloorEffects(shift_m=shift_m(), turning="coulomb")

Errors = dict[str, list[float]]
"""For each floor the rms distance (mm) of each start's course from the exact one."""


def errors() -> Iterator[tuple[PressureName, Errors]]:
    """Yield the errors for each pressure; takes about two minutes."""
    for pressure in PRESSURES:
        found: Errors = {name: [] for name in FLOORS}
        for start in STARTS:
            exact = push(start, pressure, EXACT, MOST_POINTS)
            for name, effects in FLOORS.items():
                found[name].append(1000 * rms_m(push(start, pressure, effects), exact))
        yield pressure, found


def rows() -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| pressure | " + " | ".join(FLOORS) + " |"
    yield "|---|" + "---|" * len(FLOORS)
    for pressure, found in errors():
        cells = (f"{median(found[name]):.0f} ({max(found[name]):.0f})" for name in FLOORS)
        yield f"| `{pressure}` | " + " | ".join(cells) + " |"


if __name__ == "__main__":
    for line in rows():
        print(line, flush=True)
