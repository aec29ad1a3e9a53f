"""The gimbal as a MAVLink component: device and manager of gimbal protocol v2, and the mount of version 1.

Source: MAVLink gimbal protocol v2 (mavlink.io/en/services/gimbal_v2.html). Only the component in control may
point it; while no component is in control, all components may.
"""

import math
from collections.abc import Callable
from types import MappingProxyType
from typing import Final

import numpy as np

from autopilot_bridge.dispatch import command, receives, streams
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import GIMBAL_COMPONENT
from autopilot_bridge.mavlink.wire_units import degrees
from autopilot_bridge.payload.component import CommandMessage, Component, Sender, parameters, whole
from autopilot_bridge.payload.gimbal_aim import GimbalAim
from autopilot_bridge.payload.gimbal_control import GimbalControl
from autopilot_bridge.payload.gimbal_messages import (
    attitude_status,
    device_information,
    manager_information,
    mount_orientation,
    status_flags,
)
from autopilot_bridge.payload.reported_vehicle import ReportedVehicle
from flightsim.foundation.rotations import euler_from_quaternion
from flightsim.payload import Gimbal, GimbalFlags

_ACCEPTED: Final = int(dialect.MAV_RESULT_ACCEPTED)
_DENIED: Final = int(dialect.MAV_RESULT_DENIED)
_TEMPORARILY_REJECTED: Final = int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
_UNSUPPORTED: Final = int(dialect.MAV_RESULT_UNSUPPORTED)
_DEG: Final = math.radians(1.0)
_ROI_INTERVAL_US: Final = 50_000
_ROI_FLAGS: Final = (
    GimbalFlags.ROLL_LOCK | GimbalFlags.PITCH_LOCK | GimbalFlags.YAW_LOCK | GimbalFlags.YAW_IN_EARTH_FRAME
)
_LEVEL: Final = int(GimbalFlags.ROLL_LOCK | GimbalFlags.PITCH_LOCK)
# Manager and device flags have the same numbers where both exist.
_KNOWN_FLAGS: Final = int(sum(GimbalFlags))
_MANUAL_RATE_RAD_S: Final = 60.0 * _DEG
_NAN: Final = math.nan


class GimbalComponent(Component[Gimbal]):
    """Points a gimbal as commanded, and reports its direction.

    Attributes:
        control: the components that may point it.
        aim: the target that it follows automatically.
    """

    component_id = GIMBAL_COMPONENT
    mav_type = dialect.MAV_TYPE_GIMBAL
    rates_hz = MappingProxyType(
        {
            dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: 10.0,
            dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: 1.0,
        }
    )

    def __init__(self, device: Gimbal, *, system_id: int, send: Callable[[bytes], None]) -> None:
        super().__init__(device, system_id=system_id, send=send)
        self.control = GimbalControl(system_id)
        self._vehicle = ReportedVehicle(system_id)
        self.aim = GimbalAim(self._vehicle)
        self._next_roi_us = 0

    def step(self, time_us: int) -> None:
        """Follow a region of interest, and send the messages that are due."""
        if self.aim.active and time_us >= self._next_roi_us:
            self._next_roi_us = time_us + _ROI_INTERVAL_US
            direction = self.aim.direction(time_us)
            if direction is not None:
                self.device.command(_ROI_FLAGS, pitch_rad=direction[0], yaw_rad=direction[1])
        super().step(time_us)

    # messages

    @streams(dialect.MAVLink_gimbal_device_attitude_status_message)
    def _attitude_status(self, time_us: int) -> MAVLinkMessage:
        return attitude_status(self.device)

    @streams(dialect.MAVLink_gimbal_manager_information_message)
    def _manager_information(self, time_us: int) -> MAVLinkMessage:
        return manager_information(self.device, self.time_ms)

    @streams(dialect.MAVLink_gimbal_device_information_message)
    def _device_information(self, time_us: int) -> MAVLinkMessage:
        return device_information(self.device, self.time_ms)

    @streams(dialect.MAVLink_mount_orientation_message)
    def _mount_orientation(self, time_us: int) -> MAVLinkMessage:
        return mount_orientation(self.device, self.time_ms)

    @streams(dialect.MAVLink_gimbal_manager_status_message)
    def _manager_status(self, time_us: int) -> MAVLinkMessage:
        control = self.control
        return dialect.MAVLink_gimbal_manager_status_message(
            time_boot_ms=self.time_ms,
            flags=status_flags(self.device),
            gimbal_device_id=GIMBAL_COMPONENT,
            primary_control_sysid=control.primary[0],
            primary_control_compid=control.primary[1],
            secondary_control_sysid=control.secondary[0],
            secondary_control_compid=control.secondary[1],
        )

    @receives(dialect.MAVLink_global_position_int_message, dialect.MAVLink_follow_target_message)
    def _follow_positions(
        self,
        message: dialect.MAVLink_global_position_int_message | dialect.MAVLink_follow_target_message,
        sender: Sender,
        time_us: int,
    ) -> None:
        self._vehicle.handle(message, sender, time_us)
        self.aim.handle(message, sender, time_us)

    @receives(dialect.MAVLink_gimbal_device_set_attitude_message)
    def _on_device_attitude(
        self, message: dialect.MAVLink_gimbal_device_set_attitude_message, sender: Sender, time_us: int
    ) -> None:
        if self.control.may_point(sender):
            self._set_attitude(message)

    @receives(dialect.MAVLink_gimbal_manager_set_attitude_message)
    def _on_manager_attitude(
        self, message: dialect.MAVLink_gimbal_manager_set_attitude_message, sender: Sender, time_us: int
    ) -> None:
        if self._may_point(message.gimbal_device_id, sender):
            self._set_attitude(message)

    @receives(dialect.MAVLink_gimbal_manager_set_pitchyaw_message)
    def _on_manager_pitchyaw(
        self, message: dialect.MAVLink_gimbal_manager_set_pitchyaw_message, sender: Sender, time_us: int
    ) -> None:
        if self._may_point(message.gimbal_device_id, sender):
            self._point(message.flags, message.pitch, message.yaw, message.pitch_rate, message.yaw_rate)

    @receives(dialect.MAVLink_gimbal_manager_set_manual_control_message)
    def _on_manual_control(
        self, message: dialect.MAVLink_gimbal_manager_set_manual_control_message, sender: Sender, time_us: int
    ) -> None:
        if self._may_point(message.gimbal_device_id, sender):
            self._steer(message)

    def _may_point(self, device_id: int, sender: Sender) -> bool:
        """Whether a message to the manager is for this gimbal, by a component that may point it."""
        return device_id in (0, 1, GIMBAL_COMPONENT) and self.control.may_point(sender)

    def _point(
        self, flags: int, pitch: float, yaw: float, pitch_rate: float, yaw_rate: float, roll: float = 0.0
    ) -> bool:
        """Angles in rad, NaN: not given. False for invalid numbers or flags."""
        if any(math.isinf(value) or abs(value) > 1e4 for value in (pitch, yaw, pitch_rate, yaw_rate)):
            return False
        try:
            self.device.command(
                flags & _KNOWN_FLAGS,
                roll_rad=roll,
                pitch_rad=pitch,
                yaw_rad=yaw,
                pitch_rate_rad_s=pitch_rate,
                yaw_rate_rad_s=yaw_rate,
            )
        except ValueError:  # contradictory flags
            return False
        self.aim.clear()
        return True

    def _steer(self, message: dialect.MAVLink_gimbal_manager_set_manual_control_message) -> None:
        """GIMBAL_MANAGER_SET_MANUAL_CONTROL: -1..1 of a full angle or turn rate; NaN: not given."""
        rates = [_share(value) * _MANUAL_RATE_RAD_S for value in (message.pitch_rate, message.yaw_rate)]
        angles = [
            _share(value) * limit for value, limit in ((message.pitch, 0.5 * math.pi), (message.yaw, math.pi))
        ]
        self._point(message.flags, angles[0], angles[1], rates[0], rates[1])

    def _set_attitude(
        self,
        message: dialect.MAVLink_gimbal_device_set_attitude_message
        | dialect.MAVLink_gimbal_manager_set_attitude_message,
    ) -> None:
        q = [float(value) for value in message.q]
        rates = (float(message.angular_velocity_y), float(message.angular_velocity_z))
        if any(math.isnan(value) for value in q):
            self._point(message.flags, _NAN, _NAN, *rates)
            return
        norm = math.sqrt(sum(value * value for value in q))
        if not 0.5 < norm < 2.0:
            return
        euler = np.empty(3)
        euler_from_quaternion(np.array(q) / norm, euler)
        roll, pitch, yaw = euler.tolist()
        self._point(message.flags, pitch, yaw, *rates, roll=roll if self.device.parameters.axes == 3 else 0.0)

    # commands

    @command(dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW)
    def _on_pitchyaw(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_GIMBAL_MANAGER_PITCHYAW: p1..p4 in degrees and deg/s, p5 flags, p7 device."""
        pitch, yaw, pitch_rate, yaw_rate, flags, _, device = parameters(message)
        if whole(device, -1) not in (0, 1, GIMBAL_COMPONENT):
            return _UNSUPPORTED
        if not self.control.may_point(sender):
            return _DENIED
        angles = (pitch * _DEG, yaw * _DEG, pitch_rate * _DEG, yaw_rate * _DEG)
        return _ACCEPTED if self._point(max(0, whole(flags, 0)), *angles) else _DENIED

    @command(dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE)
    def _on_configure(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_GIMBAL_MANAGER_CONFIGURE: the components in control, p7 device."""
        values = parameters(message)
        if whole(values[6], 0) not in (0, 1, GIMBAL_COMPONENT):
            return _UNSUPPORTED
        before = (self.control.primary, self.control.secondary)
        if not self.control.configure(values, sender):
            return _DENIED
        if before != (self.control.primary, self.control.secondary):
            self.send(self._manager_status(self._time_us))
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_ROI_LOCATION)
    def _on_roi_location(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_SET_ROI_LOCATION: latitude, longitude, altitude."""
        if isinstance(message, dialect.MAVLink_command_int_message):
            place = (degrees(message.x), degrees(message.y), message.z, message.frame)
        else:
            place = (message.param5, message.param6, message.param7, dialect.MAV_FRAME_GLOBAL)
        return self._look_at(*place, sender)

    @command(dialect.MAV_CMD_DO_SET_ROI_SYSID)
    def _on_roi_system(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_SET_ROI_SYSID: p1 the system."""
        system_id = whole(message.param1, 0)
        if not self.control.may_point(sender) or not 1 <= system_id <= 255 or system_id == self.system_id:
            return _DENIED
        self.aim.follow(system_id)
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_ROI_NONE)
    def _on_roi_none(self, message: CommandMessage, sender: Sender) -> int | None:
        if not self.control.may_point(sender):
            return _DENIED
        self.aim.clear()
        self.device.command()
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_ROI)
    def _on_old_roi(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_SET_ROI: p1 MAV_ROI; targets at waypoints are left to the autopilot, which has the mission."""
        match whole(message.param1, -1):
            case dialect.MAV_ROI_NONE:
                return self._on_roi_none(message, sender)
            case dialect.MAV_ROI_LOCATION:
                return self._on_roi_location(message, sender)
            case dialect.MAV_ROI_TARGET:
                return _UNSUPPORTED
        return _DENIED

    def _look_at(
        self, lat_deg: float, lon_deg: float, alt_m: float, frame: int, sender: Sender
    ) -> int | None:
        if not self.control.may_point(sender):
            return _DENIED
        looks = self.aim.look_at(lat_deg, lon_deg, alt_m, frame)
        if looks is None:
            return _TEMPORARILY_REJECTED  # its own position is not known
        self._next_roi_us = self._time_us
        return _ACCEPTED if looks else _DENIED

    @command(dialect.MAV_CMD_DO_MOUNT_CONFIGURE)
    def _on_mount_configure(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_MOUNT_CONFIGURE: p1 MAV_MOUNT_MODE."""
        if not self.control.may_point(sender):
            return _DENIED
        match whole(message.param1, -1):
            case dialect.MAV_MOUNT_MODE_RETRACT:
                self._point(int(GimbalFlags.RETRACT), _NAN, _NAN, _NAN, _NAN)
            case dialect.MAV_MOUNT_MODE_NEUTRAL:
                self._point(int(GimbalFlags.NEUTRAL), 0.0, 0.0, _NAN, _NAN)
            case dialect.MAV_MOUNT_MODE_MAVLINK_TARGETING | dialect.MAV_MOUNT_MODE_GPS_POINT:
                pass  # DO_MOUNT_CONTROL gives the direction
            case _:
                return _UNSUPPORTED
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_MOUNT_CONTROL)
    def _on_mount_control(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_MOUNT_CONTROL: p1 pitch, p2 roll, p3 yaw, degrees, or p4..p6 a position; p7 MAV_MOUNT_MODE."""
        pitch, roll, yaw, alt_m, lat_deg, lon_deg, mode = parameters(message)
        if not self.control.may_point(sender):
            return _DENIED
        match whole(mode, -1):
            case dialect.MAV_MOUNT_MODE_MAVLINK_TARGETING:
                leans = math.isfinite(roll) and abs(roll) <= 180.0
                turned = self._point(
                    _LEVEL, pitch * _DEG, yaw * _DEG, _NAN, _NAN, roll * _DEG if leans else 0.0
                )
                return _ACCEPTED if turned else _DENIED
            case dialect.MAV_MOUNT_MODE_GPS_POINT:
                if isinstance(message, dialect.MAVLink_command_int_message):
                    lat_deg, lon_deg = degrees(lat_deg), degrees(lon_deg)
                return self._look_at(lat_deg, lon_deg, alt_m, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, sender)
            case dialect.MAV_MOUNT_MODE_RETRACT:
                self._point(int(GimbalFlags.RETRACT), _NAN, _NAN, _NAN, _NAN)
            case dialect.MAV_MOUNT_MODE_NEUTRAL:
                self._point(int(GimbalFlags.NEUTRAL), 0.0, 0.0, _NAN, _NAN)
            case _:
                return _UNSUPPORTED
        return _ACCEPTED


def _share(value: float) -> float:
    """Limited to -1..1; NaN stays."""
    return value if math.isnan(value) else max(-1.0, min(1.0, value))
