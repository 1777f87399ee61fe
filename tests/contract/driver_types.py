"""The drivers keep the protocols of `robot_io/driver.py` in their types as well: mypy reads this, nobody runs it."""

from __future__ import annotations

from robot_io.driver import Base, Driver, Sensor
from robot_io.ft300.driver import Ft300
from robot_io.messages import BaseFeed, JointState, SensorWrench
from robot_io.ridgeback.driver import Ridgeback
from robot_io.ur10.driver import Ur10
from robot_io.ur10.tool_force import UrToolForce
from sim_backend.sim.ft300 import SimFt300
from sim_backend.sim.ridgeback import SimRidgeback
from sim_backend.sim.ur10 import SimUr10


def sensors(real: Ft300, of_the_arm: UrToolForce, simulated: SimFt300) -> tuple[Sensor, Sensor, Driver[SensorWrench]]:
    return real, of_the_arm, simulated


def arms(real: Ur10, simulated: SimUr10) -> tuple[Driver[JointState], ...]:
    return real, simulated


def bases(real: Ridgeback, simulated: SimRidgeback) -> tuple[Base, Driver[BaseFeed]]:
    return real, simulated
