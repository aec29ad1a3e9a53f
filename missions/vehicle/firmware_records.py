"""What missions know of PX4 (v1.16) and ArduPilot (4.6), by class of vehicle."""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect
from missions.kind import VehicleKind
from missions.planning.limits import FixedWingLimits, Limits, MulticopterLimits
from missions.vehicle.firmware import Firmware, Mode

# PX4


def _px4_mode(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


def _px4_copter_limits(values: Mapping[str, float]) -> Limits:
    return MulticopterLimits(speed_m_s=values["MPC_XY_VEL_MAX"], acceleration_m_s2=values["MPC_ACC_HOR"])


def _px4_plane_limits(values: Mapping[str, float]) -> Limits:
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


PX4_COPTER: Final = Firmware(
    name="px4",
    kind=VehicleKind.MULTICOPTER,
    modes=MappingProxyType(
        {
            Mode.HOLD: _px4_mode(4, 3),
            Mode.TAKEOFF: _px4_mode(4, 2),
            Mode.GUIDED: _px4_mode(6),
            Mode.MISSION: _px4_mode(4, 4),
            Mode.RETURN: _px4_mode(4, 5),
            Mode.LAND: _px4_mode(4, 6),
            Mode.POSITION: _px4_mode(3),
        }
    ),
    mode_names=MappingProxyType(
        {
            _px4_mode(1): "Manual",
            _px4_mode(2): "Altitude",
            _px4_mode(3): "Position",
            _px4_mode(3, 1): "Orbit",
            _px4_mode(3, 2): "Position Slow",
            _px4_mode(4, 2): "Takeoff",
            _px4_mode(4, 3): "Hold",
            _px4_mode(4, 4): "Mission",
            _px4_mode(4, 5): "Return",
            _px4_mode(4, 6): "Land",
            _px4_mode(4, 8): "Follow",
            _px4_mode(4, 9): "Precision Land",
            _px4_mode(5): "Acro",
            _px4_mode(6): "Offboard",
            _px4_mode(7): "Stabilized",
            _px4_mode(10): "Termination",
        }
    ),
    sub_modes=True,
    stream_rates_hz=MappingProxyType(
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
    ),
    bytewise_parameters=True,
    setpoints_before_guided=True,
    first_mission_item_is_home=False,
    goto_mode=Mode.HOLD,
    resting_mode=Mode.HOLD,
    unset=math.nan,
    limiting_parameters=MappingProxyType({"MPC_XY_VEL_MAX": 12.0, "MPC_ACC_HOR": 3.0}),
    limits_from=_px4_copter_limits,
)

PX4_PLANE: Final = replace(
    PX4_COPTER,
    kind=VehicleKind.FIXED_WING,
    stream_rates_hz=MappingProxyType({**PX4_COPTER.stream_rates_hz, "VFR_HUD": 10.0}),
    limiting_parameters=MappingProxyType(
        {
            "FW_AIRSPD_MIN": 10.0,
            "FW_AIRSPD_TRIM": 15.0,
            "FW_AIRSPD_MAX": 20.0,
            "FW_R_LIM": 50.0,
            "NPFG_PERIOD": 10.0,
            "NPFG_DAMPING": 0.7,
        }
    ),
    limits_from=_px4_plane_limits,
)

# ArduPilot

_TURN_EFFECT: Final = 0.85
"""Share of a coordinated turn's acceleration that a planned bank is assumed to give. It is between 1, without
sideslip, and the 0.7 of ArduPilot 4.6.3's built-in plane model, which slips in its turns.
"""


def _arducopter_limits(values: Mapping[str, float]) -> Limits:
    return MulticopterLimits(
        speed_m_s=0.01 * values["WPNAV_SPEED"], acceleration_m_s2=0.01 * values["WPNAV_ACCEL"]
    )


def _arduplane_limits(values: Mapping[str, float]) -> Limits:
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


ARDUCOPTER: Final = Firmware(
    name="ardupilot",
    kind=VehicleKind.MULTICOPTER,
    # HOLD is BRAKE: it holds position without a pilot's sticks, which LOITER would follow (throttle low:
    # descend)
    modes=MappingProxyType(
        {
            Mode.HOLD: 17,
            Mode.TAKEOFF: 4,
            Mode.GUIDED: 4,
            Mode.MISSION: 3,
            Mode.RETURN: 6,
            Mode.LAND: 9,
            Mode.POSITION: 5,
        }
    ),
    mode_names=MappingProxyType(
        {
            0: "Stabilize",
            1: "Acro",
            2: "Alt Hold",
            3: "Auto",
            4: "Guided",
            5: "Loiter",
            6: "RTL",
            7: "Circle",
            9: "Land",
            11: "Drift",
            13: "Sport",
            14: "Flip",
            15: "AutoTune",
            16: "PosHold",
            17: "Brake",
            18: "Throw",
            19: "Avoid ADSB",
            20: "Guided NoGPS",
            21: "Smart RTL",
            22: "FlowHold",
            23: "Follow",
            24: "ZigZag",
            25: "SystemID",
            26: "Autorotate",
            27: "Auto RTL",
            28: "Turtle",
        }
    ),
    sub_modes=False,
    stream_rates_hz=MappingProxyType(
        {
            "GLOBAL_POSITION_INT": 10.0,
            "LOCAL_POSITION_NED": 20.0,
            "ATTITUDE": 20.0,
            "ATTITUDE_TARGET": 20.0,
            "POSITION_TARGET_LOCAL_NED": 10.0,
            "EXTENDED_SYS_STATE": 5.0,
        }
    ),
    bytewise_parameters=False,
    setpoints_before_guided=False,
    first_mission_item_is_home=True,
    goto_mode=Mode.GUIDED,
    resting_mode=Mode.GUIDED,
    unset=0.0,  # NaN is refused
    limiting_parameters=MappingProxyType({"WPNAV_SPEED": 1000.0, "WPNAV_ACCEL": 250.0}),
    limits_from=_arducopter_limits,
)

ARDUPLANE: Final = replace(
    ARDUCOPTER,
    kind=VehicleKind.FIXED_WING,
    # HOLD is LOITER: it circles where it is. A plane lands by a mission's landing only: LAND is the way home
    modes=MappingProxyType(
        {
            Mode.HOLD: 12,
            Mode.TAKEOFF: 13,
            Mode.GUIDED: 15,
            Mode.MISSION: 10,
            Mode.RETURN: 11,
            Mode.LAND: 11,
            Mode.POSITION: 7,
        }
    ),
    mode_names=MappingProxyType(
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
    ),
    stream_rates_hz=MappingProxyType(
        {
            "GLOBAL_POSITION_INT": 10.0,
            "LOCAL_POSITION_NED": 10.0,
            "ATTITUDE": 20.0,
            "VFR_HUD": 10.0,
            "EXTENDED_SYS_STATE": 5.0,
        }
    ),
    roll_alone=True,
    takeoff_pitch_deg=12.0,
    limiting_parameters=MappingProxyType(
        {
            "AIRSPEED_MIN": 10.0,
            "AIRSPEED_CRUISE": 22.0,
            "AIRSPEED_MAX": 30.0,
            "ROLL_LIMIT_DEG": 65.0,
            "NAVL1_PERIOD": 17.0,
            "NAVL1_DAMPING": 0.75,
            "RLL2SRV_TCONST": 0.5,
        }
    ),
    limits_from=_arduplane_limits,
)

FIRMWARES: Final[Mapping[tuple[str, VehicleKind], Firmware]] = MappingProxyType(
    {(record.name, record.kind): record for record in (PX4_COPTER, PX4_PLANE, ARDUCOPTER, ARDUPLANE)}
)
"""Records by name of the firmware and class of vehicle."""

FIRMWARE_NAMES: Final[Mapping[int, str]] = MappingProxyType(
    {dialect.MAV_AUTOPILOT_PX4: "px4", dialect.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot"}
)
"""Names of the firmwares by HEARTBEAT.autopilot."""
