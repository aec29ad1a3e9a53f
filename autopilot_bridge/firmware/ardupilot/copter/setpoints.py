"""Streamed setpoints as ArduCopter takes them in GUIDED (docs/firmware/ardupilot.md, sections 6 and 7)."""

import math
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.modes import GUIDED_MODES, FlightMode
from autopilot_bridge.flight.multicopter.guided import GuidedTask
from autopilot_bridge.services.channel import MavlinkMessage
from autopilot_bridge.services.inputs.setpoints import (
    ACCELERATION_BITS,
    ATTITUDE_BIT,
    FORCE_BIT,
    POSITION_BITS,
    THROTTLE_BIT,
    UNSET,
    VELOCITY_BITS,
    Target,
    Triple,
    acceleration_of,
    heading_of,
    local_from_global,
    place_of,
    position_of,
    rates_of,
    rotated_by_heading,
    unit_quaternion,
    velocity_of,
    yaw_of,
)

_GLOBAL_FRAMES: Final = {
    mavlink.MAV_FRAME_GLOBAL_INT: False,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: True,
    mavlink.MAV_FRAME_GLOBAL: False,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: True,
}
"""Whether the altitude is over home."""
_OFFSET_FRAMES: Final = frozenset(
    {mavlink.MAV_FRAME_LOCAL_OFFSET_NED, mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED}
)
_BODY_FRAMES: Final = frozenset({mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED})


class ArduCopterSetpoints:
    """ArduCopter: position, velocity and acceleration are each used or ignored whole; used in GUIDED only."""

    def __init__(self, commander: Commander) -> None:
        self.commander = commander

    def on_local(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_POSITION_TARGET_LOCAL_NED."""
        guided = self._guided()
        if guided is None:
            return
        context, frame, mask = self.commander.context, message.coordinate_frame, message.type_mask
        if frame != mavlink.MAV_FRAME_LOCAL_NED and frame not in _OFFSET_FRAMES:
            guided.set_hold(context)
            return
        position = _whole(POSITION_BITS, mask, position_of((message.x, message.y, message.z), 0))
        velocity = _whole(VELOCITY_BITS, mask, velocity_of((message.vx, message.vy, message.vz), 0))
        acceleration = _whole(
            ACCELERATION_BITS, mask, acceleration_of((message.afx, message.afy, message.afz), 0)
        )
        if position is None or velocity is None or acceleration is None:
            return
        yaw, yaw_rate = yaw_of(message.yaw, message.yaw_rate, mask)
        if frame in _BODY_FRAMES:
            heading = heading_of(context)
            position = rotated_by_heading(position, heading)
            velocity = rotated_by_heading(velocity, heading)
            acceleration = rotated_by_heading(acceleration, heading)
            yaw += heading if frame == mavlink.MAV_FRAME_BODY_OFFSET_NED else 0.0
        if frame in _OFFSET_FRAMES:
            north_m, east_m, down_m = place_of(context)
            position = (position[0] + north_m, position[1] + east_m, position[2] + down_m)
        self._follow(guided, Target(position, velocity, acceleration, yaw, yaw_rate), mask)

    def on_global(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT."""
        guided = self._guided()
        if guided is None:
            return
        context, mask = self.commander.context, message.type_mask
        relative = _GLOBAL_FRAMES.get(message.coordinate_frame)
        if relative is None:
            guided.set_hold(context)
            return
        position: Triple | None = UNSET
        if not any(mask & bit for bit in POSITION_BITS):
            position = local_from_global(
                context, message.lat_int, message.lon_int, message.alt, relative=relative
            )
        velocity = _whole(VELOCITY_BITS, mask, velocity_of((message.vx, message.vy, message.vz), 0))
        acceleration = _whole(
            ACCELERATION_BITS, mask, acceleration_of((message.afx, message.afy, message.afz), 0)
        )
        if position is None or velocity is None or acceleration is None:
            return
        yaw, yaw_rate = yaw_of(message.yaw, message.yaw_rate, mask)
        self._follow(guided, Target(position, velocity, acceleration, yaw, yaw_rate), mask)

    def _follow(self, guided: GuidedTask, target: Target, type_mask: int) -> None:
        context = self.commander.context
        yaw, yaw_rate = target.yaw_rad, target.yaw_rate_rad_s
        if type_mask & FORCE_BIT:
            guided.set_hold(context)
        elif target.has_position and target.has_velocity:
            guided.set_trajectory(
                context,
                target.position,
                target.velocity,
                acceleration_ned_m_s2=target.acceleration,
                yaw_rad=yaw,
                yaw_rate_rad_s=yaw_rate,
            )
        elif target.has_velocity:
            guided.set_velocity(
                context,
                target.velocity,
                acceleration_ned_m_s2=target.acceleration,
                yaw_rad=yaw,
                yaw_rate_rad_s=yaw_rate,
            )
        elif target.has_acceleration and not target.has_position:
            guided.set_acceleration(context, target.acceleration, yaw_rad=yaw, yaw_rate_rad_s=yaw_rate)
        elif target.has_position:
            self.commander.guidance.go_to(guided, target.position, yaw_rad=yaw, yaw_rate_rad_s=yaw_rate)
        else:
            guided.set_hold(context)

    def on_attitude(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_ATTITUDE_TARGET."""
        mask = message.type_mask
        guided = self._guided()
        if guided is None or mask & THROTTLE_BIT or not math.isfinite(message.thrust):
            return
        if mask & ATTITUDE_BIT:
            return  # body rates alone are not flown here
        q = unit_quaternion(list(message.q), tolerance=0.01)
        if q is None:
            return
        rates = rates_of(message)
        guided.set_attitude(
            self.commander.context,
            q,
            min(1.0, max(0.0, message.thrust)),
            rates if all(math.isfinite(rate) for rate in rates) else UNSET,
            yaw_rate_rad_s=rates[2],
        )

    def _guided(self) -> GuidedTask | None:
        commander = self.commander
        if commander.mode not in GUIDED_MODES or commander.mode is FlightMode.OFFBOARD:
            return None
        return commander.guidance.guided()


def _whole(bits: Triple | tuple[int, int, int], type_mask: int, values: Triple) -> Triple | None:
    """A vector that is used whole: ignored when any of its bits is set; None when a component is invalid."""
    if any(type_mask & int(bit) for bit in bits):
        return UNSET
    return values if all(math.isfinite(value) for value in values) else None
