"""The gimbal as a MAVLink component: device and manager of gimbal protocol v2 in one.

Source: MAVLink gimbal protocol v2 (mavlink.io/en/services/gimbal_v2.html). Whoever has control may point it;
while nobody has, anybody may.
"""

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from autopilot_bridge.geodesy import GeodeticPosition, LocalFrame
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.payload.component import Component, fixed_text, whole
from flightsim.payload import Gimbal, GimbalFlags
from flightsim.rotations import euler_from_quaternion

GIMBAL_COMPONENT: Final = int(mavlink.MAV_COMP_ID_GIMBAL)

_ACCEPTED: Final = int(mavlink.MAV_RESULT_ACCEPTED)
_DENIED: Final = int(mavlink.MAV_RESULT_DENIED)
_TEMPORARILY_REJECTED: Final = int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
_UNSUPPORTED: Final = int(mavlink.MAV_RESULT_UNSUPPORTED)
_DEG: Final = math.radians(1.0)
_NOBODY: Final = (0, 0)
_ROI_INTERVAL_US: Final = 50_000
_AUTOPILOT: Final = 1
_RELATIVE_FRAMES: Final = frozenset(
    (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
)
_ROI_FLAGS: Final = (
    GimbalFlags.ROLL_LOCK | GimbalFlags.PITCH_LOCK | GimbalFlags.YAW_LOCK | GimbalFlags.YAW_IN_EARTH_FRAME
)
# Manager and device flags have the same numbers for what both know.
_KNOWN_FLAGS: Final = int(sum(GimbalFlags))
_MANUAL_RATE_RAD_S: Final = 60.0 * _DEG
_CAPABILITIES: Final = int(
    mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_RETRACT
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_NEUTRAL
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_FOLLOW
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_FOLLOW
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
)
_ROLL_CAPABILITIES: Final = int(
    mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_FOLLOW
)
_ENDLESS: Final = int(mavlink.GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_INFINITE_YAW)
_POINTS_AT_PLACE: Final = int(mavlink.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL)

Sender = tuple[int, int]


class GimbalComponent(Component):
    """Points a gimbal as it is told, and tells where it looks.

    Attributes:
        primary, secondary: (system, component) in control; (0, 0): nobody.
    """

    def __init__(self, gimbal: Gimbal, *, system_id: int, send: Callable[[bytes], None]) -> None:
        super().__init__(
            system_id=system_id,
            component_id=GIMBAL_COMPONENT,
            mav_type=mavlink.MAV_TYPE_GIMBAL,
            send=send,
            rates_hz={
                mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: 10.0,
                mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: 1.0,
            },
        )
        self.primary: Sender = _NOBODY
        self.secondary: Sender = _NOBODY
        self._gimbal = gimbal
        self._place: GeodeticPosition | None = None
        self._home_alt_m = math.nan
        self._vehicle: GeodeticPosition | None = None
        self._next_roi_us = 0
        self._builders.update(
            {
                mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: self._attitude_status,
                mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: self._manager_status,
                mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION: self._manager_information,
                mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION: self._device_information,
            }
        )
        self._handlers.update(
            {
                mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: self._on_pitchyaw,
                mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: self._on_configure,
                mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._on_roi_location,
                mavlink.MAV_CMD_DO_SET_ROI_NONE: self._on_roi_none,
            }
        )

    def step(self, time_us: int) -> None:
        """Follow a region of interest, and send what is due."""
        if self._place is not None and time_us >= self._next_roi_us:
            self._next_roi_us = time_us + _ROI_INTERVAL_US
            self._look_at_place(self._place)
        super().step(time_us)

    # pointing

    def _on_message(self, message: Any, sender: Sender) -> None:
        match message.get_msgId():
            case mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
                if sender == (self.system_id, _AUTOPILOT):
                    self._note_vehicle(message)
            case mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_PITCHYAW:
                if self._for_this_device(message) and self._may_point(sender):
                    self._point(
                        message.flags, message.pitch, message.yaw, message.pitch_rate, message.yaw_rate
                    )
            case mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_MANUAL_CONTROL:
                if self._for_this_device(message) and self._may_point(sender):
                    self._steer(message)
            case mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_ATTITUDE:
                if self._for_this_device(message) and self._may_point(sender):
                    self._set_attitude(message)
            case mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_SET_ATTITUDE:
                if self._may_point(sender):
                    self._set_attitude(message)

    def _for_this_device(self, message: Any) -> bool:
        return message.gimbal_device_id in (0, 1, GIMBAL_COMPONENT)

    def _may_point(self, sender: Sender) -> bool:
        return self.primary == _NOBODY or sender in (self.primary, self.secondary)

    def _point(self, flags: int, pitch: float, yaw: float, pitch_rate: float, yaw_rate: float) -> bool:
        """Angles in rad, NaN: not given. False for numbers or flags that make no sense."""
        if any(math.isinf(value) or abs(value) > 1e4 for value in (pitch, yaw, pitch_rate, yaw_rate)):
            return False
        try:
            self._gimbal.command(
                flags & _KNOWN_FLAGS,
                pitch_rad=pitch,
                yaw_rad=yaw,
                pitch_rate_rad_s=pitch_rate,
                yaw_rate_rad_s=yaw_rate,
            )
        except ValueError:  # contradictory flags
            return False
        self._place = None
        return True

    def _steer(self, message: Any) -> None:
        """GIMBAL_MANAGER_SET_MANUAL_CONTROL: -1..1 of a full angle or turn rate; NaN: not given."""
        rates = [_share(value) * _MANUAL_RATE_RAD_S for value in (message.pitch_rate, message.yaw_rate)]
        angles = [
            _share(value) * limit for value, limit in ((message.pitch, 0.5 * math.pi), (message.yaw, math.pi))
        ]
        self._point(message.flags, angles[0], angles[1], rates[0], rates[1])

    def _set_attitude(self, message: Any) -> None:
        q = [float(value) for value in message.q]
        rates = (float(message.angular_velocity_y), float(message.angular_velocity_z))
        if any(math.isnan(value) for value in q):
            self._point(message.flags, math.nan, math.nan, *rates)
            return
        norm = math.sqrt(sum(value * value for value in q))
        if not 0.5 < norm < 2.0:
            return
        euler = np.empty(3)
        euler_from_quaternion(np.array(q) / norm, euler)
        _, pitch, yaw = euler.tolist()
        self._point(message.flags, pitch, yaw, *rates)

    def _on_pitchyaw(self, message: Any, sender: Sender) -> int | None:
        """DO_GIMBAL_MANAGER_PITCHYAW: p1..p4 in degrees and deg/s, p5 flags, p7 device."""
        flags_value = message.param5 if hasattr(message, "param5") else float(message.x)
        device_value = message.param7 if hasattr(message, "param7") else message.z
        if whole(device_value, -1) not in (0, 1, GIMBAL_COMPONENT):
            return _UNSUPPORTED
        if not self._may_point(sender):
            return _DENIED
        pointed = self._point(
            max(0, whole(flags_value, 0)),
            message.param1 * _DEG,
            message.param2 * _DEG,
            message.param3 * _DEG,
            message.param4 * _DEG,
        )
        return _ACCEPTED if pointed else _DENIED

    # control

    def _on_configure(self, message: Any, sender: Sender) -> int | None:
        """DO_GIMBAL_MANAGER_CONFIGURE: who is in control. -1 leaves it, -2 takes it, -3
        gives it up.
        """
        primary = self._wanted(message.param1, message.param2, self.primary, sender)
        secondary = self._wanted(message.param3, message.param4, self.secondary, sender)
        if primary is None or secondary is None:
            return _DENIED
        self.primary, self.secondary = primary, secondary
        return _ACCEPTED

    @staticmethod
    def _wanted(system: float, component: float, now: Sender, sender: Sender) -> Sender | None:
        ids = (whole(system, -99), whole(component, -99))
        if -1 in ids:
            return now
        if -2 in ids:
            return sender
        if -3 in ids:
            return _NOBODY if now == sender else now
        return ids if all(0 <= value <= 255 for value in ids) else None

    # region of interest

    def _note_vehicle(self, message: Any) -> None:
        alt_m = 1e-3 * message.alt
        if abs(message.lat) <= 900_000_000 and abs(message.lon) <= 1_800_000_000:
            self._vehicle = GeodeticPosition(
                lat_deg=1e-7 * message.lat, lon_deg=1e-7 * message.lon, alt_m=alt_m
            )
            self._home_alt_m = alt_m - 1e-3 * message.relative_alt

    def _on_roi_location(self, message: Any, sender: Sender) -> int | None:
        """DO_SET_ROI_LOCATION: latitude, longitude, altitude."""
        if not self._may_point(sender):
            return _DENIED
        if hasattr(message, "x"):
            lat_deg, lon_deg, alt_m, frame = 1e-7 * message.x, 1e-7 * message.y, message.z, message.frame
        else:
            lat_deg, lon_deg, alt_m, frame = message.param5, message.param6, message.param7, 0
        if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0 and abs(alt_m) < 1e5):
            return _DENIED
        if frame in _RELATIVE_FRAMES:
            alt_m += self._home_alt_m
        if self._vehicle is None or math.isnan(alt_m):
            return _TEMPORARILY_REJECTED  # it doesn't know where it is itself
        self._place = GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
        self._next_roi_us = self._time_us
        return _ACCEPTED

    def _on_roi_none(self, message: Any, sender: Sender) -> int | None:
        if not self._may_point(sender):
            return _DENIED
        self._place = None
        self._gimbal.command()
        return _ACCEPTED

    def _look_at_place(self, place: GeodeticPosition) -> None:
        if self._vehicle is None:
            return
        north, east, down = LocalFrame(self._vehicle).ned_from_geodetic(
            place.lat_deg, place.lon_deg, place.alt_m
        )
        self._gimbal.command(
            _ROI_FLAGS,
            pitch_rad=-math.atan2(down, math.hypot(north, east)),
            yaw_rad=math.atan2(east, north),
        )

    # what it tells

    def _status_flags(self) -> int:
        flags = int(self._gimbal.flags) & ~int(
            GimbalFlags.YAW_IN_VEHICLE_FRAME | GimbalFlags.YAW_IN_EARTH_FRAME
        )
        frame = (
            GimbalFlags.YAW_IN_EARTH_FRAME
            if flags & GimbalFlags.YAW_LOCK
            else GimbalFlags.YAW_IN_VEHICLE_FRAME
        )
        return flags | int(frame)

    def _attitude_status(self, time_us: int) -> Any:
        gimbal = self._gimbal
        flags = self._status_flags()
        in_earth = bool(flags & GimbalFlags.YAW_IN_EARTH_FRAME)
        earth, vehicle = gimbal.measured_q_ned_from_gimbal, gimbal.measured_q_heading_from_gimbal
        delta_yaw = math.remainder(_yaw(earth.tolist()) - _yaw(vehicle.tolist()), math.tau)
        rates = gimbal.measured_rates_rad_s.tolist()
        failure = mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT if gimbal.limits_reached[1] else 0
        failure |= mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_YAW_LIMIT if gimbal.limits_reached[2] else 0
        failure |= mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_ROLL_LIMIT if gimbal.limits_reached[0] else 0
        return mavlink.MAVLink_gimbal_device_attitude_status_message(
            0,
            0,
            (max(0, gimbal.time_us) // 1000) & 0xFFFFFFFF,
            flags,
            (earth if in_earth else vehicle).tolist(),
            rates[0],
            rates[1],
            rates[2],
            failure,
            delta_yaw=delta_yaw,
            delta_yaw_velocity=math.nan,
            gimbal_device_id=0,
        )

    def _manager_status(self, time_us: int) -> Any:
        return mavlink.MAVLink_gimbal_manager_status_message(
            self.time_ms, self._status_flags(), GIMBAL_COMPONENT, *self.primary, *self.secondary
        )

    def _limits(self) -> tuple[float, float, float, float, float, float]:
        p = self._gimbal.parameters
        roll = p.roll_limit_rad if p.axes == 3 else 0.0
        return -roll, roll, p.pitch_min_rad, p.pitch_max_rad, -p.yaw_limit_rad, p.yaw_limit_rad

    def _device_capabilities(self) -> int:
        p = self._gimbal.parameters
        capabilities = _CAPABILITIES | (_ROLL_CAPABILITIES if p.axes == 3 else 0)
        return capabilities | (_ENDLESS if p.yaw_limit_rad >= math.pi else 0)

    def _manager_information(self, time_us: int) -> Any:
        return mavlink.MAVLink_gimbal_manager_information_message(
            self.time_ms, self._device_capabilities() | _POINTS_AT_PLACE, GIMBAL_COMPONENT, *self._limits()
        )

    def _device_information(self, time_us: int) -> Any:
        return mavlink.MAVLink_gimbal_device_information_message(
            self.time_ms,
            fixed_text("flightstack", 32),
            fixed_text("simulated gimbal", 32),
            fixed_text("", 32),
            0x01000000,
            0x01000000,
            0,
            self._device_capabilities() & 0xFFFF,
            0,
            *self._limits(),
        )


def _share(value: float) -> float:
    """Within -1..1; NaN stays."""
    return value if math.isnan(value) else max(-1.0, min(1.0, value))


def _yaw(q: list[float]) -> float:
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
