"""What is measured for a row of the fault table, and its limit."""

from __future__ import annotations

from typing import NamedTuple


class Measure(NamedTuple):
    """What the value of a finding is, its limit (a number in `unit`, or the field of SafetySettings), and the unit."""

    measured: str
    limit: float | str | None
    unit: str


MEASURES: dict[str, Measure] = {
    "R01": Measure("time without data", 5000.0, "ms"),
    "R04": Measure("distance of the joint furthest off", "held_pose_tolerance", "rad"),
    "R06": Measure("room that is left, negative where there is too little", 0.0, "m"),
    "R07": Measure("the larger coordinate", 1000.0, "m"),
    "F01-slow": Measure("age of the newest force packet", 50.0, "ms"),
    "F01-hold": Measure("age of the newest force packet", 80.0, "ms"),
    "F01-stop": Measure("age of the newest force packet", 160.0, "ms"),
    "F04": Measure("damaged packets within 0.2 s", "damaged_packets", "packets"),
    "F06": Measure("equal readings in a row", "frozen_readings", "readings"),
    "F07": Measure("the largest axis as a share of its range", 0.95, ""),
    "F08": Measure("its distance from the reading before", 80.0, "N"),
    "F09": Measure("force left out of contact", 5.0, "N"),
    "F09-before": Measure("mean force in the half second before", 3.0, "N"),
    "F11": Measure("readings in a row", 20.0, "readings"),
    "F12-low": Measure("rate over the last second", "low_rate", "Hz"),
    "F12-hold": Measure("rate over the last second", "least_rate", "Hz"),
    "F20-hold": Measure("drift of the joint furthest off", "drift_hold", "rad"),
    "F20-stop": Measure("drift of the joint furthest off", "drift_stop", "rad"),
    "F21": Measure("speed of the fastest joint", 0.02, "rad/s"),
    "F24-hold": Measure("age of the arm record", 40.0, "ms"),
    "F24-stop": Measure("age of the arm record", 100.0, "ms"),
    "F25-hold": Measure("time since the controller's clock moved", 40.0, "ms"),
    "F25-stop": Measure("time since the controller's clock moved", 100.0, "ms"),
    "F31-hold": Measure("age of the odometry", 100.0, "ms"),
    "F31-stop": Measure("age of the odometry", 250.0, "ms"),
    "F32-slow": Measure("growth of its age", 60.0, "ms"),
    "F32-stop": Measure("growth of its age", 120.0, "ms"),
    "F33": Measure("difference between measured and commanded speed", None, "m/s"),
    "F34": Measure("measured speed", 0.03, "m/s"),
    "F35": Measure("measured speed", None, "m/s"),
    "F33-way": Measure("difference of the ways, as a share of what is allowed", 1.0, ""),
    "F37": Measure("difference of the ways, as a share of what is allowed", 1.0, ""),
    "F38-late": Measure("age of the base's report", 3000.0, "ms"),
    "F40-slow": Measure("age of the pose", None, "ms"),
    "F40-stop": Measure("age of the pose", None, "ms"),
    "F43": Measure("difference of the ways, as a share of what is allowed", 1.0, ""),
    "F44": Measure("heading error", "max_heading_error", "rad"),
    "F45-approach": Measure("way of this search, as sent or measured", "phases.approach_m", "m"),
    "F45-push": Measure("way of the push, as sent or measured", "phases.push_m", "m"),
    "F45-retreat": Measure("way of the retreat, as sent or measured", "phases.retreat_m", "m"),
    "F46-approach": Measure("time in motion", "phases.approach_s", "s"),
    "F46-push": Measure("time in motion", "phases.push_s", "s"),
    "F46-retreat": Measure("time in motion", "phases.retreat_s", "s"),
    "F47": Measure("way since the first motion, as sent or measured", "total_travel", "m"),
    "F48": Measure("time in motion", "total_moving", "s"),
    "F50-slow": Measure("raw force, bias removed", "slow_force", "N"),
    "F50-stop": Measure("raw force, bias removed", "max_force", "N"),
    "F51": Measure("raw torque, bias removed", "max_torque", "N m"),
    "F52-refused": Measure("resumes of this push", 3.0, ""),
    "F53": Measure("mean force along the motion", 2.5, "N"),
    "F54-stop": Measure("share of the commanded way that was covered", 0.25, ""),
    "F54-hold": Measure("time with such a force", 10.0, "s"),
    "F55-slow": Measure("room beyond two stopping distances", 0.0, "m"),
    "F55-stop": Measure("room beyond the stopping distance", 0.0, "m"),
    "F56": Measure("ticks in which the law asked for more than 135 degrees", 20.0, "ticks"),
    "F56-way": Measure("way in one piece with more than 90 degrees asked for", 0.3, "m"),
    "F57-slow": Measure("time of the step before this tick", "law_ms", "ms"),
    "F59": Measure("angle between the way by pose and the way asked for", 15.0, "degrees"),
    "F60-slow": Measure("time overrun", 30.0, "ms"),
    "F61": Measure("time that passed unseen between two ticks", 20.0, "ms"),
    "F63": Measure("time without recording", 1000.0, "ms"),
    "F67-late": Measure("age of the gate's record", 100.0, "ms"),
    "F73-hold": Measure("time since the launcher's last sign of life", 500.0, "ms"),
    "F73-stop": Measure("time since the launcher's last sign of life", 2000.0, "ms"),
}
NOTHING = Measure("", None, "")


def measure_of(fault: str) -> Measure:
    """Return what is measured for a row; no words and no limit where nothing is."""
    return MEASURES.get(fault, NOTHING)
