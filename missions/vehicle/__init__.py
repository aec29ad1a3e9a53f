"""The interface of missions to a vehicle: the same for PX4 and ArduPilot, over MAVLink, on vehicle time."""

from missions.kind import VehicleKind
from missions.vehicle.adapter import Mode
from missions.vehicle.attitude_setpoint import AttitudeSetpoint
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.vehicle import Vehicle

__all__ = ["AttitudeSetpoint", "Mode", "Setpoint", "Vehicle", "VehicleKind"]
