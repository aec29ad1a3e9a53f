"""What a mission may ask of a vehicle: one shape for PX4 and ArduPilot, over MAVLink only, on vehicle
time.
"""

from missions.vehicle.adapter import Mode
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.vehicle import Vehicle

__all__ = ["Mode", "Setpoint", "Vehicle"]
