"""Streamed setpoints: SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT and SET_ATTITUDE_TARGET.

PX4 flies them in OFFBOARD as they come and counts the good ones as a sign of life (docs/firmware/px4.md,
section 9). ArduPilot flies them smoothly in GUIDED (docs/firmware/ardupilot.md, sections 6 and 7). Neither
acknowledges them.
"""

import math
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.modes import GUIDED_MODES, FlightMode
from autopilot_bridge.firmware.ardupilot.plane.setpoints import ArduPlaneSetpoints
from autopilot_bridge.flight.multicopter.guided import GuidedTask
from autopilot_bridge.services.channel import MavlinkMessage, Receiver
from autopilot_bridge.services.inputs.setpoint_frames import (
    ACCELERATION_BITS,
    FORCE_BIT,
    POSITION_BITS,
    UNSET,
    VELOCITY_BITS,
    Target,
    Triple,
    acceleration_of,
    heading_of,
    local_from_global,
    place_of,
    position_of,
    rotated_by_heading,
    unit_quaternion,
    velocity_of,
    yaw_of,
)
from autopilot_bridge.services.vehicle_class import is_aircraft

_RATE_BITS: Final = (1, 2, 4)  # SET_ATTITUDE_TARGET.type_mask
_THROTTLE_BIT: Final = 64
_ATTITUDE_BIT: Final = 128
_MAX_RATE_RAD_S: Final = 100.0

_PX4_GLOBAL_FRAMES: Final = {
    mavlink.MAV_FRAME_GLOBAL_INT: False,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: True,
}
_ARDUPILOT_GLOBAL_FRAMES: Final = {
    **_PX4_GLOBAL_FRAMES,
    mavlink.MAV_FRAME_GLOBAL: False,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: True,
}
_ARDUPILOT_OFFSET_FRAMES: Final = frozenset(
    {mavlink.MAV_FRAME_LOCAL_OFFSET_NED, mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED}
)
_ARDUPILOT_BODY_FRAMES: Final = frozenset({mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED})


class SetpointRules(Protocol):
    """How one firmware uses each kind of setpoint; invalid setpoints are ignored."""

    def on_local(self, message: MavlinkMessage, time_us: int) -> None: ...

    def on_global(self, message: MavlinkMessage, time_us: int) -> None: ...

    def on_attitude(self, message: MavlinkMessage, time_us: int) -> None: ...


class SetpointService:
    """Passes setpoints to the commander's setpoint stream.

    Args:
        flavour: name of the flavour whose rules apply.
        commander: owns the setpoint stream.
    """

    def __init__(self, flavour: str, commander: Commander) -> None:
        rules = _AIRCRAFT if is_aircraft(commander) else _MULTICOPTERS
        self._rules: SetpointRules = rules[flavour](commander)

    @property
    def receivers(self) -> Mapping[int, Receiver]:
        """The three kinds of setpoints; invalid ones are ignored, as in the flavour."""
        rules = self._rules
        return {
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: (
                lambda message, source, time_us: rules.on_local(message, time_us)
            ),
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: (
                lambda message, source, time_us: rules.on_global(message, time_us)
            ),
            mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: (
                lambda message, source, time_us: rules.on_attitude(message, time_us)
            ),
        }


class Px4Setpoints:
    """PX4: each component can be ignored; a setpoint that controls nothing does not count."""

    def __init__(self, commander: Commander) -> None:
        self.commander = commander

    def on_local(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_POSITION_TARGET_LOCAL_NED."""
        mask = message.type_mask
        position = position_of((message.x, message.y, message.z), mask)
        velocity = velocity_of((message.vx, message.vy, message.vz), mask)
        acceleration = acceleration_of((message.afx, message.afy, message.afz), mask)
        if message.coordinate_frame == mavlink.MAV_FRAME_BODY_NED:
            if any(not mask & bit for bit in POSITION_BITS):
                return
            heading = heading_of(self.commander.context)
            velocity = rotated_by_heading(velocity, heading)
            acceleration = rotated_by_heading(acceleration, heading)
        elif message.coordinate_frame != mavlink.MAV_FRAME_LOCAL_NED:
            return
        self._take(message, position, velocity, acceleration, time_us)

    def on_global(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT."""
        mask = message.type_mask
        relative = _PX4_GLOBAL_FRAMES.get(message.coordinate_frame)
        if relative is None:
            return
        position = UNSET
        if not all(mask & bit for bit in POSITION_BITS):
            place = local_from_global(
                self.commander.context, message.lat_int, message.lon_int, message.alt, relative=relative
            )
            if place is None:
                return
            position = position_of(place, mask)
        velocity = velocity_of((message.vx, message.vy, message.vz), mask)
        acceleration = acceleration_of((message.afx, message.afy, message.afz), mask)
        self._take(message, position, velocity, acceleration, time_us)

    def _take(
        self, message: MavlinkMessage, position: Triple, velocity: Triple, acceleration: Triple, time_us: int
    ) -> None:
        if message.type_mask & FORCE_BIT:
            return
        target = Target(
            position, velocity, acceleration, *yaw_of(message.yaw, message.yaw_rate, message.type_mask)
        )
        if not (target.has_position or target.has_velocity or target.has_acceleration):
            return
        stream = self.commander.setpoints
        stream.offboard.set_trajectory(*target)
        stream.note(time_us, needs_position=target.has_position or target.has_velocity)

    def on_attitude(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_ATTITUDE_TARGET."""
        mask = message.type_mask
        thrust = message.thrust
        if mask & _THROTTLE_BIT or not math.isfinite(thrust):
            return
        thrust = min(1.0, max(0.0, thrust))
        rates = _rates(message)
        stream = self.commander.setpoints
        if not mask & _ATTITUDE_BIT:
            q = unit_quaternion(list(message.q), tolerance=0.1)
            if q is None:
                return
            stream.offboard.set_attitude(q, thrust, rates)
        elif all(math.isfinite(rate) for rate in rates):
            stream.offboard.set_rates(rates, thrust)
        else:
            return
        stream.note(time_us, needs_position=False)


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
        if frame != mavlink.MAV_FRAME_LOCAL_NED and frame not in _ARDUPILOT_OFFSET_FRAMES:
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
        if frame in _ARDUPILOT_BODY_FRAMES:
            heading = heading_of(context)
            position = rotated_by_heading(position, heading)
            velocity = rotated_by_heading(velocity, heading)
            acceleration = rotated_by_heading(acceleration, heading)
            yaw += heading if frame == mavlink.MAV_FRAME_BODY_OFFSET_NED else 0.0
        if frame in _ARDUPILOT_OFFSET_FRAMES:
            north_m, east_m, down_m = place_of(context)
            position = (position[0] + north_m, position[1] + east_m, position[2] + down_m)
        self._follow(guided, Target(position, velocity, acceleration, yaw, yaw_rate), mask)

    def on_global(self, message: MavlinkMessage, time_us: int) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT."""
        guided = self._guided()
        if guided is None:
            return
        context, mask = self.commander.context, message.type_mask
        relative = _ARDUPILOT_GLOBAL_FRAMES.get(message.coordinate_frame)
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
        if guided is None or mask & _THROTTLE_BIT or not math.isfinite(message.thrust):
            return
        if mask & _ATTITUDE_BIT:
            return  # body rates alone are not flown here
        q = unit_quaternion(list(message.q), tolerance=0.01)
        if q is None:
            return
        rates = _rates(message)
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


_MULTICOPTERS: Final[Mapping[str, Callable[[Commander], SetpointRules]]] = {
    "px4": Px4Setpoints,
    "ardupilot": ArduCopterSetpoints,
}
_AIRCRAFT: Final[Mapping[str, Callable[[Commander], SetpointRules]]] = {
    "px4": Px4Setpoints,  # the offboard task of an aircraft has the same setters
    "ardupilot": ArduPlaneSetpoints,
}


def _whole(bits: Triple | tuple[int, int, int], type_mask: int, values: Triple) -> Triple | None:
    """A vector that is used whole: ignored when any of its bits is set; None when a component is invalid."""
    if any(type_mask & int(bit) for bit in bits):
        return UNSET
    return values if all(math.isfinite(value) for value in values) else None


def _rates(message: MavlinkMessage) -> Triple:
    """Body rates that are not ignored, rad/s; NaN for the others."""
    values = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    roll, pitch, yaw = (
        float(value) if not message.type_mask & bit and abs(value) <= _MAX_RATE_RAD_S else math.nan
        for value, bit in zip(values, _RATE_BITS, strict=True)
    )
    return roll, pitch, yaw
