"""Streamed setpoints as PX4 takes them in OFFBOARD (docs/firmware/px4.md, section 9).

Source: `mavlink_receiver.cpp` of PX4 1.16.1.
"""

import math
from typing import Final

from autopilot_bridge.commander.events import SetpointDenied, SetpointFault
from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs import setpoints as wire
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from flightsim.foundation.vectors import Vector

_GLOBAL_FRAMES: Final = {dialect.MAV_FRAME_GLOBAL_INT: False, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: True}
"""Whether the altitude is over home."""


class Px4Setpoints(Microservice):
    """PX4: each component can be ignored; a setpoint that controls nothing does not count."""

    def __init__(self, parts: AutopilotParts) -> None:
        self.commander = parts.commander

    @receives(dialect.MAVLink_set_position_target_local_ned_message)
    def on_local(
        self, message: dialect.MAVLink_set_position_target_local_ned_message, source: Source, time_us: int
    ) -> None:
        """SET_POSITION_TARGET_LOCAL_NED."""
        mask = message.type_mask
        position = wire.position_of((message.x, message.y, message.z), mask)
        velocity = wire.velocity_of((message.vx, message.vy, message.vz), mask)
        acceleration = wire.acceleration_of((message.afx, message.afy, message.afz), mask)
        if (
            message.coordinate_frame == dialect.MAV_FRAME_BODY_NED
        ):  # a position is not used, whatever its bits
            context = self.commander.context
            position = wire.UNSET
            velocity = wire.whole(velocity, wire.VELOCITY_BITS, mask)
            velocity = wire.rotated_by_heading(velocity, wire.heading_of(context))
            acceleration = wire.whole(acceleration, wire.ACCELERATION_BITS, mask)
            acceleration = wire.rotated_by_attitude(acceleration, context)
        elif message.coordinate_frame != dialect.MAV_FRAME_LOCAL_NED:
            self._deny(message, SetpointFault.FRAME)
            return
        self._take(message, position, velocity, acceleration, time_us)

    @receives(dialect.MAVLink_set_position_target_global_int_message)
    def on_global(
        self, message: dialect.MAVLink_set_position_target_global_int_message, source: Source, time_us: int
    ) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT."""
        mask = message.type_mask
        position = wire.UNSET
        if not any(mask & bit for bit in wire.POSITION_BITS):  # used whole; the frame is that of the position
            relative = _GLOBAL_FRAMES.get(message.coordinate_frame)
            if relative is None:
                self._deny(message, SetpointFault.FRAME)
                return
            place = wire.local_from_global(
                self.commander.context, message.lat_int, message.lon_int, message.alt, relative=relative
            )
            if place is None:
                return
            position = wire.position_of(place, mask)
        velocity = wire.velocity_of((message.vx, message.vy, message.vz), mask)
        acceleration = wire.acceleration_of((message.afx, message.afy, message.afz), mask)
        self._take(message, position, velocity, acceleration, time_us)

    def _take(
        self,
        message: dialect.MAVLink_set_position_target_local_ned_message
        | dialect.MAVLink_set_position_target_global_int_message,
        position: Vector,
        velocity: Vector,
        acceleration: Vector,
        time_us: int,
    ) -> None:
        target = wire.Target(
            position, velocity, acceleration, *wire.yaw_of(message.yaw, message.yaw_rate, message.type_mask)
        )
        if target.has_acceleration and message.type_mask & wire.FORCE_BIT:
            self._deny(message, SetpointFault.FORCES)
            return
        if not (target.has_position or target.has_velocity or target.has_acceleration):
            self._deny(message, SetpointFault.NOTHING)
            return
        stream = self.commander.setpoints
        stream.offboard.set_trajectory(*target)
        stream.note(time_us, needs_position=target.has_position or target.has_velocity)

    def _deny(
        self,
        message: dialect.MAVLink_set_position_target_local_ned_message
        | dialect.MAVLink_set_position_target_global_int_message,
        fault: SetpointFault,
    ) -> None:
        commander = self.commander
        commander.emit(
            SetpointDenied(
                time_us=commander.time_us,
                message=message.get_type(),
                fault=fault,
                frame=message.coordinate_frame,
            )
        )

    @receives(dialect.MAVLink_set_attitude_target_message)
    def on_attitude(
        self, message: dialect.MAVLink_set_attitude_target_message, source: Source, time_us: int
    ) -> None:
        """SET_ATTITUDE_TARGET."""
        mask = message.type_mask
        thrust = message.thrust
        if mask & wire.THROTTLE_BIT or not math.isfinite(thrust):
            return
        thrust = min(1.0, max(0.0, thrust))
        rates = wire.rates_of(message)
        stream = self.commander.setpoints
        if not mask & wire.ATTITUDE_BIT:
            q = wire.unit_quaternion(list(message.q), tolerance=0.1)
            if q is None:
                return
            stream.offboard.set_attitude(q, thrust, rates)
        elif all(math.isfinite(rate) for rate in rates):
            stream.offboard.set_rates(rates, thrust)
        else:
            return
        stream.note(time_us, needs_position=False)
