"""What missions know of PX4 (v1.16) and ArduPilot (4.6), by class of vehicle."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.firmware_frames import ArduPilotFrame, Px4Frame
from missions.kind import VehicleKind
from missions.vehicle.firmware import Firmware, Mode
from missions.vehicle.limits import FixedWingLimits, Limits, MulticopterLimits

_DATA: Final = tomllib.loads(
    files("missions.vehicle").joinpath("firmware_records.toml").read_text(encoding="utf-8")
)


def _tables(name: str) -> dict[str, Any]:
    """The tables of a record, read-only; those that a class of vehicle lacks are those of its firmware."""
    tables = _DATA[name]
    read: dict[str, Any] = {
        key: MappingProxyType(tables[key]) for key in ("stream_rates_hz", "limiting_parameters")
    }
    if "modes" in tables:
        modes = {Mode[mode]: _custom_mode(number) for mode, number in tables["modes"].items()}
        names = {_custom_mode(number): name for number, name in tables["mode_names"].items()}
        left = frozenset(_custom_mode(number) for number in tables["left_before_arming"])
        of_command = {
            getattr(dialect, f"MAV_CMD_{command}"): tuple(map(_custom_mode, numbers))
            for command, numbers in tables["modes_of_command"].items()
        }
        instead, following = (
            {modes[Mode[mode]]: tuple(map(_custom_mode, numbers)) for mode, numbers in tables[key].items()}
            for key in ("modes_instead", "modes_following")
        )
        read.update(
            modes=MappingProxyType(modes),
            mode_names=MappingProxyType(names),
            modes_of_command=MappingProxyType(of_command),
            modes_instead=MappingProxyType(instead),
            modes_following=MappingProxyType(following),
            left_before_arming=left,
        )
    return read


def _custom_mode(number: int | str) -> int:
    """A custom mode from its number, or from PX4's main and sub mode ("4.3")."""
    main, dot, sub = str(number).partition(".")
    return int(main) << 16 | int(sub) << 24 if dot else int(main)


# PX4


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
    **_tables("px4_copter"),
    sub_modes=True,
    bytewise_parameters=True,
    setpoints_before_guided=True,
    first_mission_item_is_home=False,
    failsafe_status_acts=True,
    goto_mode=Mode.HOLD,
    resting_mode=Mode.HOLD,
    placeless_in_mission_frame=True,
    unwrapped_fences=True,
    frame_at=Px4Frame,
    unset=math.nan,
    altitude_radius=("NAV_MC_ALT_RAD", 0.8),
    system_id_parameter="MAV_SYS_ID",
    limits_from=_px4_copter_limits,
)

PX4_PLANE: Final = replace(
    PX4_COPTER,
    kind=VehicleKind.FIXED_WING,
    **_tables("px4_plane"),
    altitude_radius=None,  # its take-off ends above the altitude
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
    **_tables("arducopter"),
    sub_modes=False,
    bytewise_parameters=False,
    setpoints_before_guided=False,
    first_mission_item_is_home=True,
    failsafe_status_acts=False,
    goto_mode=Mode.GUIDED,
    resting_mode=Mode.GUIDED,
    placeless_in_mission_frame=False,
    unwrapped_fences=False,
    frame_at=ArduPilotFrame,
    unset=0.0,  # NaN is refused
    system_id_parameter="SYSID_THISMAV",
    limits_from=_arducopter_limits,
)

ARDUPLANE: Final = replace(
    ARDUCOPTER,
    kind=VehicleKind.FIXED_WING,
    **_tables("arduplane"),
    roll_alone=True,
    takeoff_pitch_deg=12.0,
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
