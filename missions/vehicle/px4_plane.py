"""The interface of missions to PX4's fixed wing (v1.16 behaviour)."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.kind import VehicleKind
from missions.planning.limits import FixedWingLimits, Limits
from missions.vehicle.px4 import Px4

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle


class Px4Plane(Px4):
    """PX4 fixed wing: OFFBOARD needs roll, pitch and thrust together; circles are flown by DO_ORBIT."""

    kind = VehicleKind.FIXED_WING
    stream_rates_hz: Mapping[str, float] = MappingProxyType({**Px4.stream_rates_hz, "VFR_HUD": 10.0})
    limiting_parameters: Mapping[str, float] = MappingProxyType(
        {
            "FW_AIRSPD_MIN": 10.0,
            "FW_AIRSPD_TRIM": 15.0,
            "FW_AIRSPD_MAX": 20.0,
            "FW_R_LIM": 50.0,
            "NPFG_PERIOD": 10.0,
            "NPFG_DAMPING": 0.7,
        }
    )

    def limits(self, parameters: Mapping[str, float]) -> Limits:
        values = {**self.limiting_parameters, **parameters}
        return FixedWingLimits(
            airspeed_min_m_s=values["FW_AIRSPD_MIN"],
            airspeed_trim_m_s=values["FW_AIRSPD_TRIM"],
            airspeed_max_m_s=values["FW_AIRSPD_MAX"],
            bank_max_rad=math.radians(values["FW_R_LIM"]),
            bank_parameter="FW_R_LIM",
            guidance_s=max(0.1, values["NPFG_DAMPING"]) * max(1.0, values["NPFG_PERIOD"]) / math.pi,
            # waypoint_lead_s is 0: PX4 determines the switch to the next leg itself
            guidance_parameter="NPFG_PERIOD",
        )

    async def loiter(
        self, vehicle: "Vehicle", place: GeodeticPosition, radius_m: float | None, clockwise: bool
    ) -> None:
        if radius_m is None:
            radius_m = abs(await vehicle.parameter_or("NAV_LOITER_RAD", 80.0))
        # PX4 1.16.1 ignores the radius of DO_REPOSITION: it circles clockwise with NAV_LOITER_RAD.
        # DO_ORBIT takes a signed radius, and an aircraft stays in Hold with it
        await vehicle.command_int(
            dialect.MAV_CMD_DO_ORBIT,
            dialect.MAV_FRAME_GLOBAL,
            (radius_m if clockwise else -radius_m, math.nan, 0.0, math.nan),
            round(place.lat_deg * 1e7),
            round(place.lon_deg * 1e7),
            place.alt_m,
        )

    async def change_airspeed(self, vehicle: "Vehicle", airspeed_m_s: float) -> None:
        await vehicle.command(dialect.MAV_CMD_DO_CHANGE_SPEED, 0.0, airspeed_m_s, -1.0)

    async def acceptance_m(self, vehicle: "Vehicle", asked_m: float) -> float:
        return max(asked_m, await vehicle.parameter_or("NAV_ACC_RAD", 10.0))

    def takeoff_item(self, home: GeodeticPosition, altitude_m: float) -> MissionItem:
        return MissionItem(
            command=dialect.MAV_CMD_NAV_TAKEOFF,
            param4=math.nan,
            x=home.lat_deg,
            y=home.lon_deg,
            z=altitude_m,
        )
