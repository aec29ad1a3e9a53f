"""Messages and stream groups of ArduPilot Copter 4.6, as seen on its links."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.dispatch import streams
from autopilot_bridge.firmware.data import load_data, message_ids
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import NavigationHealth
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.messages.common import (
    NAN,
    POSITION_TARGET_LOCAL_NED,
    TARGET_FIELDS,
    CommonMessages,
)
from autopilot_bridge.telemetry.fields import FieldValues, fields
from autopilot_bridge.telemetry.streams import Values
from flightsim.foundation.vectors import euler_of

_M = dialect

_DATA: Final = load_data("ardupilot", "messages.toml")

START_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(
    {_M.MAVLINK_MSG_ID_HEARTBEAT: 1, _M.MAVLINK_MSG_ID_TIMESYNC: 0.1}
)
"""What a copter sends before anything is requested: SRn_* are 0 (docs/firmware/ardupilot.md, section 1)."""


def _stream(name: str) -> int:
    return int(getattr(dialect, f"MAV_DATA_STREAM_{name}"))


STREAM_GROUPS: Final[Mapping[int, tuple[int, ...]]] = MappingProxyType(
    {_stream(name): message_ids(stream["messages"]) for name, stream in _DATA["streams"].items()}
)
"""REQUEST_DATA_STREAM groups (docs/firmware/ardupilot.md, section 2)."""

STREAM_RATE_PARAMETERS: Final[Mapping[int, str]] = MappingProxyType(
    {_stream(name): stream["rate"] for name, stream in _DATA["streams"].items()}
)
"""Ending of the SRn_ parameter that holds a group's rate."""

NOT_REQUESTABLE: Final = frozenset(message_ids(_DATA["not_requestable"]))
"""Messages that 4.6 refuses to send on request (docs/firmware/ardupilot.md, section 1)."""

_RSSI_UNKNOWN: Final = 255
_RC_NEUTRAL_US: Final = (1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800)
_POSITION_ONLY_MASK: Final = 0xFDF8
_FORCE_AND_FRAME_BITS: Final = 0xF200
_VELOCITY_MASK: Final = 0xC07
_SECONDS_PER_HOUR: Final = 3600.0
_AHRS: Final = fields("AHRS")
_EKF_STATUS_REPORT: Final = fields("EKF_STATUS_REPORT")
_RC_CHANNELS: Final = fields("RC_CHANNELS")
_TERRAIN_REPORT: Final = fields("TERRAIN_REPORT")
NAV_CONTROLLER_OUTPUT: Final = fields("NAV_CONTROLLER_OUTPUT")


class ArdupilotMessages(CommonMessages):
    """Builders of what ArduCopter sends."""

    @streams(_M.MAVLink_timesync_message)
    def timesync(self) -> Values:
        """TIMESYNC (111) request."""
        return (0, self.view.time_us * 1000, 0, 0)

    def airspeed_m_s(self) -> float:
        """Without an airspeed sensor ArduCopter shows its ground speed."""
        return self.view.refreshed().ground_speed_m_s

    @streams(_M.MAVLink_raw_imu_message)
    def raw_imu(self) -> Values | None:
        """RAW_IMU (27), scaled like SCALED_IMU."""
        values = self.raw_scaled_imu()
        return None if values is None else (self.view.time_us, *values, 0, self.temperature_cdeg())

    @streams(_M.MAVLink_scaled_imu2_message)
    def scaled_imu2(self) -> Values | None:
        """SCALED_IMU2 (116): the values of the first IMU."""
        return self.scaled_imu()

    @streams(_M.MAVLink_power_status_message)
    def power_status(self) -> Values:
        """POWER_STATUS (125)."""
        return (5000, 0, 0)

    @streams(_M.MAVLink_meminfo_message)
    def meminfo(self) -> Values:
        """MEMINFO (152): free memory of the emulated board."""
        return (0, 65535, 131072)

    @streams(_M.MAVLink_nav_controller_output_message)
    def nav_controller_output(self) -> Values | None:
        """NAV_CONTROLLER_OUTPUT (62)."""
        roll, pitch, _ = euler_of(self.parts.controller.attitude_setpoint.tolist())
        v = self.view.refreshed()
        bearing_deg, distance_m, alt_error_m = 0, 0.0, 0.0
        target = self.trajectory_setpoint()
        if target is not None and all(map(math.isfinite, target[:3])):
            north, east, down = (goal - here for goal, here in zip(target[:3], v.pos, strict=True))
            distance_m = math.hypot(north, east)
            bearing_deg = round(math.degrees(math.atan2(east, north))) % 360
            alt_error_m = -down
        heading_deg = round(math.degrees(v.yaw))
        return NAV_CONTROLLER_OUTPUT(
            nav_roll=math.degrees(roll) if math.isfinite(roll) else 0.0,
            nav_pitch=math.degrees(pitch) if math.isfinite(pitch) else 0.0,
            nav_bearing=heading_deg,
            target_bearing=bearing_deg,
            wp_dist=round(distance_m),
            alt_error=alt_error_m,
        )

    @streams(_M.MAVLink_rc_channels_message)
    def rc_channels(self) -> Values:
        """RC_CHANNELS (65): the simulated transmitter at rest."""
        pulses = {f"chan{number}_raw": pulse_us for number, pulse_us in enumerate(_RC_NEUTRAL_US, start=1)}
        return _RC_CHANNELS(
            time_boot_ms=self.view.time_ms, chancount=len(pulses), **pulses, rssi=_RSSI_UNKNOWN
        )

    @streams(_M.MAVLink_ahrs_message)
    def ahrs(self) -> Values:
        """AHRS (163): gyro bias estimate."""
        x, y, z = self.parts.navigation.state[nav.GYRO_BIAS_RAD_S].tolist()
        return _AHRS(omegaIx=x, omegaIy=y, omegaIz=z)

    @streams(_M.MAVLink_ahrs2_message)
    def ahrs2(self) -> Values | None:
        """AHRS2 (178)."""
        v = self.view.refreshed()
        if not v.has_global:
            return None
        return (v.roll, v.pitch, v.yaw, v.alt_amsl_m, v.lat_e7, v.lon_e7)

    @streams(_M.MAVLink_ekf_status_report_message)
    def ekf_status_report(self) -> Values:
        """EKF_STATUS_REPORT (193); variances are innovation test ratios, 1 at the gate."""
        health = self.parts.navigation.health
        return _EKF_STATUS_REPORT(
            flags=self.ekf_status_flags(),
            velocity_variance=finite(health.velocity_test_ratio),
            pos_horiz_variance=finite(health.position_horizontal_test_ratio),
            pos_vert_variance=finite(health.position_vertical_test_ratio),
            compass_variance=finite(health.magnetometer_test_ratio),
            terrain_alt_variance=finite(health.height_above_ground_test_ratio),
            airspeed_variance=finite(health.airspeed_test_ratio),
        )

    def ekf_status_flags(self) -> int:
        """EKF_STATUS_FLAGS."""
        return ekf_flags(self.parts.navigation.health, position_ready=self.parts.commander.situation.position)

    @streams(_M.MAVLink_esc_telemetry_1_to_4_message)
    def esc_telemetry(self) -> Values | None:
        """ESC_TELEMETRY_1_TO_4 (11030): voltage of the battery; the ESCs report no speed."""
        battery = self.view.battery
        if battery is None:
            return None
        voltage_cv = round(battery[0] * 100.0)
        current_ca = round(battery[1] * 25.0)
        used_mah = round(battery[2] * 250.0)
        count = (self.view.time_ms // 100) & 0xFFFF
        return (
            (32,) * 4,
            (voltage_cv,) * 4,
            (max(0, current_ca),) * 4,
            (used_mah,) * 4,
            (0,) * 4,
            (count,) * 4,
        )

    @streams(_M.MAVLink_terrain_report_message)
    def terrain_report(self) -> Values | None:
        """TERRAIN_REPORT (136): no terrain data is loaded."""
        v = self.view.refreshed()
        if not v.has_global:
            return None
        return _TERRAIN_REPORT(lat=v.lat_e7, lon=v.lon_e7)

    @streams(_M.MAVLink_wind_message)
    def wind(self) -> Values:
        """WIND (168); a copter without a drag model reports calm."""
        return (-180.0, 0.0, 0.0)

    def home_quaternion(self) -> tuple[float, float, float, float]:
        """ArduPilot leaves the quaternion out."""
        return (NAN, NAN, NAN, NAN)

    def extended_sys_state(self) -> Values:
        """EXTENDED_SYS_STATE (245): a copter reports VTOL in multicopter state."""
        return (dialect.MAV_VTOL_STATE_MC, int(self.context.landed_state))

    def battery_status(self) -> FieldValues | None:
        """BATTERY_STATUS (147): kind of battery unknown, energy in hectojoules from charge and voltage."""
        values = super().battery_status()
        battery = self.view.battery
        if values is None or battery is None:
            return None
        energy_hj = round(battery[0] * battery[2] * _SECONDS_PER_HOUR / 100.0)
        return values._replace(
            battery_function=dialect.MAV_BATTERY_FUNCTION_UNKNOWN,
            type=dialect.MAV_BATTERY_TYPE_UNKNOWN,
            energy_consumed=energy_hj,
        )

    def position_target_local_ned(self) -> Values | None:
        """POSITION_TARGET_LOCAL_NED (85): a position alone, or velocity and acceleration."""
        target = self.trajectory_setpoint()
        if target is None:
            return None
        if all(map(math.isfinite, target[:3])):
            mask, given = _POSITION_ONLY_MASK & ~_FORCE_AND_FRAME_BITS, slice(0, 3)
        else:
            mask, given = _VELOCITY_MASK, slice(3, 9)
        return POSITION_TARGET_LOCAL_NED(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
            type_mask=mask,
            **dict(zip(TARGET_FIELDS[given], map(finite, target[given]), strict=True)),
        )

    def position_target_global_int(self) -> FieldValues | None:
        """POSITION_TARGET_GLOBAL_INT (87): frame 0, altitude above mean sea level."""
        values = super().position_target_global_int()
        if values is None:
            return None
        return values._replace(
            coordinate_frame=dialect.MAV_FRAME_GLOBAL,
            type_mask=_POSITION_ONLY_MASK,
            **dict.fromkeys(TARGET_FIELDS[3:], 0.0),
        )


def finite(value: float) -> float:
    """The value, or 0 where nothing was measured yet."""
    return value if math.isfinite(value) else 0.0


def ekf_flags(health: NavigationHealth, *, position_ready: bool) -> int:
    """EKF_STATUS_FLAGS of the filter's health; 167 before the position is taken into use, 831 when it is."""
    if not health.attitude:
        return int(_M.EKF_UNINITIALIZED)
    horizontal = position_ready and health.position_horizontal_absolute
    waiting = health.constant_position or not position_ready
    flags = 0
    for bit, is_set in (
        (_M.EKF_ATTITUDE, health.attitude),
        (_M.EKF_VELOCITY_HORIZ, health.velocity_horizontal or waiting),
        (_M.EKF_VELOCITY_VERT, health.velocity_vertical),
        (_M.EKF_POS_HORIZ_REL, position_ready and health.position_horizontal_relative),
        (_M.EKF_POS_HORIZ_ABS, horizontal),
        (_M.EKF_POS_VERT_ABS, health.position_vertical_absolute),
        (_M.EKF_CONST_POS_MODE, waiting),
        (_M.EKF_PRED_POS_HORIZ_REL, horizontal),
        (_M.EKF_PRED_POS_HORIZ_ABS, horizontal),
        (_M.EKF_GPS_GLITCHING, health.gps_glitch),
    ):
        if is_set:
            flags |= bit
    return flags
