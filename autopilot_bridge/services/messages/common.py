"""Messages that are the same in both firmwares (MAVLink common message set)."""

import math
from typing import Final

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.dispatch import streams
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import UNKNOWN_UINT16, e7, mm, place_e7
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.telemetry.fields import FieldValues, fields
from autopilot_bridge.telemetry.streams import Values
from flightsim import interface
from flightsim.foundation.atmosphere import GRAVITY_M_S2

NAN: Final = math.nan
_NO_GPS: Final = 0  # GPS_FIX_TYPE
_NO_TEMPERATURE: Final = 32767
_SYS_STATUS: Final = fields("SYS_STATUS")
_GPS_RAW_INT: Final = fields("GPS_RAW_INT")
_BATTERY_STATUS: Final = fields("BATTERY_STATUS")
_DISTANCE_SENSOR: Final = fields("DISTANCE_SENSOR")
_HOME_POSITION: Final = fields("HOME_POSITION")
ATTITUDE_TARGET: Final = fields("ATTITUDE_TARGET")
POSITION_TARGET_LOCAL_NED: Final = fields("POSITION_TARGET_LOCAL_NED")
POSITION_TARGET_GLOBAL_INT: Final = fields("POSITION_TARGET_GLOBAL_INT")
TARGET_FIELDS: Final = ("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
"""The fields of POSITION_TARGET_LOCAL_NED that a trajectory setpoint has."""


class CommonMessages(Microservice):
    """Builders of the messages that are the same for both flavours; flavours extend and override them."""

    servo_unused_us = 0
    servo_disarmed_us = 1000
    gps_timeout_us = 4_000_000  # ArduPilot's GPS_TIMEOUT_MS
    gps_sent_before_first = True

    def __init__(self, parts: AutopilotParts) -> None:
        self.parts = parts
        self.view = parts.view
        self.context = parts.commander.context

    @streams(dialect.MAVLink_heartbeat_message)
    def heartbeat(self) -> Values:
        """HEARTBEAT (0)."""
        return self.parts.status.heartbeat()

    @streams(dialect.MAVLink_autopilot_version_message)
    def autopilot_version(self) -> Values:
        """AUTOPILOT_VERSION (148)."""
        return self.parts.status.autopilot_version()

    @streams(dialect.MAVLink_sys_status_message)
    def sys_status(self) -> Values:
        """SYS_STATUS (1)."""
        present, enabled, health = self.parts.status.sys_status()
        voltage_mv, current_ca, remaining = UNKNOWN_UINT16, -1, -1
        battery = self.view.battery
        if battery is not None:
            voltage_mv = round(battery[0] * 1000.0)
            current_ca = round(battery[1] * 100.0)
            remaining = round(battery[3] * 100.0)
        return _SYS_STATUS(
            onboard_control_sensors_present=present,
            onboard_control_sensors_enabled=enabled,
            onboard_control_sensors_health=health,
            voltage_battery=voltage_mv,
            current_battery=current_ca,
            battery_remaining=remaining,
        )

    @streams(dialect.MAVLink_system_time_message)
    def system_time(self) -> Values:
        """SYSTEM_TIME (2)."""
        return (self.parts.memory.unix_epoch_us + self.view.time_us, self.view.time_ms)

    @streams(dialect.MAVLink_gps_raw_int_message)
    def gps_raw_int(self) -> Values | None:
        """GPS_RAW_INT (24); eph and epv are the dilutions of precision x 100, as both firmwares send.

        A receiver that has stopped sending is shown as not present.
        """
        gps = self.parts.readings.gps
        if gps.time_us < 0:
            if not self.gps_sent_before_first:
                return None
            return _GPS_RAW_INT(
                time_usec=self.view.time_us, fix_type=_NO_GPS, eph=UNKNOWN_UINT16, epv=UNKNOWN_UINT16
            )
        v = gps.values.tolist()
        silent = self.view.time_us - gps.time_us > self.gps_timeout_us
        fix_type = _NO_GPS if silent else int(v[interface.GPS_FIX_TYPE])
        vn, ve, _ = v[interface.GPS_VEL_NED_M_S]
        speed_cm_s = course_cdeg = UNKNOWN_UINT16
        if vn == vn:  # else it was not sent
            speed_cm_s = round(math.hypot(vn, ve) * 100.0)
            course_cdeg = round(math.degrees(math.atan2(ve, vn)) % 360.0 * 100.0) % 36000
        if fix_type < 2 or not math.isfinite(v[interface.GPS_LAT_DEG]):
            counted = not silent and math.isfinite(v[interface.GPS_SATELLITES])
            satellites = int(v[interface.GPS_SATELLITES]) if counted else 0
            return _GPS_RAW_INT(
                time_usec=gps.time_us,
                fix_type=fix_type,
                eph=UNKNOWN_UINT16,
                epv=UNKNOWN_UINT16,
                satellites_visible=satellites,
            )
        alt_mm = mm(v[interface.GPS_ALT_M])
        return _GPS_RAW_INT(
            time_usec=gps.time_us,
            fix_type=fix_type,
            lat=e7(v[interface.GPS_LAT_DEG]),
            lon=e7(v[interface.GPS_LON_DEG]),
            alt=alt_mm,
            eph=round(v[interface.GPS_HDOP] * 100.0),
            epv=round(v[interface.GPS_VDOP] * 100.0),
            vel=speed_cm_s,
            cog=course_cdeg,
            satellites_visible=int(v[interface.GPS_SATELLITES]),
            alt_ellipsoid=alt_mm,
            h_acc=round(v[interface.GPS_EPH_M] * 1000.0),
            v_acc=round(v[interface.GPS_EPV_M] * 1000.0),
            vel_acc=round(v[interface.GPS_SPEED_ACCURACY_M_S] * 1000.0),
        )

    @streams(dialect.MAVLink_scaled_pressure_message)
    def scaled_pressure(self) -> Values | None:
        """SCALED_PRESSURE (29), hPa."""
        pressure_pa, temperature_c = self.view.pressure()
        if not math.isfinite(pressure_pa):
            return None
        return (
            self.view.time_ms,
            pressure_pa * 0.01,
            self.differential_pressure_hpa(),
            round(temperature_c * 100.0),
            0,
        )

    def differential_pressure_hpa(self) -> float:
        """Pressure of the pitot tube; 0 without one."""
        return 0.0

    @streams(dialect.MAVLink_servo_output_raw_message)
    def servo_output_raw(self) -> Values:
        """SERVO_OUTPUT_RAW (36): motor outputs 1000..2000 us."""
        motors = self.parts.controller.actuators.tolist()[:4]
        if self.context.armed:
            pulses = [1000 + round(1000.0 * motor) for motor in motors]
        else:
            pulses = [self.servo_disarmed_us] * 4
        return (self.view.time_us & 0xFFFFFFFF, 0, *pulses, *(self.servo_unused_us,) * 12)

    @streams(dialect.MAVLink_gps_global_origin_message)
    def gps_global_origin(self) -> Values | None:
        """GPS_GLOBAL_ORIGIN (49): the filter's local origin."""
        frame = self.context.frame
        if frame is None:
            return None
        return (*place_e7(frame.origin), self.view.time_us)

    @streams(dialect.MAVLink_vfr_hud_message)
    def vfr_hud(self) -> Values:
        """VFR_HUD (74)."""
        v = self.view.refreshed()
        return (
            self.airspeed_m_s(),
            v.ground_speed_m_s,
            int(v.heading_deg),
            round(self.throttle() * 100.0),
            v.alt_amsl_m if v.has_global else 0.0,
            -v.vel[2],
        )

    def airspeed_m_s(self) -> float:
        """The value for VFR_HUD's airspeed without an airspeed sensor."""
        return 0.0

    def throttle(self) -> float:
        """Collective being commanded, 0..1."""
        return self.parts.controller.thrust if self.context.armed else 0.0

    @streams(dialect.MAVLink_attitude_target_message)
    def attitude_target(self) -> Values | None:
        """ATTITUDE_TARGET (83): the setpoint of the attitude loop."""
        context = self.context
        if not context.armed or context.setpoint[sp.LEVEL] < sp.RATES:
            return None
        controller = self.parts.controller
        roll_rate, pitch_rate, yaw_rate = controller.rate_setpoint_frd_rad_s.tolist()
        return ATTITUDE_TARGET(
            time_boot_ms=self.view.time_ms,
            q=controller.attitude_setpoint.tolist(),
            body_roll_rate=roll_rate,
            body_pitch_rate=pitch_rate,
            body_yaw_rate=yaw_rate,
            thrust=controller.thrust,
        )

    def trajectory_setpoint(self) -> list[float] | None:
        """Values of `TARGET_FIELDS` as commanded; None in other kinds of flight."""
        context = self.context
        if not context.armed or context.setpoint[sp.LEVEL] != sp.TRAJECTORY:
            return None
        values = context.setpoint.tolist()
        return [*values[sp.MOTION], values[sp.YAW_RAD], values[sp.YAW_RATE_RAD_S]]

    @streams(dialect.MAVLink_position_target_local_ned_message)
    def position_target_local_ned(self) -> Values | None:
        """POSITION_TARGET_LOCAL_NED (85)."""
        target = self.trajectory_setpoint()
        if target is None:
            return None
        return POSITION_TARGET_LOCAL_NED(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
            **dict(zip(TARGET_FIELDS, target, strict=True)),
        )

    @streams(dialect.MAVLink_position_target_global_int_message)
    def position_target_global_int(self) -> FieldValues | None:
        """POSITION_TARGET_GLOBAL_INT (87)."""
        target = self.trajectory_setpoint()
        frame = self.context.frame
        if target is None or frame is None or not all(map(math.isfinite, target[:3])):
            return None
        lat_deg, lon_deg, alt_m = frame.geodetic_from_ned(*target[:3])
        return POSITION_TARGET_GLOBAL_INT(
            time_boot_ms=self.view.time_ms,
            coordinate_frame=dialect.MAV_FRAME_GLOBAL_INT,
            lat_int=e7(lat_deg),
            lon_int=e7(lon_deg),
            alt=alt_m,
            **dict(zip(TARGET_FIELDS[3:], target[3:], strict=True)),
        )

    def raw_scaled_imu(self) -> tuple[int, ...] | None:
        """Accelerometer (milli-g), gyro (mrad/s), magnetometer (mgauss) as integers."""
        imu = self.view.imu()
        if not math.isfinite(imu[interface.IMU_GYRO_FRD_RAD_S.start]):
            return None
        milli_g = [round(value * (1000.0 / GRAVITY_M_S2)) for value in imu[interface.IMU_ACCEL_FRD_M_S2]]
        mrad = [round(value * 1000.0) for value in imu[interface.IMU_GYRO_FRD_RAD_S]]
        mgauss = [round(value * 1000.0) for value in self.view.magnetometer_gauss()]
        return (*milli_g, *mrad, *mgauss)

    def temperature_cdeg(self) -> int:
        """IMU temperature, centidegrees."""
        return round(self.view.imu()[interface.IMU_TEMPERATURE_C] * 100.0)

    @streams(dialect.MAVLink_scaled_imu_message)
    def scaled_imu(self) -> Values | None:
        """SCALED_IMU (26)."""
        values = self.raw_scaled_imu()
        return None if values is None else (self.view.time_ms, *values, self.temperature_cdeg())

    @streams(dialect.MAVLink_battery_status_message)
    def battery_status(self) -> FieldValues | None:
        """BATTERY_STATUS (147)."""
        battery = self.view.battery
        if battery is None:
            return None
        voltage_v, current_a, used_ah, remaining = battery
        return _BATTERY_STATUS(
            battery_function=dialect.MAV_BATTERY_FUNCTION_ALL,
            type=dialect.MAV_BATTERY_TYPE_LIPO,
            temperature=_NO_TEMPERATURE,
            voltages=(round(voltage_v * 1000.0), *(UNKNOWN_UINT16,) * 9),
            current_battery=round(current_a * 100.0),
            current_consumed=round(used_ah * 1000.0),
            energy_consumed=-1,
            battery_remaining=round(remaining * 100.0),
            charge_state=int(self.parts.commander.battery_level),
        )

    @streams(dialect.MAVLink_vibration_message)
    def vibration(self) -> Values:
        """VIBRATION (241)."""
        return (self.view.time_us, *self.view.vibration.rms_m_s2, 0, 0, 0)

    @streams(dialect.MAVLink_home_position_message)
    def home_position(self) -> Values | None:
        """HOME_POSITION (242)."""
        place = self.home_place()
        if place is None:
            return None
        lat, lon, alt = place
        north_m, east_m, down_m = self.context.home_ned_m.tolist()
        return _HOME_POSITION(
            latitude=lat,
            longitude=lon,
            altitude=alt,
            x=north_m,
            y=east_m,
            z=down_m,
            q=self.home_quaternion(),
            time_usec=self.view.time_us,
        )

    def home_place(self) -> tuple[int, int, int] | None:
        """Latitude and longitude (degE7) and altitude (mm) of home; None before there is one."""
        context = self.context
        north, east, down = context.home_ned_m.tolist()
        if context.frame is None or not math.isfinite(north):
            return None
        lat_deg, lon_deg, alt_m = context.frame.geodetic_from_ned(north, east, down)
        return e7(lat_deg), e7(lon_deg), mm(alt_m)

    def home_quaternion(self) -> tuple[float, float, float, float]:
        """Heading at home as HOME_POSITION carries it."""
        half_yaw = 0.5 * self.context.home_yaw_rad
        return (math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw))

    @streams(dialect.MAVLink_extended_sys_state_message)
    def extended_sys_state(self) -> Values:
        """EXTENDED_SYS_STATE (245)."""
        return (dialect.MAV_VTOL_STATE_UNDEFINED, int(self.context.landed_state))

    @streams(dialect.MAVLink_distance_sensor_message)
    def distance_sensor(self) -> Values | None:
        """DISTANCE_SENSOR (132), facing down."""
        reading = self.parts.readings.rangefinder
        if reading.time_us < 0:
            return None
        values = reading.values.tolist()
        distance_m = values[interface.RANGE_DISTANCE_M]
        min_m, max_m = values[interface.RANGE_MIN_M], values[interface.RANGE_MAX_M]
        in_range = math.isfinite(distance_m)
        beyond_cm = 0 if self.context.on_ground else round(max_m * 100.0) + 1  # too near, or too far
        return _DISTANCE_SENSOR(
            time_boot_ms=reading.time_us // 1000,
            min_distance=round(min_m * 100.0),
            max_distance=round(max_m * 100.0),
            current_distance=round(distance_m * 100.0) if in_range else beyond_cm,
            type=dialect.MAV_DISTANCE_SENSOR_LASER,
            orientation=dialect.MAV_SENSOR_ROTATION_PITCH_270,
            signal_quality=100 if in_range else 1,
        )
