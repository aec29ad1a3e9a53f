"""Source of the aircraft's attitude.

This module uses the autopilot's own estimate; any object with the same method can replace it
(`filter_attitude`).
"""

import math
from collections import deque
from typing import Final, Protocol

from flightsim.foundation.vectors import Quaternion, between, from_euler
from missions.vehicle.telemetry import Attitude

_KEPT: Final = 256
_STALE_US: Final = 500_000


class AttitudeSource(Protocol):
    """Attitude as a function of time."""

    def at(self, time_us: int) -> Quaternion | None:
        """`q_ned_from_frd` at a vehicle time; None when it is not known for that time."""
        ...


class AutopilotAttitude:
    """The autopilot's attitude (ATTITUDE), interpolated between its messages.

    There is no attitude before the oldest kept message or later than half a second after the newest.
    """

    def __init__(self) -> None:
        self._kept: deque[tuple[int, Quaternion]] = deque(maxlen=_KEPT)

    def add(self, attitude: Attitude) -> bool:
        """Add one message; returns False when it is not newer than the newest, or not a valid attitude."""
        if self._kept and attitude.time_us <= self._kept[-1][0]:
            return False
        if not math.isfinite(attitude.roll_rad + attitude.pitch_rad + attitude.yaw_rad):
            return False
        self._kept.append(
            (attitude.time_us, from_euler(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad))
        )
        return True

    def at(self, time_us: int) -> Quaternion | None:
        later: tuple[int, Quaternion] | None = None
        for sample in reversed(self._kept):
            if sample[0] <= time_us:
                if later is None:
                    return sample[1] if time_us - sample[0] <= _STALE_US else None
                return between(sample[1], later[1], (time_us - sample[0]) / (later[0] - sample[0]))
            later = sample
        return None
