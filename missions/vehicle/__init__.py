"""The interface of missions to a vehicle: the same for PX4 and ArduPilot, over MAVLink, on vehicle time."""

from missions.kind import VehicleKind
from missions.vehicle.firmware import Mode
from missions.vehicle.setpoint import AttitudeSetpoint, Setpoint
from missions.vehicle.vehicle import Vehicle

__all__ = ["AttitudeSetpoint", "Mode", "Setpoint", "Vehicle", "VehicleKind"]
