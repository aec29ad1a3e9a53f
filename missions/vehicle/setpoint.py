"""Streamed setpoints: SET_POSITION_TARGET_LOCAL_NED with its type mask."""

from dataclasses import dataclass
from typing import Any, Final

from autopilot_bridge.mavlink import dialect

Vector = tuple[float, float, float]

_IGNORE_POSITION: Final = 0x007
_IGNORE_VELOCITY: Final = 0x038
_IGNORE_ACCELERATION: Final = 0x1C0
_IGNORE_YAW: Final = 0x400
_IGNORE_YAW_RATE: Final = 0x800
_ZERO: Final[Vector] = (0.0, 0.0, 0.0)


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

    def message(self, time_us: int, system_id: int, offset_ned_m: Vector = _ZERO) -> Any:
        """The MAVLink message, with the position moved by `offset_ned_m` (the place of home in the local
        frame).
        """
        position = self.position_ned_m or _ZERO
        if self.position_ned_m is not None:
            position = (
                position[0] + offset_ned_m[0],
                position[1] + offset_ned_m[1],
                position[2] + offset_ned_m[2],
            )
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
