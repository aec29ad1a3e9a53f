"""Flying an aircraft by attitude from a mission: what an autopilot leaves to whoever commands the roll.

Sans-IO: numbers in, commands out.
"""

from missions.piloting.energy import EnergyController, EnergyParameters
from missions.piloting.heading import HeadingController
from missions.piloting.pressure_height import PressureHeight

__all__ = [
    "EnergyController",
    "EnergyParameters",
    "HeadingController",
    "PressureHeight",
]
