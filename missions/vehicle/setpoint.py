"""Streamed setpoints: SET_POSITION_TARGET_LOCAL_NED and SET_ATTITUDE_TARGET with their type masks."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from flightsim.foundation.vectors import Vector, from_euler
from missions.errors import PlanError

_IGNORE_POSITION: Final = 0x007
_IGNORE_VELOCITY: Final = 0x038
_IGNORE_ACCELERATION: Final = 0x1C0
_IGNORE_YAW: Final = 0x400
_IGNORE_YAW_RATE: Final = 0x800
_IGNORE_RATES: Final = 0x07
_IGNORE_PITCH_AND_YAW_RATE: Final = 0x06
_IGNORE_THRUST: Final = 0x40
_IGNORE_ATTITUDE: Final = 0x80
_ZERO: Final[Vector] = (0.0, 0.0, 0.0)


def unmoved(place_ned_m: Vector) -> Vector:
    """The same place: it is one of the autopilot's local frame already."""
    return place_ned_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Setpoint:
    """The commanded state of the vehicle; None: not controlled, or no feed-forward.

    Attributes:
        position_ned_m: position in the autopilot's local frame (or from home: see `Vehicle.follow`).
        velocity_ned_m_s, acceleration_ned_m_s2: commands, or feed-forward when there is a position.
        yaw_rad: heading, clockwise from north.
        yaw_rate_rad_s: turn rate.
    """

    position_ned_m: Vector | None = None
    velocity_ned_m_s: Vector | None = None
    acceleration_ned_m_s2: Vector | None = None
    yaw_rad: float | None = None
    yaw_rate_rad_s: float | None = None

    def __post_init__(self) -> None:
        if self.position_ned_m is self.velocity_ned_m_s is self.acceleration_ned_m_s2 is None:
            raise ValueError("a setpoint needs at least one of position, velocity and acceleration")

    @property
    def type_mask(self) -> int:
        """POSITION_TARGET_TYPEMASK of the fields to ignore."""
        return (
            (_IGNORE_POSITION if self.position_ned_m is None else 0)
            | (_IGNORE_VELOCITY if self.velocity_ned_m_s is None else 0)
            | (_IGNORE_ACCELERATION if self.acceleration_ned_m_s2 is None else 0)
            | (_IGNORE_YAW if self.yaw_rad is None else 0)
            | (_IGNORE_YAW_RATE if self.yaw_rate_rad_s is None else 0)
        )

    def message(
        self, time_us: int, system_id: int, local: Callable[[Vector], Vector] = unmoved
    ) -> MAVLinkMessage:
        """The MAVLink message.

        Args:
            time_us: vehicle time.
            system_id: of the vehicle.
            local: the place in the autopilot's local frame of the setpoint's place.
        """
        position = _ZERO if self.position_ned_m is None else local(self.position_ned_m)
        return dialect.MAVLink_set_position_target_local_ned_message(
            time_us // 1000 & 0xFFFFFFFF,
            system_id,
            1,
            dialect.MAV_FRAME_LOCAL_NED,
            self.type_mask,
            *position,
            *(self.velocity_ned_m_s or _ZERO),
            *(self.acceleration_ned_m_s2 or _ZERO),
            self.yaw_rad or 0.0,
            self.yaw_rate_rad_s or 0.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeSetpoint:
    """The commanded attitude and thrust of an aircraft.

    Attributes:
        roll_rad: bank angle, right wing down positive.
        pitch_rad: pitch angle, nose up positive; None: the autopilot's altitude control determines it
            (ArduPilot's plane).
        thrust: 0..1; None: the autopilot's speed control determines it (ArduPilot).
        yaw_rad: heading; a fixed wing turns by its bank and ignores it.
    """

    roll_rad: float
    pitch_rad: float | None = None
    thrust: float | None = None
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("roll", self.roll_rad), ("pitch", self.pitch_rad), ("yaw", self.yaw_rad)):
            if value is not None and not math.isfinite(value):
                raise PlanError(f"an attitude with a {name} of {value} can't be flown; give an angle")
        if self.thrust is not None and not 0.0 <= self.thrust <= 1.0:
            raise PlanError(f"a thrust of {self.thrust} is not in 0..1")

    @property
    def type_mask(self) -> int:
        """ATTITUDE_TARGET_TYPEMASK of the fields to ignore.

        Roll alone is sent in the form that ArduPilot's plane accepts: the attitude bit is set (ignored), and
        the bit of the roll rate is clear (0xC6).
        """
        thrust = _IGNORE_THRUST if self.thrust is None else 0
        if self.pitch_rad is None:
            return _IGNORE_ATTITUDE | _IGNORE_PITCH_AND_YAW_RATE | thrust
        return _IGNORE_RATES | thrust

    def message(
        self, time_us: int, system_id: int, local: Callable[[Vector], Vector] = unmoved
    ) -> MAVLinkMessage:
        """The setpoint as a MAVLink message; it has no place, so `local` has no effect."""
        return dialect.MAVLink_set_attitude_target_message(
            time_us // 1000 & 0xFFFFFFFF,
            system_id,
            1,
            self.type_mask,
            list(from_euler(self.roll_rad, self.pitch_rad or 0.0, self.yaw_rad)),
            0.0,
            0.0,
            0.0,
            0.0 if self.thrust is None else self.thrust,
        )


AnySetpoint = Setpoint | AttitudeSetpoint
"""A setpoint of either kind."""
