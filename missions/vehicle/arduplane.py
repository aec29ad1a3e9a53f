"""The interface of missions to ArduPilot's plane (4.6 behaviour)."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.kind import VehicleKind
from missions.planning.limits import FixedWingLimits, Limits
from missions.vehicle.adapter import Mode
from missions.vehicle.ardupilot import ArduCopter

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle

_NAMES: Final[Mapping[int, str]] = MappingProxyType(
    {
        0: "Manual",
        1: "Circle",
        2: "Stabilize",
        3: "Training",
        4: "Acro",
        5: "FBWA",
        6: "FBWB",
        7: "Cruise",
        8: "Autotune",
        10: "Auto",
        11: "RTL",
        12: "Loiter",
        13: "Takeoff",
        14: "Avoid ADSB",
        15: "Guided",
        16: "Initialising",
        24: "Thermal",
    }
)
_TURN_EFFECT: Final = 0.85
"""Share of a coordinated turn's acceleration that a planned bank is assumed to give. It is between 1, without
sideslip, and the 0.7 of ArduPilot 4.6.3's built-in plane model, which slips in its turns.
"""
_TAKEOFF_PITCH_DEG: Final = 12.0  # lowest pitch in a mission's takeoff


class ArduPlane(ArduCopter):
    """ArduPilot plane: takes off in TAKEOFF, lands only in AUTO, may control pitch and throttle itself."""

    kind = VehicleKind.FIXED_WING
    # LOITER: circles where it is. It lands by a mission's landing only: LAND is the way home
    modes: Mapping[Mode, int] = MappingProxyType(
        {
            Mode.HOLD: 12,
            Mode.TAKEOFF: 13,
            Mode.GUIDED: 15,
            Mode.MISSION: 10,
            Mode.RETURN: 11,
            Mode.LAND: 11,
            Mode.POSITION: 7,
        }
    )
    stream_rates_hz: Mapping[str, float] = MappingProxyType(
        {
            "GLOBAL_POSITION_INT": 10.0,
            "LOCAL_POSITION_NED": 10.0,
            "ATTITUDE": 20.0,
            "VFR_HUD": 10.0,
            "EXTENDED_SYS_STATE": 5.0,
        }
    )
    roll_alone = True
    limiting_parameters: Mapping[str, float] = MappingProxyType(
        {
            "AIRSPEED_MIN": 10.0,
            "AIRSPEED_CRUISE": 22.0,
            "AIRSPEED_MAX": 30.0,
            "ROLL_LIMIT_DEG": 65.0,
            "NAVL1_PERIOD": 17.0,
            "NAVL1_DAMPING": 0.75,
            "RLL2SRV_TCONST": 0.5,
        }
    )

    def mode_name(self, custom_mode: int) -> str:
        return _NAMES.get(custom_mode, f"mode {custom_mode}")

    async def take_off(self, vehicle: "Vehicle", altitude_m: float) -> None:
        await vehicle.set_parameter("TKOFF_ALT", altitude_m)
        await vehicle.set_mode(Mode.TAKEOFF)

    async def start_mission(self, vehicle: "Vehicle") -> None:
        await vehicle.set_mode(Mode.MISSION)
        if not vehicle.armed:
            await vehicle.arm_here()  # the takeoff roll begins with arming

    def limits(self, parameters: Mapping[str, float]) -> Limits:
        values = {**self.limiting_parameters, **parameters}
        period_s, damping = max(1.0, values["NAVL1_PERIOD"]), max(0.1, values["NAVL1_DAMPING"])
        # L1 demands 4 damping^2 V^2 / L1 sin(angle to the leg), with L1 = damping period V / pi. In a bend
        # the leg has to be so far ahead of the course that this is the acceleration of the bend
        lead_s = period_s / (4.0 * math.pi * damping) / _TURN_EFFECT
        return FixedWingLimits(
            airspeed_min_m_s=values["AIRSPEED_MIN"],
            airspeed_trim_m_s=values["AIRSPEED_CRUISE"],
            airspeed_max_m_s=values["AIRSPEED_MAX"],
            bank_max_rad=math.radians(values["ROLL_LIMIT_DEG"]),
            bank_parameter="ROLL_LIMIT_DEG",
            guidance_s=damping * period_s / math.pi,
            guidance_parameter="NAVL1_PERIOD",
            waypoint_lead_s=lead_s + max(0.0, values["RLL2SRV_TCONST"]),
        )

    async def own_acceptance_m(self, vehicle: "Vehicle") -> float:
        return await vehicle.parameter_or("WP_RADIUS", 90.0)

    async def loiter(
        self, vehicle: "Vehicle", place: GeodeticPosition, radius_m: float | None, clockwise: bool
    ) -> None:
        await vehicle.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL,
            (-1.0, 1.0, radius_m or 0.0, 0.0 if clockwise else 1.0),
            round(place.lat_deg * 1e7),
            round(place.lon_deg * 1e7),
            place.alt_m,
        )

    async def change_altitude(self, vehicle: "Vehicle", altitude_m: float) -> None:
        await vehicle.command_int(
            dialect.MAV_CMD_GUIDED_CHANGE_ALTITUDE,
            dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
            (0.0, 0.0, 0.0, 0.0),
            0,
            0,
            altitude_m,
        )

    async def change_airspeed(self, vehicle: "Vehicle", airspeed_m_s: float) -> None:
        await vehicle.command_int(
            dialect.MAV_CMD_GUIDED_CHANGE_SPEED,
            dialect.MAV_FRAME_GLOBAL,
            (0.0, airspeed_m_s, 0.0, 0.0),
            0,
            0,
            0.0,
        )

    async def acceptance_m(self, vehicle: "Vehicle", asked_m: float) -> float:
        return min(asked_m, 255.0)  # largest value of param2

    def takeoff_item(self, home: GeodeticPosition, altitude_m: float) -> MissionItem:
        return MissionItem(
            command=dialect.MAV_CMD_NAV_TAKEOFF,
            param1=_TAKEOFF_PITCH_DEG,
            x=home.lat_deg,
            y=home.lon_deg,
            z=altitude_m,
        )
