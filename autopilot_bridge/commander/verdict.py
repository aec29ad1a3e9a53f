"""The commander's answer to a request, with its reasons."""

from dataclasses import dataclass
from enum import Enum, IntEnum, auto
from typing import Final


class Result(IntEnum):
    """Outcome of a request; the values are MAVLink's MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6


class Reason(Enum):
    """Why something is not possible now; each flavour has its own texts."""

    BOOTING = auto()
    GYRO = auto()
    ACCELEROMETER = auto()
    BAROMETER = auto()
    COMPASS = auto()
    AIRSPEED = auto()
    GPS = auto()
    ATTITUDE = auto()  # no attitude estimate
    ALTITUDE = auto()  # no height estimate
    POSITION = auto()  # no horizontal position estimate
    HOME = auto()
    BATTERY_LOW = auto()
    BATTERY_FAILSAFE = auto()
    MANUAL_CONTROL = auto()  # no sticks or radio
    GCS_LOST = auto()
    MISSION_MISSING = auto()
    MISSION_INVALID = auto()
    TAKEOFF_MISSING = auto()  # a mission that starts on the ground without a take-off
    NO_SETPOINTS = auto()  # offboard without a setpoint stream
    MODE_NOT_ARMABLE = auto()
    MODE_UNKNOWN = auto()
    MODE_UNAVAILABLE = auto()
    OUTSIDE_FENCE = auto()
    FENCE_MISSING = auto()  # enabled, but no geofence is set up
    FENCE_PARAMETERS = auto()  # its limits contradict each other
    FENCE_RECOVERY = auto()  # the action of a breach is still flown
    TERMINATED = auto()
    CALIBRATING = auto()
    LEANING = auto()  # tilted too far
    THROTTLE_HIGH = auto()
    THROTTLE_NOT_NEUTRAL = auto()  # not down, where that does not matter to the mode itself
    ROLL_NOT_NEUTRAL = auto()  # sticks
    PITCH_NOT_NEUTRAL = auto()
    YAW_NOT_NEUTRAL = auto()
    LANDING_SEQUENCE = auto()
    PARAMETERS = auto()  # values with which the firmware does not arm
    NOT_LANDED = auto()
    NOT_ARMED = auto()
    ALREADY_FLYING = auto()
    BAD_ALTITUDE = auto()
    BAD_PARAMETER = auto()
    WRONG_MODE = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Result of a request to the commander, with every reason against it."""

    result: Result
    reasons: tuple[Reason, ...] = ()

    @property
    def accepted(self) -> bool:
        """True when the request is executed."""
        return self.result is Result.ACCEPTED


ACCEPTED: Final = Verdict(result=Result.ACCEPTED)


def failed(*reasons: Reason) -> Verdict:
    """MAV_RESULT_FAILED: valid, but not executed."""
    return Verdict(result=Result.FAILED, reasons=reasons)
