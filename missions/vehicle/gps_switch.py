"""Switches a vehicle's GPS off and on again by the means of its firmware, which are determined before
takeoff.
"""

from contextlib import suppress
from typing import Final

from autopilot_bridge.mavlink import command_name, dialect, enum_name
from missions.errors import MissionError, VehicleTimeout
from missions.gps_off import GpsOff
from missions.vehicle.vehicle import Vehicle

_GPS: Final = dialect.FAILURE_UNIT_SENSOR_GPS
_INJECT: Final = dialect.MAV_CMD_INJECT_FAILURE
_SIMULATED: Final = {"ardupilot": ({"SIM_GPS_DISABLE": 1.0},), "px4": ()}
"""Parameters of simulators only: values that switch GPS off, by firmware."""
_FUSION: Final = {
    "ardupilot": ({"EK3_SRC1_POSXY": 0.0, "EK3_SRC1_VELXY": 0.0},),
    "px4": ({"EKF2_GPS_CTRL": 0.0},),
}
"""Parameters that make the navigation filter ignore GPS, on real vehicles too."""


class GpsSwitch:
    """Switches the GPS of one vehicle off and on again.

    Args:
        vehicle: the vehicle.
        values: parameters that switch it off; empty: MAV_CMD_INJECT_FAILURE is used.
        before: values of these parameters while GPS is on.
    """

    def __init__(self, vehicle: Vehicle, values: dict[str, float], before: dict[str, float]) -> None:
        self._vehicle = vehicle
        self._values = values
        self._before = before

    @classmethod
    async def find(cls, vehicle: Vehicle, way: GpsOff) -> "GpsSwitch":
        """Find the way that this vehicle supports; GPS stays on.

        Raises:
            MissionError: there is none; the message names the alternative.
        """
        answer = ""
        if way is not GpsOff.PARAMETER:
            answer = await _refusal(vehicle)
            if not answer:
                return cls(vehicle, {}, {})
        firmware = vehicle.autopilot
        candidates: tuple[dict[str, float], ...] = ()
        if way is not GpsOff.FAILURE:
            candidates = _SIMULATED[firmware]
        if way is GpsOff.PARAMETER:
            candidates += _FUSION[firmware]
        for values in candidates:
            try:
                before = {name: await vehicle.parameter(name) for name in values}
            except VehicleTimeout:
                continue  # the vehicle has no such parameter
            return cls(vehicle, values, before)
        names = ", ".join(name for values in _FUSION[firmware] for name in values)
        by_parameter = (
            "" if way is GpsOff.PARAMETER else f", or with `gps_off=parameter` ({names}, restored afterwards)"
        )
        allow = ", or allow the command (SYS_FAILURE_EN 1)" if firmware == "px4" and answer else ""
        tried = f"{command_name(_INJECT)}: {answer}" if answer else "it has none of the parameters for it"
        raise MissionError(
            f"GPS can't be switched off in flight ({tried}); fly with `gps_fault=False` to orbit without "
            "using "
            f"it{by_parameter}{allow}"
        )

    async def off(self) -> None:
        """Switch GPS off.

        Raises:
            MissionError: the vehicle refused; GPS is on as before.
        """
        try:
            if not self._values:
                await self._vehicle.command(_INJECT, float(_GPS), float(dialect.FAILURE_TYPE_OFF), 0.0)
            await self._vehicle.set_parameters(self._values)
        except MissionError:
            with suppress(MissionError):  # the first error is reported
                await self.on()
            raise

    async def on(self) -> None:
        """Switch GPS on again; parameters get their previous values.

        Raises:
            MissionError: the vehicle refused. Parameters that it did not accept are in the notes.
        """
        vehicle = self._vehicle
        if not self._values:
            await vehicle.command(_INJECT, float(_GPS), float(dialect.FAILURE_TYPE_OK), 0.0)
            return
        failed: MissionError | None = None
        for name, value in self._before.items():
            try:
                await vehicle.set_parameter(name, value)
            except MissionError as error:
                vehicle.notes.warn(
                    f"parameter {name} was not restored to {value:g}; set it before the next flight"
                )
                failed = failed or error
        if failed is not None:
            raise failed


async def _refusal(vehicle: Vehicle) -> str:
    """The reason why the vehicle refuses to inject failures; "" when it accepts. The request uses failure
    type OK.
    """
    try:
        result = await vehicle.try_command(_INJECT, float(_GPS), float(dialect.FAILURE_TYPE_OK), 0.0)
    except VehicleTimeout:
        return "no answer"
    if result == dialect.MAV_RESULT_ACCEPTED:
        return ""
    return enum_name("MAV_RESULT", result) or f"result {result}"
