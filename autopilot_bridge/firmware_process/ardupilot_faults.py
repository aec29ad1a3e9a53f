"""Scheduled faults of a world's sensors as changes of the parameters of ArduPilot's simulator.

ArduPilot's SITL makes its sensors itself, so that a fault of the world's sensor changes nothing there. Its
simulator has parameters for some of them. Faults of motors and servos are the vehicle's, and need none.
"""

from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from flightsim.sensors.fault_kinds import FaultType
from flightsim.world_spec import FaultSpec, FaultUnit

_PARAMETERS: Final[Mapping[tuple[FaultUnit, FaultType], tuple[str, float]]] = {
    (FaultUnit.GPS, FaultType.OFF): ("SIM_GPS_DISABLE", 1.0),
    (FaultUnit.BARO, FaultType.OFF): ("SIM_BARO_DISABLE", 1.0),
    (FaultUnit.BARO, FaultType.STUCK): ("SIM_BARO_FREEZE", 1.0),
    (FaultUnit.MAG, FaultType.OFF): ("SIM_MAG1_FAIL", 1.0),
    (FaultUnit.GYRO, FaultType.OFF): ("SIM_GYR_FAIL_MSK", 127.0),
    (FaultUnit.ACCEL, FaultType.OFF): ("SIM_ACC_FAIL_MSK", 127.0),
    (FaultUnit.RC_SIGNAL, FaultType.OFF): ("SIM_RC_FAIL", 1.0),
}
_OF_THE_VEHICLE: Final = frozenset({FaultUnit.MOTOR, FaultUnit.SERVO})


class ParameterChange(NamedTuple):
    """A parameter that gets a value at a vehicle time."""

    time_us: int
    name: str
    value: float


def parameter_changes(faults: Iterable[FaultSpec], system_id: int) -> list[ParameterChange]:
    """The changes by which the faults of one vehicle begin and end, in order of time.

    Raises:
        ValueError: a fault for which ArduPilot's simulator has no parameter; the message lists those that it
            has.
    """
    changes = []
    for fault in faults:
        if fault.vehicle != system_id or fault.unit in _OF_THE_VEHICLE:
            continue
        known = _PARAMETERS.get((fault.unit, fault.failure))
        if known is None or fault.options:
            accepted = ", ".join(f"{unit.name} {failure.name}" for unit, failure in _PARAMETERS)
            raise ValueError(
                f"fault {fault.unit.name} {fault.failure.name}: ArduPilot makes its sensors itself, and its "
                f"simulator has no parameter for it; accepted, without a form: {accepted}"
            )
        name, value = known
        changes.append(ParameterChange(round(fault.start_s * 1e6), name, value))
        if fault.duration_s is not None:
            changes.append(ParameterChange(round((fault.start_s + fault.duration_s) * 1e6), name, 0.0))
    return sorted(changes, key=lambda change: change.time_us)
