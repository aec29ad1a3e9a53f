"""The reasons that PX4 sends as events only: why it does not arm, or does not fly a mission.

An event is a number, the hash of its name; a client decodes it by metadata of several hundred kB that the
vehicle serves. The reasons alone are few, so their names are listed here, in words of this project.

Source: PX4 1.16.1, names in Commander's HealthAndArmingChecks and navigator's FeasibilityChecker; numbers and
levels by mavlink.io/en/services/events.html.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink.event_ids import event_sub_id

_SUB_ID_BITS: Final = 0xFFFFFF
_LEVEL_BITS: Final = 0x0F  # the level for the pilot; the upper half is that for the log
_WARNING: Final = 4  # MAV_SEVERITY

_WORDS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "navigator_mis_add_land_or_rm_to": "mission rejected: it needs a landing, or no takeoff",
        "navigator_mis_add_to_or_rm_land": "mission rejected: it needs a takeoff, or no landing",
        "navigator_mis_approach_wp_below_land": "mission rejected: the approach begins below the landing",
        "navigator_mis_geofence_no_home": "mission rejected: the geofence needs a home",
        "navigator_mis_geofence_no_home2": "mission rejected: the geofence needs a home",
        "navigator_mis_geofence_violation": "mission rejected: an item is outside the geofence",
        "navigator_mis_glide_slope_too_steep": "mission rejected: the landing approach is too steep",
        "navigator_mis_invalid_land": "mission rejected: no landing behind DO_LAND_START",
        "navigator_mis_land_before_rtl": "mission rejected: a return behind DO_LAND_START",
        "navigator_mis_land_missing": "mission rejected: a landing is required",
        "navigator_mis_land_wp_inside_orbit_radius": "mission rejected: the landing is inside the circle",
        "navigator_mis_multiple_land": "mission rejected: more than one DO_LAND_START",
        "navigator_mis_no_home_rel_alt": "mission rejected: heights above home, and no home",
        "navigator_mis_no_pos_lock": "mission not checked: no position yet",
        "navigator_mis_starts_w_landing": "mission rejected: it begins with a landing",
        "navigator_mis_starts_w_landing2": "mission rejected: it begins with a landing",
        "navigator_mis_takeoff_missing": "mission rejected: a takeoff is required",
        "navigator_mis_takeoff_not_first": "mission rejected: the takeoff is not the first place",
        "navigator_mis_takeoff_or_land_missing": "mission rejected: a takeoff and a landing are required",
        "navigator_mis_takeoff_too_low": "mission rejected: the takeoff is below home",
        "navigator_mis_unsup_cmd": "mission rejected: a command is not supported",
        "navigator_mis_unsupported_landing_approach_wp": "mission rejected: the item before the landing",
        "navigator_mis_vtol_items": "mission rejected: items for VTOL vehicles",
        "check_battery_low": "the battery is low",
        "check_battery_critical": "the battery is critically low",
        "check_battery_missing": "a battery is missing",
        "check_cpuload_too_high": "the processor load is too high",
        "check_gf_no_home": "the geofence needs a home",
        "check_man_control_kill_engaged": "the kill switch is engaged",
        "check_missing_fmu_sdcard": "the memory card is missing",
        "check_mission_failure": "the mission can't be flown",
        "check_modes_angular_velocity": "no angular velocity",
        "check_modes_attitude": "no attitude estimate",
        "check_modes_cannot_takeoff": "this mode can't take off",
        "check_modes_global_pos": "no global position estimate",
        "check_modes_home_position": "no home position",
        "check_modes_local_alt": "no height estimate",
        "check_modes_local_pos": "no local position estimate",
        "check_modes_manual_control": "no manual control input",
        "check_modes_mission": "no valid mission",
        "check_modes_offboard_signal": "no setpoints",
        "check_parachute_missing": "the parachute is missing",
        "check_rc_dl_no_dllink": "no ground station is connected",
        "check_system_arm_auth_failed": "arming is not authorized",
        "check_system_flight_term_active": "flight termination is active",
        "check_system_safety_button": "the safety button is not pressed",
        "check_system_usb_connected": "USB is connected",
    }
)
_PLAIN: Final = (  # their names are their words
    *("check_accel_missing", "check_accel_no_data", "check_accel_not_calibrated", "check_airspeed_invalid"),
    *("check_airspeed_no_data", "check_baro_missing", "check_baro_no_data", "check_battery_disconnected"),
    *("check_battery_emergency", "check_battery_fault", "check_battery_unhealthy", "check_escs_fault"),
    *("check_escs_offline", "check_estimator_gnss_fault", "check_estimator_gps_fix_too_low"),
    *("check_estimator_gps_generic", "check_estimator_gps_hor_pos_drift_too_high"),
    *("check_estimator_gps_hor_pos_err_too_high", "check_estimator_gps_hor_speed_drift_too_high"),
    *("check_estimator_gps_not_fusing", "check_estimator_gps_num_sats_too_low"),
    *("check_estimator_gps_pdop_too_high", "check_estimator_gps_speed_acc_too_low"),
    *("check_estimator_gps_vert_pos_drift_too_high", "check_estimator_gps_vert_pos_err_too_high"),
    *("check_estimator_gps_vert_speed_drift_too_high", "check_estimator_heading_not_stable"),
    *("check_estimator_hgt_not_stable", "check_estimator_high_accel_bias", "check_estimator_high_gyro_bias"),
    *("check_estimator_hor_pos_not_stable", "check_estimator_hor_vel_not_stable"),
    *("check_estimator_mag_fault", "check_estimator_mag_interference", "check_estimator_missing_data"),
    *("check_estimator_vert_vel_not_stable", "check_gyro_missing", "check_gyro_no_data"),
    *("check_gyro_not_calibrated", "check_imu_accel_inconsistent", "check_imu_gyro_inconsistent"),
    *("check_mag_consistency", "check_mag_fault", "check_mag_missing", "check_mag_no_data"),
    *("check_mag_not_calibrated", "check_ram_usage_too_high"),
)
_WORDS_OF_ID: Final[Mapping[int, str]] = MappingProxyType(
    {
        event_sub_id(name): words
        for name, words in {
            **{name: name.removeprefix("check_").replace("_", " ") for name in _PLAIN},
            **_WORDS,
        }.items()
    }
)


def reason(event_id: int, log_levels: int) -> tuple[int, str] | None:
    """Severity and words of a reason; None: the event is none, or its level is below a warning.

    Args:
        event_id, log_levels: fields of EVENT.
    """
    words = _WORDS_OF_ID.get(event_id & _SUB_ID_BITS)
    severity = log_levels & _LEVEL_BITS
    return None if words is None or severity > _WARNING else (severity, words)
