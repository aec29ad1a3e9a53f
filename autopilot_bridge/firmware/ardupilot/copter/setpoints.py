"""Streamed setpoints as ArduCopter takes them in GUIDED (docs/firmware/ardupilot.md, sections 6 and 7).

Source: `ArduCopter/GCS_Mavlink.cpp` of ArduPilot 4.6.3.
"""

import math
from typing import Final

from autopilot_bridge.commander.modes import GUIDED_MODES, FlightMode
from autopilot_bridge.dispatch import receives
from autopilot_bridge.flight.multicopter.guided import GuidedTask
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs import setpoints as wire
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from flightsim.foundation.vectors import Vector

_GLOBAL_FRAMES: Final = {
    dialect.MAV_FRAME_GLOBAL_INT: False,
    dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: True,
    dialect.MAV_FRAME_GLOBAL: False,
    dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT: True,
}
"""Whether the altitude is over home."""
_OFFSET_FRAMES: Final = frozenset(
    {dialect.MAV_FRAME_LOCAL_OFFSET_NED, dialect.MAV_FRAME_BODY_NED, dialect.MAV_FRAME_BODY_OFFSET_NED}
)
_BODY_FRAMES: Final = frozenset({dialect.MAV_FRAME_BODY_NED, dialect.MAV_FRAME_BODY_OFFSET_NED})


class ArduCopterSetpoints(Microservice):
    """ArduCopter: position, velocity and acceleration are each used or ignored whole; used in GUIDED only."""

    def __init__(self, parts: AutopilotParts) -> None:
        self.commander = parts.commander

    @receives(dialect.MAVLink_set_position_target_local_ned_message)
    def on_local(
        self, message: dialect.MAVLink_set_position_target_local_ned_message, source: Source, time_us: int
    ) -> None:
        """SET_POSITION_TARGET_LOCAL_NED."""
        guided = self._guided()
        if guided is None:
            return
        context, frame, mask = self.commander.context, message.coordinate_frame, message.type_mask
        if frame != dialect.MAV_FRAME_LOCAL_NED and frame not in _OFFSET_FRAMES:
            guided.set_hold(context)
            return
        position = _whole(wire.POSITION_BITS, mask, wire.position_of((message.x, message.y, message.z), 0))
        motion = self._motion(guided, message)
        if motion is None or position is None:
            return
        velocity, acceleration = motion
        yaw, yaw_rate = wire.yaw_of(message.yaw, message.yaw_rate, mask)
        if frame in _BODY_FRAMES:
            heading = wire.heading_of(context)
            position = wire.rotated_by_heading(position, heading)
            velocity = wire.rotated_by_heading(velocity, heading)
            acceleration = wire.rotated_by_heading(acceleration, heading)
            yaw += heading
        if frame in _OFFSET_FRAMES:
            north_m, east_m, down_m = wire.place_of(context)
            position = (position[0] + north_m, position[1] + east_m, position[2] + down_m)
        self._follow(guided, wire.Target(position, velocity, acceleration, yaw, yaw_rate))

    @receives(dialect.MAVLink_set_position_target_global_int_message)
    def on_global(
        self, message: dialect.MAVLink_set_position_target_global_int_message, source: Source, time_us: int
    ) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT."""
        guided = self._guided()
        if guided is None:
            return
        context, mask = self.commander.context, message.type_mask
        motion = self._motion(guided, message)
        if motion is None:
            return
        velocity, acceleration = motion
        position = wire.UNSET
        if not any(mask & bit for bit in wire.POSITION_BITS):  # the frame is that of the position
            place, relative = None, _GLOBAL_FRAMES.get(message.coordinate_frame)
            if relative is not None:
                place = wire.local_from_global(
                    context, message.lat_int, message.lon_int, message.alt, relative=relative
                )
            if place is None:
                guided.set_hold(context)
                return
            position = place
        yaw, yaw_rate = wire.yaw_of(message.yaw, message.yaw_rate, mask)
        self._follow(guided, wire.Target(position, velocity, acceleration, yaw, yaw_rate))

    def _motion(
        self,
        guided: GuidedTask,
        message: dialect.MAVLink_set_position_target_local_ned_message
        | dialect.MAVLink_set_position_target_global_int_message,
    ) -> tuple[Vector, Vector] | None:
        """Velocity and acceleration; None: the message is not used further.

        A velocity that is no speed of a vehicle stops it, forces and an impossible acceleration are ignored.
        """
        mask = message.type_mask
        acceleration = _whole(
            wire.ACCELERATION_BITS, mask, wire.acceleration_of((message.afx, message.afy, message.afz), 0)
        )
        forces = mask & wire.FORCE_BIT and not any(mask & bit for bit in wire.ACCELERATION_BITS)
        if acceleration is None or forces:
            return None
        velocity = _whole(wire.VELOCITY_BITS, mask, wire.velocity_of((message.vx, message.vy, message.vz), 0))
        if velocity is None:
            guided.set_hold(self.commander.context)
            return None
        return velocity, acceleration

    def _follow(self, guided: GuidedTask, target: wire.Target) -> None:
        context = self.commander.context
        yaw, yaw_rate = target.yaw_rad, target.yaw_rate_rad_s
        if target.has_position and target.has_velocity:
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
        elif target.has_position and not target.has_acceleration:
            self.commander.guidance.go_to(guided, target.position, yaw_rad=yaw, yaw_rate_rad_s=yaw_rate)
        else:
            guided.set_hold(context)

    @receives(dialect.MAVLink_set_attitude_target_message)
    def on_attitude(
        self, message: dialect.MAVLink_set_attitude_target_message, source: Source, time_us: int
    ) -> None:
        """SET_ATTITUDE_TARGET."""
        mask = message.type_mask
        guided = self._guided()
        if guided is None or mask & wire.THROTTLE_BIT or not math.isfinite(message.thrust):
            return
        if mask & wire.ATTITUDE_BIT:
            return  # body rates alone are not flown here
        q = wire.unit_quaternion(list(message.q), tolerance=0.01)
        if q is None:
            return
        rates = wire.rates_of(message)
        used = [math.isfinite(rate) for rate in rates]
        if any(used) and not all(used):  # all three or none
            guided.set_hold(self.commander.context)
            return
        guided.set_attitude(
            self.commander.context, q, min(1.0, max(0.0, message.thrust)), rates, yaw_rate_rad_s=rates[2]
        )

    def _guided(self) -> GuidedTask | None:
        commander = self.commander
        if commander.mode not in GUIDED_MODES or commander.mode is FlightMode.OFFBOARD:
            return None
        return commander.guidance.guided()


def _whole(bits: Vector | tuple[int, int, int], type_mask: int, values: Vector) -> Vector | None:
    """A vector that is used whole: ignored when any of its bits is set; None when a component is invalid."""
    if any(type_mask & int(bit) for bit in bits):
        return wire.UNSET
    return values if all(math.isfinite(value) for value in values) else None
