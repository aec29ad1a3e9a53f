"""The messages of the gimbal component, as device and as manager of gimbal protocol v2."""

import math
from typing import Any, Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import GIMBAL_COMPONENT
from autopilot_bridge.payload.component import fixed_text
from flightsim.foundation.vectors import euler_of, yaw_of
from flightsim.payload import Gimbal, GimbalFlags

_CAPABILITIES: Final = int(
    dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_RETRACT
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_NEUTRAL
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_AXIS
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_FOLLOW
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_LOCK
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_AXIS
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_FOLLOW
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME
)
_ROLL_CAPABILITIES: Final = int(
    dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_AXIS
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_LOCK
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_FOLLOW
)
_ENDLESS: Final = int(dialect.GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_INFINITE_YAW)
_POINTS_AT_PLACE: Final = int(dialect.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)


def status_flags(gimbal: Gimbal) -> int:
    """Flags of the active command, with the frame in which yaw is reported."""
    flags = int(gimbal.flags) & ~int(GimbalFlags.YAW_IN_VEHICLE_FRAME | GimbalFlags.YAW_IN_EARTH_FRAME)
    locked = flags & GimbalFlags.YAW_LOCK
    frame = GimbalFlags.YAW_IN_EARTH_FRAME if locked else GimbalFlags.YAW_IN_VEHICLE_FRAME
    return flags | int(frame) | int(dialect.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME)


def attitude_status(gimbal: Gimbal) -> MAVLinkMessage:
    """GIMBAL_DEVICE_ATTITUDE_STATUS."""
    flags = status_flags(gimbal)
    in_earth = bool(flags & GimbalFlags.YAW_IN_EARTH_FRAME)
    earth, vehicle = gimbal.measured_q_ned_from_gimbal, gimbal.measured_q_heading_from_gimbal
    delta_yaw = math.remainder(yaw_of(earth.tolist()) - yaw_of(vehicle.tolist()), math.tau)
    rates = gimbal.measured_rates_rad_s.tolist()
    failure = dialect.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT if gimbal.limits_reached[1] else 0
    failure |= dialect.GIMBAL_DEVICE_ERROR_FLAGS_AT_YAW_LIMIT if gimbal.limits_reached[2] else 0
    failure |= dialect.GIMBAL_DEVICE_ERROR_FLAGS_AT_ROLL_LIMIT if gimbal.limits_reached[0] else 0
    return dialect.MAVLink_gimbal_device_attitude_status_message(
        target_system=0,
        target_component=0,
        time_boot_ms=(max(0, gimbal.time_us) // 1000) & 0xFFFFFFFF,
        flags=flags,
        q=(earth if in_earth else vehicle).tolist(),
        angular_velocity_x=rates[0],
        angular_velocity_y=rates[1],
        angular_velocity_z=rates[2],
        failure_flags=failure,
        delta_yaw=delta_yaw,
        delta_yaw_velocity=math.nan,
        gimbal_device_id=0,
    )


def mount_orientation(gimbal: Gimbal, time_ms: int) -> MAVLinkMessage:
    """MOUNT_ORIENTATION, of the protocol's first version: roll and pitch against the horizon, degrees."""
    roll, pitch, yaw = euler_of(gimbal.measured_q_heading_from_gimbal.tolist())
    return dialect.MAVLink_mount_orientation_message(
        time_boot_ms=time_ms,
        roll=math.degrees(roll),
        pitch=math.degrees(pitch),
        yaw=math.degrees(yaw),
        yaw_absolute=math.degrees(yaw_of(gimbal.measured_q_ned_from_gimbal.tolist())) % 360.0,
    )


def manager_information(gimbal: Gimbal, time_ms: int) -> MAVLinkMessage:
    """GIMBAL_MANAGER_INFORMATION."""
    capabilities = _device_capabilities(gimbal) | _POINTS_AT_PLACE
    return dialect.MAVLink_gimbal_manager_information_message(
        time_boot_ms=time_ms, cap_flags=capabilities, gimbal_device_id=GIMBAL_COMPONENT, **_limits(gimbal)
    )


def device_information(gimbal: Gimbal, time_ms: int) -> MAVLinkMessage:
    """GIMBAL_DEVICE_INFORMATION."""
    return dialect.MAVLink_gimbal_device_information_message(
        time_boot_ms=time_ms,
        vendor_name=fixed_text("flightstack", 32),
        model_name=fixed_text("simulated gimbal", 32),
        custom_name=fixed_text("", 32),
        firmware_version=0x01000000,
        hardware_version=0x01000000,
        uid=0,
        cap_flags=_device_capabilities(gimbal) & 0xFFFF,
        custom_cap_flags=0,
        **_limits(gimbal),
    )


def _limits(gimbal: Gimbal) -> dict[str, Any]:
    """Fields of both INFORMATION messages."""
    p = gimbal.parameters
    roll_rad = p.roll_limit_rad if p.axes == 3 else 0.0
    return {
        "roll_min": -roll_rad,
        "roll_max": roll_rad,
        "pitch_min": p.pitch_min_rad,
        "pitch_max": p.pitch_max_rad,
        "yaw_min": -p.yaw_limit_rad,
        "yaw_max": p.yaw_limit_rad,
    }


def _device_capabilities(gimbal: Gimbal) -> int:
    p = gimbal.parameters
    capabilities = _CAPABILITIES | (_ROLL_CAPABILITIES if p.axes == 3 else 0)
    return capabilities | (_ENDLESS if p.yaw_limit_rad >= math.pi else 0)
