"""Watching the airspeed sensor of an aircraft in flight."""

from autopilot_bridge.commander.events import AirspeedChanged
from autopilot_bridge.commander.health import VehicleHealth


class AirspeedWatch:
    """Tells when the sensor is given up while armed, and when it is used again."""

    __slots__ = ("_valid",)

    def __init__(self) -> None:
        self._valid = True

    def update(self, health: VehicleHealth, *, armed: bool, time_us: int) -> AirspeedChanged | None:
        """Look at the newest health; the change, if there is one."""
        if not armed or not health.has_airspeed:
            self._valid = True
        elif health.airspeed is not self._valid:
            self._valid = health.airspeed
            return AirspeedChanged(time_us=time_us, valid=health.airspeed)
        return None
