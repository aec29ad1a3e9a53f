"""The differences between PX4 and ArduPilot for a mission."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final, Protocol

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.kind import VehicleKind

if TYPE_CHECKING:
    from missions.planning.limits import Limits
    from missions.vehicle.vehicle import Vehicle


PREARM: Final = "pre-arm checks"
"""Name of the autopilot's own checks in the result of `Adapter.readiness`."""


class Mode(StrEnum):
    """Flight modes that a mission commands, named by the vehicle's behaviour."""

    HOLD = "hold"
    TAKEOFF = "takeoff"
    GUIDED = "guided"
    MISSION = "mission"
    RETURN = "return"
    LAND = "land"
    POSITION = "position"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeCommand:
    """Parameters of MAV_CMD_DO_SET_MODE after the base mode."""

    main: float
    sub: float = 0.0


class Adapter(Protocol):
    """The behaviour of one autopilot firmware. Stateless: the state is in the vehicle object.

    Attributes:
        name: "px4" or "ardupilot".
        kind: class of vehicle.
        modes: HEARTBEAT.custom_mode of each mode.
        stream_rates_hz: rates of the telemetry that a mission needs.
        bytewise_parameters: whether integers are sent as bit patterns in PARAM_VALUE (PX4), not as numbers.
        setpoints_before_guided: whether setpoints must be streamed before the guided mode can be entered.
        first_mission_item_is_home: whether item 0 of a mission is always home, regardless of the uploaded
            item.
        goto_mode: the mode after DO_REPOSITION.
        resting_mode: a mode in which the vehicle may stand on the ground and be armed.
        unset: value of a command or item parameter that is not set.
        roll_alone: whether a roll command in the guided mode may leave pitch and throttle to the autopilot.
        limiting_parameters: the parameters that `limits` reads.
    """

    name: str
    kind: VehicleKind
    modes: Mapping[Mode, int]
    stream_rates_hz: Mapping[str, float]
    bytewise_parameters: bool
    setpoints_before_guided: bool
    first_mission_item_is_home: bool
    goto_mode: Mode
    resting_mode: Mode
    unset: float
    roll_alone: bool
    limiting_parameters: Mapping[str, float]

    def mode_name(self, custom_mode: int) -> str:
        """The firmware's own name of a mode."""
        ...

    def mode_command(self, mode: Mode) -> ModeCommand:
        """The parameters of DO_SET_MODE for a mode."""
        ...

    def readiness(self, vehicle: "Vehicle") -> list[str]:
        """Names of what is still missing before the vehicle can be armed; empty when it is ready."""
        ...

    async def prepare_arming(self, vehicle: "Vehicle") -> None:
        """Switch to a mode in which arming is allowed."""
        ...

    async def take_off(self, vehicle: "Vehicle", altitude_m: float) -> None:
        """Command the armed vehicle to take off."""
        ...

    async def start_streams(self, vehicle: "Vehicle") -> None:
        """Request the telemetry that a mission needs, if the firmware doesn't send it by default."""
        ...

    async def start_mission(self, vehicle: "Vehicle") -> None:
        """Start the uploaded mission, on the ground or in the air."""
        ...

    def limits(self, parameters: Mapping[str, float]) -> "Limits":
        """The limits for a planner, from the vehicle's parameters.

        Args:
            parameters: those named in `limiting_parameters`; a missing one has the firmware's default.
        """
        ...

    async def acceptance_m(self, vehicle: "Vehicle", asked_m: float) -> float:
        """The radius within which a waypoint counts as reached."""
        ...

    async def own_acceptance_m(self, vehicle: "Vehicle") -> float:
        """The acceptance radius of a waypoint that specifies none."""
        ...

    async def loiter(
        self, vehicle: "Vehicle", place: GeodeticPosition, radius_m: float | None, clockwise: bool
    ) -> None:
        """Command a fixed wing to circle a place."""
        ...

    async def change_altitude(self, vehicle: "Vehicle", altitude_m: float) -> None:
        """Command a height above home; the rest of the flight does not change."""
        ...

    async def change_airspeed(self, vehicle: "Vehicle", airspeed_m_s: float) -> None:
        """Command an airspeed; the rest of the flight does not change."""
        ...

    def takeoff_item(self, home: GeodeticPosition, altitude_m: float) -> MissionItem:
        """The first item of a mission that begins on the ground."""
        ...


def missing_basics(vehicle: "Vehicle") -> list[str]:
    """The messages that every firmware must have sent before the vehicle can be armed, and that were not
    received.
    """
    missing = []
    status = vehicle.message("SYS_STATUS")
    if status is None or not status.onboard_control_sensors_health & dialect.MAV_SYS_STATUS_PREARM_CHECK:
        missing.append(PREARM)
    if vehicle.message("HOME_POSITION") is None:
        missing.append("home position")
    if vehicle.message("GLOBAL_POSITION_INT") is None:
        missing.append("position estimate")
    return missing
