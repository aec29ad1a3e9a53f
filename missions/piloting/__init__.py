"""Attitude control of an aircraft from a mission: the loops that an autopilot leaves to a client that
commands roll.

Sans-IO: the functions compute commands from numbers.
"""

from missions.piloting.energy import EnergyController, EnergyParameters
from missions.piloting.heading import HeadingController

__all__ = [
    "EnergyController",
    "EnergyParameters",
    "HeadingController",
]
