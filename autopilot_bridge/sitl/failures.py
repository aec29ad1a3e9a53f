"""Failures of a simulated vehicle: sensors, motors, servos, and data received by radio.

MAV_CMD_INJECT_FAILURE and the world's schedule inject them.

Source: FAILURE_UNIT and FAILURE_TYPE of MAVLink's common.xml. A unit, a type or an instance that the vehicle
does not have is UNSUPPORTED.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.sitl.received_units import RECEIVED_UNITS
from autopilot_bridge.sitl.simulator_parameters import SimulatorParameters
from flightsim.airframe import AirframeKind, Role
from flightsim.sensors import SensorSuite
from flightsim.sensors.fault_kinds import FaultType
from flightsim.sensors.fault_stage import FaultPoint
from flightsim.sensors.faults import UnsupportedFaultError
from flightsim.vehicle import Vehicle
from flightsim.world_spec import FaultSpec, FaultUnit

_OK: Final = dialect.FAILURE_TYPE_OK
_OFF: Final = dialect.FAILURE_TYPE_OFF
_STUCK: Final = dialect.FAILURE_TYPE_STUCK
_WRONG: Final = dialect.FAILURE_TYPE_WRONG
_SERVOS: Final = (Role.AILERON, Role.ELEVATOR, Role.THROTTLE, Role.RUDDER, Role.FLAPS)
"""Servo instances from 1, in ArduPilot's channel order."""

_EFFECTIVENESS: Final = {_OK: 1.0, _OFF: 0.0, _WRONG: 0.5}
"""Effectiveness of an actuator; WRONG stands for a damaged propeller or a slipped linkage."""

NEVER_US: Final = 1 << 62

_RECEIVED_WITHOUT_SIGNAL: Final = frozenset({dialect.MAV_CMD_INJECT_FAILURE})


class FailureInjector:
    """Executes FAILURE_UNIT, FAILURE_TYPE and instance (0: all of them).

    It is also the autopilot's `Simulation`: it applies failures to data received by messages, and the
    simulator's parameters.

    Args:
        vehicle: the vehicle whose actuators fail.
        sensors: its sensors.
    """

    def __init__(self, vehicle: Vehicle, sensors: SensorSuite) -> None:
        self._vehicle = vehicle
        self._sensors = sensors
        self._signal_lost = False
        self._lose_radio: Callable[[bool], None] | None = None
        self._parameters = SimulatorParameters(vehicle, sensors, self.fail_radio, self.weaken_motors)
        self._others: Mapping[int, Callable[[int, int], bool]] = {
            dialect.FAILURE_UNIT_SYSTEM_MOTOR: self._motor,
            dialect.FAILURE_UNIT_SYSTEM_SERVO: self._servo,
            dialect.FAILURE_UNIT_SYSTEM_RC_SIGNAL: self._radio,
            dialect.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL: self._link,
        }
        self._entries: dict[int, FaultPoint] = {
            int(unit.target.unit): sensors.add_elsewhere(unit.target, size=unit.size, rate_hz=unit.rate_hz)
            for unit in RECEIVED_UNITS
        }

    def connect(self, store: ParameterStore, lose_radio: Callable[[bool], None]) -> None:
        """An autopilot has booted: use its parameters and its pilot input from now on."""
        self._lose_radio = lose_radio
        self._signal_lost = False
        store.subscribe(lambda name, value: self._parameters.changed(store, name))
        self._parameters.apply(store)

    def vehicle_restarted(self) -> None:
        """The simulated vehicle has started again, in the air that it started in."""
        self._parameters.vehicle_restarted()

    def inject(self, unit: int, failure: int, instance: int) -> Result:
        """Switch a failure on or off; UNSUPPORTED for a unit or a failure that the vehicle does not have."""
        try:
            self.fail(unit, failure, instance=instance)
        except ValueError:
            return Result.UNSUPPORTED
        return Result.ACCEPTED

    def fail(self, unit: int, failure: int, *, instance: int = 0, **options: Any) -> None:
        """Switch a failure on, in a form that the options define (`FaultPanel.inject`), or off.

        Raises:
            ValueError: the vehicle does not have this unit, failure, instance or form.
        """
        other = self._others.get(unit)
        if other is None:
            self._sensors.faults.inject(unit, failure, instance=instance, **options)
        elif options or not other(failure, instance):
            raise UnsupportedFaultError(
                f"failure {failure} of unit {unit}, instance {instance}, options {sorted(options)}: "
                "not possible on this vehicle"
            )

    def _radio(self, failure: int, instance: int) -> bool:
        if failure not in (_OK, _OFF) or instance not in (0, 1):
            return False
        self.fail_radio(failure == _OFF)
        return True

    def _link(self, failure: int, instance: int) -> bool:
        if failure not in (_OK, _OFF) or instance not in (0, 1):
            return False
        self._signal_lost = failure == _OFF
        return True

    # data received by messages

    def apply_failure(self, unit: int, values: NDArray[np.float64]) -> bool:
        """Apply a failure to a sample received by a message; False when the sample is lost."""
        point = self._entries[unit]
        return point.deliver(values)

    def drops_message(self, command: int | None) -> bool:
        """True: the autopilot receives no messages, except the command that ends the failure.

        Args:
            command: MAV_CMD of a COMMAND_LONG or COMMAND_INT; None: another message.
        """
        return self._signal_lost and command not in _RECEIVED_WITHOUT_SIGNAL

    def fail_radio(self, failed: bool) -> None:
        """Interrupt or restore the pilot's stick input."""
        if self._lose_radio is not None:
            self._lose_radio(failed)

    # actuators

    def weaken_motors(self, mask: int, effectiveness: float) -> None:
        """Set the effectiveness of the motors in a bit mask (bit 0: the first); the others are sound."""
        for index in range(self._motors):
            self._vehicle.set_motor_effectiveness(index, effectiveness if mask >> index & 1 else 1.0)

    @property
    def _motors(self) -> int:
        aircraft = self._vehicle.airframe.kind is AirframeKind.FIXED_WING
        return 1 if aircraft else len(self._vehicle.airframe.effectiveness)

    def _motor(self, failure: int, instance: int) -> bool:
        motors = self._motors
        if failure not in _EFFECTIVENESS or not 0 <= instance <= motors or motors == 0:
            return False
        for index in range(motors) if instance == 0 else (instance - 1,):
            self._vehicle.set_motor_effectiveness(index, _EFFECTIVENESS[failure])
        return True

    def _servo(self, failure: int, instance: int) -> bool:
        airframe = self._vehicle.airframe
        aircraft = airframe.kind is AirframeKind.FIXED_WING
        known = failure in _EFFECTIVENESS or failure == _STUCK
        if not aircraft or not known or not 0 <= instance <= len(_SERVOS):
            return False
        wanted = _SERVOS if instance == 0 else (_SERVOS[instance - 1],)
        servos = [role for role in wanted if role is not Role.THROTTLE and airframe.channel(role) is not None]
        if not servos:
            return False
        for role in servos:
            self._vehicle.set_actuator_stuck(role, failure == _STUCK)
            self._vehicle.set_actuator_effectiveness(role, _EFFECTIVENESS.get(failure, 1.0))
        return True


class FaultSchedule:
    """Scheduled faults of one vehicle.

    Args:
        faults: the faults. Each is switched on and off once now, before the first step, to check it.
        injector: executes them.

    Attributes:
        next_us: vehicle time of the next change.

    Raises:
        ValueError: the vehicle can't have one of the faults.
    """

    def __init__(self, faults: Sequence[FaultSpec], injector: FailureInjector) -> None:
        self._injector = injector
        self._active: dict[tuple[FaultUnit, int], FaultSpec] = {}
        changes = []
        for fault in faults:
            try:
                injector.fail(fault.unit, fault.failure, instance=fault.instance, **fault.options)
                injector.fail(fault.unit, FaultType.OK, instance=fault.instance)
            except ValueError as error:
                words = f"{fault.failure.name.lower()} of {fault.unit.name.lower()}"
                raise ValueError(f"vehicle {fault.vehicle} can't have the fault {words}: {error}") from error
            changes.append((round(fault.start_s * 1e6), True, fault))
            if fault.duration_s is not None:
                changes.append((round((fault.start_s + fault.duration_s) * 1e6), False, fault))
        self._changes = sorted(changes, key=lambda change: change[:2])
        self.next_us = self._changes[0][0] if changes else NEVER_US

    def apply(self, time_us: int) -> None:
        """Make the changes that are due. The end of a fault that another one has replaced changes nothing."""
        while self._changes and self._changes[0][0] <= time_us:
            _, begins, fault = self._changes.pop(0)
            if begins:
                self._active[fault.unit, fault.instance] = fault
                self._injector.fail(fault.unit, fault.failure, instance=fault.instance, **fault.options)
            elif self._active.get((fault.unit, fault.instance)) is fault:
                self._injector.fail(fault.unit, FaultType.OK, instance=fault.instance)
        self.next_us = self._changes[0][0] if self._changes else NEVER_US
