"""MAV_CMD_INJECT_FAILURE on a simulated vehicle: sensors, motors, servos."""

from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.verdict import Result
from flightsim.airframe import AirframeKind, Role
from flightsim.sensors import SensorSuite
from flightsim.vehicle import Vehicle

_OK: Final = mavlink.FAILURE_TYPE_OK
_OFF: Final = mavlink.FAILURE_TYPE_OFF
_STUCK: Final = mavlink.FAILURE_TYPE_STUCK
_SERVOS: Final = (Role.AILERON, Role.ELEVATOR, Role.THROTTLE, Role.RUDDER, Role.FLAPS)
"""Servo instances from 1, in ArduPilot's channel order."""


class FailureInjector:
    """Takes FAILURE_UNIT, FAILURE_TYPE and instance (0: all of them).

    Args:
        vehicle: whose actuators fail.
        sensors: its sensors.
    """

    __slots__ = ("_sensors", "_vehicle")

    def __init__(self, vehicle: Vehicle, sensors: SensorSuite) -> None:
        self._vehicle = vehicle
        self._sensors = sensors

    def inject(self, unit: int, failure: int, instance: int) -> Result:
        """Switch a failure; UNSUPPORTED for a unit or a failure the vehicle has not."""
        if unit == mavlink.FAILURE_UNIT_SYSTEM_MOTOR:
            return self._motor(failure, instance)
        if unit == mavlink.FAILURE_UNIT_SYSTEM_SERVO:
            return self._servo(failure, instance)
        try:
            self._sensors.faults.inject(unit, failure, instance=instance)
        except ValueError:
            return Result.UNSUPPORTED
        return Result.ACCEPTED

    def _motor(self, failure: int, instance: int) -> Result:
        aircraft = self._vehicle.airframe.kind is AirframeKind.FIXED_WING
        motors = 1 if aircraft else len(self._vehicle.airframe.effectiveness)
        if failure not in (_OK, _OFF) or not 0 <= instance <= motors or motors == 0:
            return Result.UNSUPPORTED
        for index in range(motors) if instance == 0 else (instance - 1,):
            self._vehicle.set_motor_effectiveness(index, 1.0 if failure == _OK else 0.0)
        return Result.ACCEPTED

    def _servo(self, failure: int, instance: int) -> Result:
        airframe = self._vehicle.airframe
        aircraft = airframe.kind is AirframeKind.FIXED_WING
        if not aircraft or failure not in (_OK, _OFF, _STUCK) or not 0 <= instance <= len(_SERVOS):
            return Result.UNSUPPORTED
        wanted = _SERVOS if instance == 0 else (_SERVOS[instance - 1],)
        servos = [role for role in wanted if role is not Role.THROTTLE and airframe.channel(role) is not None]
        if not servos:
            return Result.UNSUPPORTED
        for role in servos:
            self._vehicle.set_actuator_stuck(role, failure == _STUCK)
            self._vehicle.set_actuator_effectiveness(role, 0.0 if failure == _OFF else 1.0)
        return Result.ACCEPTED
