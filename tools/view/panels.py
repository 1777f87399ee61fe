"""What the first screen of a viewer shows, whichever it is: plots and states of `/control/signals`, and the scene.

Imports nothing of ours: the script that makes Rerun's blueprint runs with an interpreter that has Rerun alone.
"""

from __future__ import annotations

from typing import NamedTuple

SIGNALS_TOPIC = "/control/signals"
SIGNALS_TYPE = "push_msgs/msg/Signals"
DESCRIPTION_TOPIC, PATH_TOPIC, LOG_TOPIC = "/robot_description", "/path", "/rosout"
SCENE_TOPICS = (DESCRIPTION_TOPIC, PATH_TOPIC, "/tf", "/tf_static")
"""What the 3-D scene is drawn from."""


class Line(NamedTuple):
    """One line of a plot: a field of the signals, and its name in the legend."""

    field: str
    name: str


class Plot(NamedTuple):
    """A plot over time; the unit is in the title."""

    title: str
    lines: tuple[Line, ...]


PLOTS = (
    Plot(
        "force on the object, N",
        (Line("force_n", "size"), Line("force_along_n", "along"), Line("force_across_n", "across")),
    ),
    Plot("speed, m/s", (Line("speed_sent", "sent"), Line("speed_measured", "measured"))),
    Plot("contact ball off the path, m", (Line("lateral_m", "y_c"),)),
    Plot("angles to the path, rad", (Line("theta_f_rad", "theta_f"), Line("theta_p_rad", "theta_p"))),
)
STATES = {
    "phase": ("SETTLE", "TARE", "APPROACH", "PUSH", "LOST", "LOST_HOLD", "REST", "RETREAT", "CHECK", "DONE", "FAILED"),
    "mode": ("SILENT", "READY", "PUSHING", "SLOW", "HOLD", "STOP", "DEAD"),
}
"""Fields shown as coloured bars over time, and the names of their numbers from 0 on."""
RERUN_APPLICATION = "push"
"""Rerun applies a blueprint to recordings of the same application id only."""


def contents() -> str:
    """Return everything above that a layout is made of, one line each; kept beside push.rbl, which cannot be read."""
    lines = [f"{plot.title}: {line.field} = {line.name}" for plot in PLOTS for line in plot.lines]
    lines += [f"{field}: {' '.join(names)}" for field, names in STATES.items()]
    return "\n".join([RERUN_APPLICATION, f"{SIGNALS_TOPIC} {SIGNALS_TYPE}", *lines]) + "\n"
