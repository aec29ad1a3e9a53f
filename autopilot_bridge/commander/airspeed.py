"""Monitoring of an aircraft's airspeed sensor in flight."""

from autopilot_bridge.commander.events import AirspeedChanged
from autopilot_bridge.commander.health import VehicleHealth


class AirspeedWatch:
    """Reports when the sensor is disabled while armed, and when it is used again."""

    __slots__ = ("_valid",)

    def __init__(self) -> None:
        self._valid = True

    def update(self, health: VehicleHealth, *, armed: bool, time_us: int) -> AirspeedChanged | None:
        """Check the newest health; returns the change, or None."""
        if not armed or not health.has_airspeed:
            self._valid = True
        elif health.airspeed is not self._valid:
            self._valid = health.airspeed
            return AirspeedChanged(time_us=time_us, valid=health.airspeed)
        return None
