"""The interface of missions to PX4 (v1.16 behaviour)."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.planning.limits import Limits, MulticopterLimits
from missions.vehicle.adapter import Mode, ModeCommand, missing_basics

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle

_AUTO: Final = 4
_HERE: Final = 0x7FFFFFFF
_SUB_MODES: Final = {Mode.TAKEOFF: 2, Mode.HOLD: 3, Mode.MISSION: 4, Mode.RETURN: 5, Mode.LAND: 6}
_NAMES: Final = {
    (1, 0): "Manual",
    (2, 0): "Altitude",
    (3, 0): "Position",
    (3, 1): "Orbit",
    (3, 2): "Position Slow",
    (4, 2): "Takeoff",
    (4, 3): "Hold",
    (4, 4): "Mission",
    (4, 5): "Return",
    (4, 6): "Land",
    (4, 8): "Follow",
    (4, 9): "Precision Land",
    (5, 0): "Acro",
    (6, 0): "Offboard",
    (7, 0): "Stabilized",
    (10, 0): "Termination",
}


def _custom_mode(mode: Mode) -> int:
    if mode is Mode.GUIDED:
        return 6 << 16
    if mode is Mode.POSITION:
        return 3 << 16
    return _AUTO << 16 | _SUB_MODES[mode] << 24


class Px4:
    """PX4: OFFBOARD needs setpoints before entry and continuously; mode commands are acknowledged twice."""

    name = "px4"
    kind = VehicleKind.MULTICOPTER
    modes: Mapping[Mode, int] = MappingProxyType({mode: _custom_mode(mode) for mode in Mode})
    stream_rates_hz: Mapping[str, float] = MappingProxyType(
        {
            "GLOBAL_POSITION_INT": 10.0,
            "LOCAL_POSITION_NED": 10.0,
            "ATTITUDE": 20.0,
            "ATTITUDE_TARGET": 10.0,
            "SYS_STATUS": 2.0,
            "EXTENDED_SYS_STATE": 5.0,
            "GPS_RAW_INT": 2.0,
            "MISSION_CURRENT": 1.0,
        }
    )
    bytewise_parameters = True
    setpoints_before_guided = True
    first_mission_item_is_home = False
    goto_mode = Mode.HOLD
    resting_mode = Mode.HOLD
    unset = math.nan
    roll_alone = False
    limiting_parameters: Mapping[str, float] = MappingProxyType({"MPC_XY_VEL_MAX": 12.0, "MPC_ACC_HOR": 3.0})

    def mode_name(self, custom_mode: int) -> str:
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24
        return _NAMES.get((main, sub), f"mode {main}.{sub}")

    def mode_command(self, mode: Mode) -> ModeCommand:
        if mode is Mode.GUIDED:
            return ModeCommand(main=6)
        if mode is Mode.POSITION:
            return ModeCommand(main=3)
        return ModeCommand(main=_AUTO, sub=_SUB_MODES[mode])

    def readiness(self, vehicle: "Vehicle") -> list[str]:
        return missing_basics(vehicle)

    async def prepare_arming(self, vehicle: "Vehicle") -> None:
        if vehicle.custom_mode not in (self.modes[Mode.HOLD], self.modes[Mode.MISSION]):
            await vehicle.set_mode(Mode.HOLD)

    async def take_off(self, vehicle: "Vehicle", altitude_m: float) -> None:
        nan = math.nan
        height_amsl = vehicle.home.alt_m + altitude_m
        await vehicle.command(dialect.MAV_CMD_NAV_TAKEOFF, -1.0, nan, nan, nan, nan, nan, height_amsl)

    async def start_streams(self, vehicle: "Vehicle") -> None:
        """Request only the messages that are missing in the link's set, because PX4 streams by default."""
        await vehicle.clock.sleep(1.2)
        for name, rate_hz in self.stream_rates_hz.items():
            if vehicle.message(name) is None:
                await vehicle.set_message_rate(name, rate_hz)

    async def start_mission(self, vehicle: "Vehicle") -> None:
        # the uploaded mission becomes available shortly after its acknowledgement: set_mode tries again
        await vehicle.set_mode(Mode.MISSION)
        if not vehicle.armed:
            await vehicle.arm()

    def limits(self, parameters: Mapping[str, float]) -> Limits:
        values = {**self.limiting_parameters, **parameters}
        return MulticopterLimits(speed_m_s=values["MPC_XY_VEL_MAX"], acceleration_m_s2=values["MPC_ACC_HOR"])

    async def acceptance_m(self, vehicle: "Vehicle", asked_m: float) -> float:
        return asked_m  # a waypoint's param2 is used

    async def own_acceptance_m(self, vehicle: "Vehicle") -> float:
        return await vehicle.parameter_or("NAV_ACC_RAD", 10.0)

    async def loiter(
        self, vehicle: "Vehicle", place: GeodeticPosition, radius_m: float | None, clockwise: bool
    ) -> None:
        raise PlanError("a multicopter does not circle a place by itself: use goto, or an orbit of your own")

    async def change_altitude(self, vehicle: "Vehicle", altitude_m: float) -> None:
        # INT32_MAX as latitude and longitude means the present place
        await vehicle.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL,
            (-1.0, 1.0, math.nan, math.nan),
            _HERE,
            _HERE,
            vehicle.home.alt_m + altitude_m,
        )

    async def change_airspeed(self, vehicle: "Vehicle", airspeed_m_s: float) -> None:
        raise PlanError("a multicopter has no airspeed to hold: use set_speed")

    def takeoff_item(self, home: GeodeticPosition, altitude_m: float) -> MissionItem:
        return MissionItem(
            command=dialect.MAV_CMD_NAV_TAKEOFF,
            param4=math.nan,
            x=home.lat_deg,
            y=home.lon_deg,
            z=altitude_m,
        )
