"""Crash detection: the vehicle does not move, is tilted, and its attitude differs from the setpoint.

Source: ArduCopter 4.6, `crash_check.cpp` (FS_CRASH_CHECK).
"""

import math
from typing import Final

from autopilot_bridge.commander.events import Crashed
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.navigation import layout as nav

_ANGLE_ERROR_RAD: Final = math.radians(30.0)
_LEAN_RAD: Final = math.radians(15.0)
_ACCELERATION_M_S2: Final = 3.0
_SPEED_M_S: Final = 10.0
_TIME_US: Final = 2_000_000
_SMOOTHING: Final = 0.4  # at 10 Hz: the acceleration's low-pass of 1 Hz
_EXEMPT: Final = frozenset((FlightMode.ACRO,))


class CrashCheck:
    """Monitors one flight; called at 10 Hz."""

    def __init__(self) -> None:
        self._acceleration_m_s2 = [0.0, 0.0, 0.0]
        self._since_us: int | None = None

    def update(self, situation: Situation, context: FlightContext) -> Crashed | None:
        """Check the vehicle; returns the event once it has been in this state for two seconds."""
        if context.attitude_setpoint is None:
            return None
        for axis, newest in enumerate(context.nav[nav.ACC_NED_M_S2].tolist()):
            self._acceleration_m_s2[axis] += _SMOOTHING * (newest - self._acceleration_m_s2[axis])
        if not situation.airborne or situation.mode in _EXEMPT:
            self._since_us = None
            return None
        acceleration_m_s2 = math.hypot(*self._acceleration_m_s2)
        error_rad = _angle(context.attitude_setpoint.tolist(), context.nav[nav.Q_NED_FROM_FRD].tolist())
        crashed = (
            acceleration_m_s2 < _ACCELERATION_M_S2
            and situation.tilt_rad > _LEAN_RAD
            and error_rad > _ANGLE_ERROR_RAD
            and math.hypot(*context.nav[nav.VEL_NED_M_S].tolist()) < _SPEED_M_S
        )
        if not crashed:
            self._since_us = None
            return None
        if self._since_us is None:
            self._since_us = situation.time_us
        if situation.time_us - self._since_us < _TIME_US:
            return None
        return Crashed(
            time_us=situation.time_us,
            angle_error_deg=math.degrees(error_rad),
            acceleration_m_s2=acceleration_m_s2,
        )


def _angle(a: list[float], b: list[float]) -> float:
    """The angle between two attitudes."""
    return 2.0 * math.acos(min(1.0, abs(sum(x * y for x, y in zip(a, b, strict=True)))))
