"""Streamed attitude setpoints: SET_ATTITUDE_TARGET with its type mask."""

import math
from dataclasses import dataclass
from typing import Any, Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.vectors import from_euler
from missions.errors import PlanError
from missions.vehicle.setpoint import Vector

_IGNORE_RATES: Final = 0x07
_IGNORE_PITCH_AND_YAW_RATE: Final = 0x06
_IGNORE_THRUST: Final = 0x40
_IGNORE_ATTITUDE: Final = 0x80


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

    def message(self, time_us: int, system_id: int, offset_ned_m: Vector = (0.0, 0.0, 0.0)) -> Any:
        """The setpoint as a MAVLink message. An attitude has no position, so the offset of the local frame
        has no effect.
        """
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
