"""Messages of ArduPlane 4.6, as recorded from its SITL in flight."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.dispatch import streams
from autopilot_bridge.firmware.ardupilot import messages as ardupilot
from autopilot_bridge.firmware.ardupilot.messages import ArdupilotMessages, ekf_flags
from autopilot_bridge.firmware.ardupilot.plane.modes import CUSTOM_MODES, NAVIGATING_MODES
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import e7
from autopilot_bridge.services.messages.aircraft import AircraftAir, AircraftState
from autopilot_bridge.services.messages.common import POSITION_TARGET_GLOBAL_INT, POSITION_TARGET_LOCAL_NED
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.telemetry.fields import FieldValues
from autopilot_bridge.telemetry.streams import Values
from flightsim import interface

_M = dialect

STREAM_GROUPS: Final[Mapping[int, tuple[int, ...]]] = MappingProxyType(
    {
        **ardupilot.STREAM_GROUPS,
        _M.MAV_DATA_STREAM_RAW_SENSORS: (
            *ardupilot.STREAM_GROUPS[_M.MAV_DATA_STREAM_RAW_SENSORS],
            _M.MAVLINK_MSG_ID_AIRSPEED,
        ),
        _M.MAV_DATA_STREAM_EXTRA1: (
            *ardupilot.STREAM_GROUPS[_M.MAV_DATA_STREAM_EXTRA1],
            _M.MAVLINK_MSG_ID_AOA_SSA,
        ),
    }
)
"""REQUEST_DATA_STREAM groups (docs/firmware/ardupilot.md, section 2)."""

_NEUTRAL_US: Final = 1500
_TRAVEL_US: Final = 400.0  # SERVOn_MIN 1100 to SERVOn_MAX 1900
_THROTTLE_OFF_US: Final = 1000
_SENSOR_UNHEALTHY: Final = 1  # AIRSPEED_SENSOR_FLAGS
_SENSOR_USED: Final = 2
_CUSTOM_MODE_FIELD: Final = 3  # of HEARTBEAT's values
_NAVIGATING: Final = frozenset(CUSTOM_MODES[mode] for mode in NAVIGATING_MODES)
_TARGET_MASK: Final = 0xFDF8
_ABSOLUTE: Final = dialect.EKF_POS_HORIZ_ABS | dialect.EKF_PRED_POS_HORIZ_ABS


class ArduPlaneMessages(AircraftAir, ArdupilotMessages):
    """Builders of what ArduPlane sends."""

    def __init__(self, parts: AutopilotParts) -> None:
        super().__init__(parts)
        self._aircraft = AircraftState(parts)

    def servo_output_raw(self) -> Values:
        """SERVO_OUTPUT_RAW (36): aileron, elevator, throttle, rudder; disarmed neutral and throttle off."""
        pulses = [_NEUTRAL_US, _NEUTRAL_US, _THROTTLE_OFF_US, _NEUTRAL_US]
        if self.context.armed:
            surfaces = self._aircraft.surfaces
            pulses = [
                _NEUTRAL_US + round(_TRAVEL_US * surfaces.aileron),
                _NEUTRAL_US + round(_TRAVEL_US * surfaces.elevator),
                _THROTTLE_OFF_US + round(1000.0 * surfaces.throttle),
                _NEUTRAL_US + round(_TRAVEL_US * surfaces.rudder),
            ]
        return (self.view.time_us & 0xFFFFFFFF, 0, *pulses, *(self.servo_unused_us,) * 12)

    @streams(_M.MAVLink_airspeed_message)
    def airspeed(self) -> Values | None:
        """AIRSPEED (295); the raw pressure is in Pa, as the firmware sends it."""
        pressure_pa = self._aircraft.pitot_pressure_pa
        if pressure_pa is None:
            return None
        temperature_c = float(self.parts.readings.airspeed.values[interface.AIRSPEED_TEMPERATURE_C])
        health = self.parts.navigation.health
        rejected = self.context.armed and not health.airspeed_valid
        return (
            0,
            self._aircraft.airspeed_m_s,
            round(temperature_c * 100.0) if math.isfinite(temperature_c) else 32767,
            pressure_pa,
            _SENSOR_UNHEALTHY if rejected else _SENSOR_USED,
        )

    @streams(_M.MAVLink_aoa_ssa_message)
    def flow_angles(self) -> Values:
        """AOA_SSA (11020): angle of attack and sideslip by velocity and wind, degrees; 0 on the ground."""
        forward, right, down = self._aircraft.air_velocity_frd_m_s
        if self.context.on_ground or forward <= 0.0:
            return (self.view.time_us, 0.0, 0.0)
        return (
            self.view.time_us,
            math.degrees(math.atan2(down, forward)),
            math.degrees(math.atan2(right, math.hypot(forward, down))),
        )

    def wind(self) -> Values:
        """WIND (168): direction the wind comes from, -180..180 deg."""
        wind = self._aircraft.wind_ned_m_s
        if wind is None:
            return (-180.0, 0.0, 0.0)
        north, east, down = wind
        return (math.degrees(math.atan2(-east, -north)), math.hypot(north, east, down), down)

    def nav_controller_output(self) -> Values | None:
        """NAV_CONTROLLER_OUTPUT (62), in modes with navigation by the autopilot; airspeed error in cm/s."""
        if self.parts.status.heartbeat()[_CUSTOM_MODE_FIELD] not in _NAVIGATING:
            return None
        controller, v = self._aircraft.controller, self.view.refreshed()
        north_m, east_m, down_m = v.pos
        path = self._aircraft.path
        bearing, distance_m, height_error_m, track_error_m = 0, 0.0, 0.0, 0.0
        if path is not None:
            bearing = round(math.degrees(path.bearing_rad(north_m, east_m)))
            distance_m = path.distance_m(north_m, east_m)
            height_error_m = down_m - path.down_m
            track_error_m = path.track_error_m(north_m, east_m)
        return ardupilot.NAV_CONTROLLER_OUTPUT(
            nav_roll=math.degrees(ardupilot.finite(controller.roll_setpoint_rad)),
            nav_pitch=math.degrees(ardupilot.finite(controller.pitch_setpoint_rad)),
            nav_bearing=bearing,
            target_bearing=bearing,
            wp_dist=round(distance_m),
            alt_error=height_error_m,
            aspd_error=100.0 * ardupilot.finite(controller.airspeed_error_m_s),
            xtrack_error=track_error_m,
        )

    def ekf_status_flags(self) -> int:
        """EKF_STATUS_FLAGS: dead reckoning by wind and airspeed is a relative position, not an absolute."""
        health = self.parts.navigation.health
        if not health.wind_dead_reckoning:
            return super().ekf_status_flags()
        flags = ekf_flags(health, position_ready=True)
        return (flags | int(dialect.EKF_POS_HORIZ_REL)) & ~int(_ABSOLUTE)

    def position_target_local_ned(self) -> Values | None:
        """POSITION_TARGET_LOCAL_NED (85): the place flown to."""
        path = self._aircraft.path
        if path is None:
            return None
        return POSITION_TARGET_LOCAL_NED(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
            type_mask=_TARGET_MASK & 0xDFF,
            x=path.north_m,
            y=path.east_m,
            z=path.down_m,
        )

    def position_target_global_int(self) -> FieldValues | None:
        """POSITION_TARGET_GLOBAL_INT (87): frame 0, altitude above mean sea level."""
        path, frame = self._aircraft.path, self.context.frame
        if path is None or frame is None:
            return None
        lat_deg, lon_deg, alt_m = frame.geodetic_from_ned(path.north_m, path.east_m, path.down_m)
        return POSITION_TARGET_GLOBAL_INT(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_GLOBAL,
            type_mask=_TARGET_MASK,
            lat_int=e7(lat_deg),
            lon_int=e7(lon_deg),
            alt=alt_m,
        )

    def extended_sys_state(self) -> Values:
        """EXTENDED_SYS_STATE (245): no VTOL; a take-off is reported as flight."""
        landed = int(self.context.landed_state)
        if landed == dialect.MAV_LANDED_STATE_TAKEOFF:
            landed = int(dialect.MAV_LANDED_STATE_IN_AIR)
        return (dialect.MAV_VTOL_STATE_UNDEFINED, landed)

    def esc_telemetry(self) -> Values | None:
        """ESC_TELEMETRY_1_TO_4 (11030): the one ESC is on the throttle's channel, the third."""
        battery = self.view.battery
        if battery is None:
            return None
        third = [0.0, 0.0, 1.0, 0.0]
        values = (
            32.0,
            battery[0] * 100.0,
            max(0.0, battery[1] * 100.0),
            battery[2] * 1000.0,
            0.0,
            float((self.view.time_ms // 10) & 0xFFFF),
        )
        return tuple(tuple(round(value * on) for on in third) for value in values)
