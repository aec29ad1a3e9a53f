"""MAV_CMD_INJECT_FAILURE on a simulated vehicle: sensors, motors, servos, and data received by radio.

Source: FAILURE_UNIT and FAILURE_TYPE of MAVLink's common.xml. A unit, a type or an instance that the vehicle
does not have is UNSUPPORTED.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.services.microservice import AutopilotParts
from autopilot_bridge.sitl.entry_units import ENTRY_UNITS
from autopilot_bridge.sitl.simulator_parameters import SimulatorParameters
from flightsim.airframe import AirframeKind, Role
from flightsim.sensors import SensorSuite
from flightsim.sensors.fault_stage import FaultPoint
from flightsim.vehicle import Vehicle

_OK: Final = mavlink.FAILURE_TYPE_OK
_OFF: Final = mavlink.FAILURE_TYPE_OFF
_STUCK: Final = mavlink.FAILURE_TYPE_STUCK
_WRONG: Final = mavlink.FAILURE_TYPE_WRONG
_SERVOS: Final = (Role.AILERON, Role.ELEVATOR, Role.THROTTLE, Role.RUDDER, Role.FLAPS)
"""Servo instances from 1, in ArduPilot's channel order."""

_EFFECTIVENESS: Final = {_OK: 1.0, _OFF: 0.0, _WRONG: 0.5}
"""Effectiveness of an actuator; WRONG stands for a damaged propeller or a slipped linkage."""

_HEARD_WITHOUT_SIGNAL: Final = frozenset({mavlink.MAV_CMD_INJECT_FAILURE})


class FailureInjector:
    """Executes FAILURE_UNIT, FAILURE_TYPE and instance (0: all of them).

    It is also the autopilot's `Simulation`: it applies failures to data received by messages, and the
    simulator's parameters.

    Args:
        vehicle: the vehicle whose actuators fail.
        sensors: its sensors.
    """

    __slots__ = ("_commander", "_deaf", "_entries", "_sensors", "_vehicle")

    def __init__(self, vehicle: Vehicle, sensors: SensorSuite) -> None:
        self._vehicle = vehicle
        self._sensors = sensors
        self._deaf = False
        self._commander: Commander | None = None
        self._entries: dict[int, FaultPoint] = {
            int(unit.target.unit): sensors.add_elsewhere(unit.target, size=unit.size, rate_hz=unit.rate_hz)
            for unit in ENTRY_UNITS
        }

    def attend(self, parts: AutopilotParts) -> None:
        """An autopilot has booted: use its pilot input and its parameters from now on."""
        self._commander = parts.commander
        self._deaf = False
        parameters = SimulatorParameters(self._vehicle, self._sensors, self.fail_radio, self.weaken_motors)
        parts.parameters.subscribe(lambda name, value: parameters.changed(parts.parameters, name))
        parameters.apply(parts.parameters)

    def inject(self, unit: int, failure: int, instance: int) -> Result:
        """Switch a failure on or off; UNSUPPORTED for a unit or a failure that the vehicle does not have."""
        if unit == mavlink.FAILURE_UNIT_SYSTEM_MOTOR:
            return self._motor(failure, instance)
        if unit == mavlink.FAILURE_UNIT_SYSTEM_SERVO:
            return self._servo(failure, instance)
        if unit in (mavlink.FAILURE_UNIT_SYSTEM_RC_SIGNAL, mavlink.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL):
            if failure not in (_OK, _OFF) or instance not in (0, 1):
                return Result.UNSUPPORTED
            if unit == mavlink.FAILURE_UNIT_SYSTEM_RC_SIGNAL:
                self.fail_radio(failure == _OFF)
            else:
                self._deaf = failure == _OFF
            return Result.ACCEPTED
        try:
            self._sensors.faults.inject(unit, failure, instance=instance)
        except ValueError:
            return Result.UNSUPPORTED
        return Result.ACCEPTED

    # data received by messages

    def spoil(self, unit: int, values: NDArray[np.float64]) -> bool:
        """Apply a failure to a sample received by a message; False when the sample is lost."""
        point = self._entries[unit]
        return point.deliver(values)

    def deaf_to(self, command: int | None) -> bool:
        """True: the autopilot receives no messages, except the command that ends the failure.

        Args:
            command: MAV_CMD of a COMMAND_LONG or COMMAND_INT; None: another message.
        """
        return self._deaf and command not in _HEARD_WITHOUT_SIGNAL

    def fail_radio(self, failed: bool) -> None:
        """Interrupt or restore the pilot's stick input."""
        if self._commander is not None:
            self._commander.pilot.lose_signal(failed, self._commander.time_us)

    # actuators

    def weaken_motors(self, mask: int, effectiveness: float) -> None:
        """Set the effectiveness of the motors in a bit mask (bit 0: the first); the others are sound."""
        for index in range(self._motors):
            self._vehicle.set_motor_effectiveness(index, effectiveness if mask >> index & 1 else 1.0)

    @property
    def _motors(self) -> int:
        aircraft = self._vehicle.airframe.kind is AirframeKind.FIXED_WING
        return 1 if aircraft else len(self._vehicle.airframe.effectiveness)

    def _motor(self, failure: int, instance: int) -> Result:
        motors = self._motors
        if failure not in _EFFECTIVENESS or not 0 <= instance <= motors or motors == 0:
            return Result.UNSUPPORTED
        for index in range(motors) if instance == 0 else (instance - 1,):
            self._vehicle.set_motor_effectiveness(index, _EFFECTIVENESS[failure])
        return Result.ACCEPTED

    def _servo(self, failure: int, instance: int) -> Result:
        airframe = self._vehicle.airframe
        aircraft = airframe.kind is AirframeKind.FIXED_WING
        known = failure in _EFFECTIVENESS or failure == _STUCK
        if not aircraft or not known or not 0 <= instance <= len(_SERVOS):
            return Result.UNSUPPORTED
        wanted = _SERVOS if instance == 0 else (_SERVOS[instance - 1],)
        servos = [role for role in wanted if role is not Role.THROTTLE and airframe.channel(role) is not None]
        if not servos:
            return Result.UNSUPPORTED
        for role in servos:
            self._vehicle.set_actuator_stuck(role, failure == _STUCK)
            self._vehicle.set_actuator_effectiveness(role, _EFFECTIVENESS.get(failure, 1.0))
        return Result.ACCEPTED
