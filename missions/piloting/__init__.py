"""Attitude control of an aircraft from a mission: the loops that an autopilot leaves to a client that
commands roll.

Sans-IO: the functions compute commands from numbers.
"""

from missions.piloting.control import EnergyController, EnergyParameters, HeadingController

__all__ = ["EnergyController", "EnergyParameters", "HeadingController"]
