"""Messages and stream sets of PX4 v1.16 on a fixed wing, as recorded from its airplane in flight."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.dispatch import streams
from autopilot_bridge.firmware.px4 import messages as px4
from autopilot_bridge.firmware.px4.messages import Px4Messages
from autopilot_bridge.flight.context import LandedState
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import e7
from autopilot_bridge.services.messages.aircraft import AircraftAir, AircraftState
from autopilot_bridge.services.messages.common import (
    NAN,
    POSITION_TARGET_GLOBAL_INT,
    POSITION_TARGET_LOCAL_NED,
    TARGET_FIELDS,
)
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.telemetry.fields import FieldValues, fields
from autopilot_bridge.telemetry.streams import Values

_M = dialect

ONBOARD_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(
    {**px4.ONBOARD_RATES_HZ, _M.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: 10, _M.MAVLINK_MSG_ID_WIND_COV: 10}
)
"""PX4's ONBOARD mode (UDP 14540; docs/firmware/px4.md, section 6)."""

GCS_RATES_HZ: Final[Mapping[int, float]] = MappingProxyType(
    {
        **px4.GCS_RATES_HZ,
        _M.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: 1,
        _M.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: 1,
        _M.MAVLINK_MSG_ID_ORBIT_EXECUTION_STATUS: 2,
        _M.MAVLINK_MSG_ID_WIND_COV: 0.5,
    }
)
"""PX4's NORMAL mode (UDP 14550): the multicopter's as recorded, and the firmware's defaults for the rest."""

_NEUTRAL_US: Final = 1500
_TRAVEL_US: Final = 500.0
_STOPPED_US: Final = 900
_PLACE_MASK: Final = 0xDF8  # velocity, acceleration, yaw and yaw rate are not given
_NOTHING: Final = dict.fromkeys(TARGET_FIELDS[3:], NAN)
_NAV_CONTROLLER_OUTPUT: Final = fields("NAV_CONTROLLER_OUTPUT")
_WIND_COV: Final = fields("WIND_COV")


class Px4PlaneMessages(AircraftAir, Px4Messages):
    """Builders of what PX4 sends on a fixed wing."""

    def __init__(self, parts: AutopilotParts) -> None:
        super().__init__(parts)
        self._aircraft = AircraftState(parts)
        self._has_flown = False

    def servo_output_raw(self) -> Values:
        """SERVO_OUTPUT_RAW (36): aileron, elevator, rudder, motor; 900 us for outputs without an actuator."""
        aileron = elevator = rudder = motor = _STOPPED_US
        if self.context.armed:
            surfaces = self._aircraft.surfaces
            aileron = _NEUTRAL_US + round(_TRAVEL_US * surfaces.aileron)
            elevator = _NEUTRAL_US + round(_TRAVEL_US * surfaces.elevator)
            rudder = _NEUTRAL_US + round(_TRAVEL_US * surfaces.rudder)
            if self._aircraft.powered:
                motor = 1000 + round(1000.0 * surfaces.throttle)
        unused = (self.servo_unused_us,) * 12
        return (self.view.time_us & 0xFFFFFFFF, 0, aileron, elevator, rudder, motor, *unused)

    @streams(_M.MAVLink_nav_controller_output_message)
    def nav_controller_output(self) -> Values | None:
        """NAV_CONTROLLER_OUTPUT (62): nav_roll and nav_pitch stay 0, bearings are signed, as in PX4.

        In a circle the target bearing is the direction of the path. The height error is the wanted minus the
        actual height, the airspeed error the actual minus the wanted airspeed.
        """
        v = self.view.refreshed()
        if not v.has_global:
            return None
        path, controller = self._aircraft.path, self._aircraft.controller
        if path is None:
            flown = self._aircraft.powered
            down_m = controller.down_reference_m if flown else math.nan
            error_m = v.pos[2] - down_m if math.isfinite(down_m) else 0.0
            return _NAV_CONTROLLER_OUTPUT(
                alt_error=error_m if flown else -v.alt_amsl_m, aspd_error=self._airspeed_error()
            )
        north_m, east_m, down_m = v.pos
        course_rad = controller.course_setpoint_rad
        bearing_rad = path.direction_rad(north_m, east_m)
        return _NAV_CONTROLLER_OUTPUT(
            nav_bearing=round(math.degrees(course_rad if math.isfinite(course_rad) else bearing_rad)),
            target_bearing=round(math.degrees(bearing_rad)),
            wp_dist=round(path.distance_m(north_m, east_m)),
            alt_error=down_m - path.down_m,
            aspd_error=self._airspeed_error(),
            xtrack_error=path.track_error_m(north_m, east_m),
        )

    def _airspeed_error(self) -> float:
        error_m_s = self._aircraft.controller.airspeed_error_m_s if self._aircraft.powered else 0.0
        return -error_m_s if math.isfinite(error_m_s) else 0.0

    @streams(_M.MAVLink_wind_cov_message)
    def wind_cov(self) -> Values | None:
        """WIND_COV (231), from the first flight on; horizontal."""
        if self.context.landed_state is LandedState.IN_AIR:
            self._has_flown = True
        wind = self._aircraft.wind_ned_m_s
        v = self.view.refreshed()
        if wind is None or not self._has_flown or not v.has_global:
            return None
        north, east = self.parts.navigation.health.wind_variance_m2_s2
        return _WIND_COV(
            time_usec=v.time_us, wind_x=wind[0], wind_y=wind[1], var_horiz=north + east, wind_alt=v.alt_amsl_m
        )

    def position_target_global_int(self) -> FieldValues | None:
        """POSITION_TARGET_GLOBAL_INT (87): the target position, or the centre of the circle."""
        path, frame = self._aircraft.path, self.context.frame
        if path is None or frame is None:
            return None
        lat_deg, lon_deg, alt_m = frame.geodetic_from_ned(path.north_m, path.east_m, path.down_m)
        return POSITION_TARGET_GLOBAL_INT(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_GLOBAL_INT,
            lat_int=e7(lat_deg),
            lon_int=e7(lon_deg),
            alt=alt_m,
            **_NOTHING,
        )

    def position_target_local_ned(self) -> Values | None:
        """POSITION_TARGET_LOCAL_NED (85): the nearest point of the path; at rest the own position, at sea
        level.
        """
        v = self.view.refreshed()
        frame, path = self.context.frame, self._aircraft.path
        if frame is None:
            return None
        north_m, east_m, _ = v.pos
        if path is not None:
            place = (*path.nearest_point(north_m, east_m), path.down_m)
        elif self.context.armed:
            return None
        else:
            place = (north_m, east_m, frame.origin.alt_m)
        x, y, z = place
        return POSITION_TARGET_LOCAL_NED(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
            type_mask=_PLACE_MASK,
            x=x,
            y=y,
            z=z,
            **_NOTHING,
        )

    def estimator_status(self) -> FieldValues:
        """ESTIMATOR_STATUS (230): with the airspeed's ratio while it is fused."""
        values = super().estimator_status()
        health = self.parts.navigation.health
        if not health.airspeed_in_use:
            return values
        return values._replace(tas_ratio=health.airspeed_test_ratio**2)

    def orbit_execution_status(self) -> FieldValues | None:
        """ORBIT_EXECUTION_STATUS (360) in frame 0, as recorded."""
        values = super().orbit_execution_status()
        return None if values is None else values._replace(frame=dialect.MAV_FRAME_GLOBAL)
