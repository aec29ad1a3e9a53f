"""The actions of a vehicle that differ between PX4 and ArduPilot."""

from typing import Final, Protocol

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition
from missions.vehicle.link import VehicleLink

PREARM: Final = "pre-arm checks"
"""Name of the autopilot's own checks in the result of `Adapter.readiness`."""


class Adapter(Protocol):
    """The actions of one firmware, which have no state of their own.

    `missions.vehicle.firmware.Firmware` has the differences that are plain data.
    """

    def readiness(self) -> list[str]:
        """Names of what is still missing before the vehicle can be armed; empty when it is ready."""
        ...

    async def prepare_arming(self) -> None:
        """Switch to a mode in which arming is allowed."""
        ...

    async def take_off(self, altitude_m: float) -> None:
        """Command the armed vehicle to take off."""
        ...

    async def start_streams(self) -> None:
        """Request the telemetry that a mission needs, if the firmware doesn't send it by default."""
        ...

    async def start_mission(self) -> None:
        """Start the uploaded mission, on the ground or in the air."""
        ...

    async def acceptance_m(self, requested_m: float) -> float:
        """The radius within which a waypoint counts as reached."""
        ...

    async def own_acceptance_m(self) -> float:
        """The acceptance radius of a waypoint that specifies none."""
        ...

    async def change_altitude(self, altitude_m: float) -> None:
        """Command a height above home; the rest of the flight does not change."""
        ...

    async def loiter(self, place: GeodeticPosition, radius_m: float | None, clockwise: bool) -> None:
        """Command a fixed wing to circle a place."""
        ...

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        """Command an airspeed to a fixed wing; the rest of the flight does not change."""
        ...


def missing_basics(link: VehicleLink) -> list[str]:
    """The messages that every firmware must have sent before the vehicle can be armed, and that were not
    received.
    """
    missing = []
    status = link.message("SYS_STATUS")
    if status is None or not status.onboard_control_sensors_health & dialect.MAV_SYS_STATUS_PREARM_CHECK:
        missing.append(PREARM)
    if link.message("HOME_POSITION") is None:
        missing.append("home position")
    if link.message("GLOBAL_POSITION_INT") is None:
        missing.append("position estimate")
    return missing
