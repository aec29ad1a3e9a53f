"""Messages and stream sets of PX4 v1.16, as seen on its onboard and ground-station links."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.dispatch import streams
from autopilot_bridge.firmware.data import load_data, message_rates
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import UNKNOWN_UINT16, e7
from autopilot_bridge.navigation import NavigationHealth
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.messages.common import (
    ATTITUDE_TARGET,
    NAN,
    POSITION_TARGET_LOCAL_NED,
    TARGET_FIELDS,
    CommonMessages,
)
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.telemetry.fields import FieldValues, fields
from autopilot_bridge.telemetry.streams import Values
from autopilot_bridge.telemetry.view import pressure_altitude_m

_M = dialect
_ESTIMATOR_STATUS: Final = fields("ESTIMATOR_STATUS")
_ORBIT_EXECUTION_STATUS: Final = fields("ORBIT_EXECUTION_STATUS")
_ALTITUDE: Final = fields("ALTITUDE")
_FLIGHT_INFORMATION: Final = fields("FLIGHT_INFORMATION")
_OPEN_DRONE_ID_LOCATION: Final = fields("OPEN_DRONE_ID_LOCATION")
_OPEN_DRONE_ID_SYSTEM: Final = fields("OPEN_DRONE_ID_SYSTEM")
_ACTUATOR_OUTPUTS: Final = 32  # fields of ACTUATOR_OUTPUT_STATUS

_DATA: Final = load_data("px4", "messages.toml")
ONBOARD_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(
    {**message_rates(_DATA["onboard_rates_hz"]), _M.MAVLink_current_event_sequence_message.id: 1 / 3}
)
"""PX4's ONBOARD mode (UDP 14540; docs/firmware/px4.md, section 6)."""

GCS_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(message_rates(_DATA["gcs_rates_hz"]))
"""PX4's NORMAL mode with raised rates (UDP 14550; docs/firmware/px4.md, section 6)."""

_TARGET_BITS: Final = (1, 2, 4, 8, 16, 32, 64, 128, 256, 1024, 2048)
"""POSITION_TARGET_TYPEMASK of position, velocity, acceleration (north, east, down), yaw and yaw rate."""

_FREE_FALL_M_S2: Final = 100.0
"""Downward acceleration that PX4 commands while the motors are off."""

_PROTOCOL_VERSION: Final = fields("PROTOCOL_VERSION")
_MAVLINK_LIBRARY: Final = tuple(bytes.fromhex("776d5582cee4f017"))
"""Revision of the MAVLink library of 1.16.1, as PROTOCOL_VERSION has it."""

ODID_EPOCH_UNIX_S: Final = 1546300800
"""2019-01-01, the epoch of Open Drone ID's system time stamp."""


class Px4Messages(CommonMessages):
    """Builders of PX4's messages."""

    servo_unused_us = 900
    servo_disarmed_us = 900
    gps_timeout_us = 1_000_000
    gps_sent_before_first = False

    def __init__(self, parts: AutopilotParts) -> None:
        super().__init__(parts)
        self._ping_sequence = -1
        self._armed_us = self._takeoff_us = 0

    def follow(self, event: events.Event) -> None:
        """Keep the times of the flight."""
        if isinstance(event, events.Armed):
            self._armed_us, self._takeoff_us = event.time_us, 0
        elif isinstance(event, events.Disarmed):
            self._armed_us = self._takeoff_us = 0
        elif isinstance(event, events.TakeoffDetected):
            self._takeoff_us = event.time_us

    @streams(_M.MAVLink_ping_message)
    def ping(self) -> Values:
        """PING (4), to all systems."""
        self._ping_sequence += 1
        return (self.view.time_us, self._ping_sequence, 0, 0)

    @streams(_M.MAVLink_flight_information_message)
    def flight_information(self) -> FieldValues:
        """FLIGHT_INFORMATION (264). PX4's times are since its boot, 0 while disarmed or on the ground."""
        return _FLIGHT_INFORMATION(
            time_boot_ms=self.view.time_ms,
            arming_time_utc=self._armed_us,
            takeoff_time_utc=self._takeoff_us,
            flight_uuid=int(self.parts.parameters.get("COM_FLIGHT_UUID") or 0),
        )

    @streams(_M.MAVLink_protocol_version_message)
    def protocol_version(self) -> FieldValues:
        """PROTOCOL_VERSION (300): MAVLink 2, from 1 on."""
        return _PROTOCOL_VERSION(
            version=200, min_version=100, max_version=200, library_version_hash=_MAVLINK_LIBRARY
        )

    @streams(_M.MAVLink_actuator_output_status_message)
    def actuator_output_status(self) -> Values:
        """ACTUATOR_OUTPUT_STATUS (375): the pulses of SERVO_OUTPUT_RAW."""
        _, _, *pulses = self.servo_output_raw()
        return (self.view.time_us, len(pulses), (*pulses, *(0.0,) * (_ACTUATOR_OUTPUTS - len(pulses))))

    @streams(_M.MAVLink_timesync_message)
    def timesync(self) -> Values:
        """TIMESYNC (111) request, nanoseconds since boot."""
        return (0, self.view.time_us * 1000, 0, 0)

    @streams(_M.MAVLink_altitude_message)
    def altitude(self) -> Values | None:
        """ALTITUDE (141): monotonic is the barometer's, terrain is relative to the local origin."""
        v = self.view.refreshed()
        if not v.has_global:
            return None
        clearance_m = float(self.parts.navigation.state[nav.HEIGHT_ABOVE_GROUND_M])
        local_m = -v.pos[2]
        pressure_pa, _ = v.pressure()
        return _ALTITUDE(
            time_usec=v.time_us,
            altitude_monotonic=pressure_altitude_m(pressure_pa) if math.isfinite(pressure_pa) else NAN,
            altitude_amsl=v.alt_amsl_m,
            altitude_local=local_m,
            altitude_relative=v.alt_relative_m,
            altitude_terrain=local_m - clearance_m if math.isfinite(clearance_m) else NAN,
            bottom_clearance=clearance_m,
        )

    def attitude_target(self) -> Values | None:
        """ATTITUDE_TARGET (83), at rest too: level, with the present heading, motors off."""
        target = super().attitude_target()
        if target is not None or not self.parts.navigation.health.attitude:
            return target
        half_yaw = 0.5 * self.view.refreshed().yaw
        level = (math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw))
        return ATTITUDE_TARGET(time_boot_ms=self.view.time_ms, q=level)

    def position_target_local_ned(self) -> Values | None:
        """POSITION_TARGET_LOCAL_NED (85), at rest too; a quantity that is not commanded is NaN, and
        masked.
        """
        target = self.trajectory_setpoint()
        if target is None:
            if self.context.armed or not self.parts.navigation.health.attitude:
                return None
            target = [NAN] * 6 + [0.0, 0.0, _FREE_FALL_M_S2, self.view.refreshed().yaw, 0.0]
        else:  # PX4 shows the output of its position controller
            computed = self.parts.controller.velocity_setpoint_ned_m_s.tolist()
            target[3:6] = [
                made if math.isnan(commanded) else commanded
                for commanded, made in zip(target[3:6], computed, strict=True)
            ]
        mask = sum(bit for bit, value in zip(_TARGET_BITS, target, strict=True) if math.isnan(value))
        return POSITION_TARGET_LOCAL_NED(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
            type_mask=mask,
            **dict(zip(TARGET_FIELDS, target, strict=True)),
        )

    @streams(_M.MAVLink_estimator_status_message)
    def estimator_status(self) -> FieldValues:
        """ESTIMATOR_STATUS (230). PX4's ratios are squared: (innovation / gate)^2."""
        health = self.parts.navigation.health
        return _ESTIMATOR_STATUS(
            time_usec=self.view.time_us,
            flags=estimator_flags(health),
            vel_ratio=health.velocity_test_ratio**2,
            pos_horiz_ratio=health.position_horizontal_test_ratio**2,
            pos_vert_ratio=health.position_vertical_test_ratio**2,
            mag_ratio=health.magnetometer_test_ratio**2,
            hagl_ratio=health.height_above_ground_test_ratio**2,
            tas_ratio=NAN,
            pos_horiz_accuracy=health.position_horizontal_accuracy_m,
            pos_vert_accuracy=health.position_vertical_accuracy_m,
        )

    @streams(_M.MAVLink_orbit_execution_status_message)
    def orbit_execution_status(self) -> FieldValues | None:
        """ORBIT_EXECUTION_STATUS (360), while circling."""
        orbit = self.parts.commander.tasks.orbit
        frame = self.context.frame
        if orbit is None or frame is None:
            return None
        radius_m, north_m, east_m, down_m = orbit
        lat_deg, lon_deg, alt_m = frame.geodetic_from_ned(north_m, east_m, down_m)
        return _ORBIT_EXECUTION_STATUS(
            time_usec=self.view.time_us,
            radius=radius_m,
            frame=dialect.MAV_FRAME_GLOBAL_INT,
            x=e7(lat_deg),
            y=e7(lon_deg),
            z=alt_m,
        )

    @streams(_M.MAVLink_current_mode_message)
    def current_mode(self) -> Values:
        """CURRENT_MODE (436)."""
        return self.parts.status.current_mode()

    @streams(_M.MAVLink_open_drone_id_location_message)
    def open_drone_id_location(self) -> Values | None:
        """OPEN_DRONE_ID_LOCATION (12901), ASTM F3411."""
        v = self.view.refreshed()
        if not v.has_global:
            return None
        airborne = int(self.context.landed_state) != dialect.MAV_LANDED_STATE_ON_GROUND
        course_cdeg = round(math.degrees(math.atan2(v.vel[1], v.vel[0])) % 360.0 * 100.0) % 36000
        pressure_pa, _ = v.pressure()
        return _OPEN_DRONE_ID_LOCATION(
            status=dialect.MAV_ODID_STATUS_AIRBORNE if airborne else dialect.MAV_ODID_STATUS_GROUND,
            direction=course_cdeg,
            speed_horizontal=round(v.ground_speed_m_s * 100.0),
            speed_vertical=round(-v.vel[2] * 100.0),
            latitude=v.lat_e7,
            longitude=v.lon_e7,
            altitude_barometric=pressure_altitude_m_or_unknown(pressure_pa),
            altitude_geodetic=v.alt_amsl_m,
            height_reference=dialect.MAV_ODID_HEIGHT_REF_OVER_TAKEOFF,
            height=v.alt_relative_m,
            horizontal_accuracy=dialect.MAV_ODID_HOR_ACC_1_METER,
            vertical_accuracy=dialect.MAV_ODID_VER_ACC_1_METER,
            barometer_accuracy=dialect.MAV_ODID_VER_ACC_UNKNOWN,
            speed_accuracy=dialect.MAV_ODID_SPEED_ACC_1_METERS_PER_SECOND,
            timestamp=float(UNKNOWN_UINT16),
            timestamp_accuracy=dialect.MAV_ODID_TIME_ACC_0_2_SECOND,  # a receiver's interval
        )

    @streams(_M.MAVLink_open_drone_id_system_message)
    def open_drone_id_system(self) -> Values | None:
        """OPEN_DRONE_ID_SYSTEM (12904): the operator is assumed at home."""
        home = self.home_place()
        if home is None:
            return None
        unix_s = (self.parts.memory.unix_epoch_us + self.view.time_us) // 1_000_000
        return _OPEN_DRONE_ID_SYSTEM(
            operator_location_type=dialect.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF,
            classification_type=dialect.MAV_ODID_CLASSIFICATION_TYPE_UNDECLARED,
            operator_latitude=home[0],
            operator_longitude=home[1],
            area_count=1,
            area_ceiling=-1000.0,
            area_floor=-1000.0,
            category_eu=dialect.MAV_ODID_CATEGORY_EU_UNDECLARED,
            class_eu=dialect.MAV_ODID_CLASS_EU_UNDECLARED,
            operator_altitude_geo=home[2] * 1e-3,
            timestamp=max(0, unix_s - ODID_EPOCH_UNIX_S),
        )


def pressure_altitude_m_or_unknown(pressure_pa: float) -> float:
    """Pressure altitude, or -1000 (unknown in ASTM F3411) without a barometer."""
    return pressure_altitude_m(pressure_pa) if math.isfinite(pressure_pa) else -1000.0


def estimator_flags(health: NavigationHealth) -> int:
    """ESTIMATOR_STATUS_FLAGS of the filter's health."""
    flags = 0
    for bit, is_set in (
        (_M.ESTIMATOR_ATTITUDE, health.attitude),
        (_M.ESTIMATOR_VELOCITY_HORIZ, health.velocity_horizontal),
        (_M.ESTIMATOR_VELOCITY_VERT, health.velocity_vertical),
        (_M.ESTIMATOR_POS_HORIZ_REL, health.position_horizontal_relative),
        (_M.ESTIMATOR_POS_HORIZ_ABS, health.position_horizontal_absolute),
        (_M.ESTIMATOR_POS_VERT_ABS, health.position_vertical_absolute),
        (_M.ESTIMATOR_POS_VERT_AGL, health.position_vertical_agl),
        (_M.ESTIMATOR_CONST_POS_MODE, health.constant_position),
        (_M.ESTIMATOR_PRED_POS_HORIZ_REL, health.predicted_position_horizontal_relative),
        (_M.ESTIMATOR_PRED_POS_HORIZ_ABS, health.predicted_position_horizontal_absolute),
        (_M.ESTIMATOR_GPS_GLITCH, health.gps_glitch),
        (_M.ESTIMATOR_ACCEL_ERROR, health.accel_error),
    ):
        if is_set:
            flags |= bit
    return flags
