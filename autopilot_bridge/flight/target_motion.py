"""Position and velocity of a target that reports itself: a Kalman filter of constant velocity.

One variance for all axes; states are position and velocity in local NED. Gaps are extrapolated with the
velocity; late measurements are refused; after `_LOST` implausible measurements in a row the filter restarts.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_GATE: Final = 6.0
_LOST: Final = 3
_START_SPEED_M_S: Final = 10.0
_MAX_SPEED_M_S: Final = 100.0
_COURSE_SPEED_M_S: Final = 0.7


class TargetMotion:
    """The filter.

    Args:
        acceleration_m_s2: 1-sigma of the target's acceleration.
        still: the target is known not to move.

    Attributes:
        received_us: time of the newest measurement; -1: never.
        course_rad: its direction of travel; NaN until it has moved.
        accepted, refused: measurements so far.
    """

    def __init__(self, *, acceleration_m_s2: float = 1.0, still: bool = False) -> None:
        self._acceleration_m_s2 = acceleration_m_s2
        self._still = still
        self._x: Array = np.zeros((2, 3))
        self._p: Array = np.zeros((2, 2))
        self.accepted = self.refused = 0
        self.forget()

    def forget(self) -> None:
        """Forget the target."""
        self.received_us = self._time_us = -1
        self.course_rad = math.nan
        self._refused_in_a_row = 0

    def take(
        self, time_us: int, position_ned_m: Array, velocity_ned_m_s: Array | None, *, sigma_m: float
    ) -> bool:
        """Fuse a measurement taken at `time_us`; False when it is refused.

        Args:
            position_ned_m: local NED, finite.
            velocity_ned_m_s: None: not reported.
            sigma_m: 1-sigma of the position, each axis.
        """
        variance = sigma_m * sigma_m
        if self.received_us < 0:
            self._begin(time_us, position_ned_m, velocity_ned_m_s, variance)
            return True
        if time_us < self._time_us:
            self.refused += 1
            return False
        self._predict((time_us - self._time_us) * 1e-6)
        self._time_us = time_us
        residual = position_ned_m - self._x[0]
        s = float(self._p[0, 0]) + variance
        if float(np.abs(residual).max()) > _GATE * math.sqrt(s):
            self.refused += 1
            self._refused_in_a_row += 1
            if self._refused_in_a_row >= _LOST:
                self._begin(time_us, position_ned_m, velocity_ned_m_s, variance)
                return True
            return False
        self._refused_in_a_row = 0
        self._correct(0, residual, variance)
        if velocity_ned_m_s is not None and not self._still:
            self._correct(1, velocity_ned_m_s - self._x[1], 0.25)
        self._limit()
        self.accepted += 1
        self.received_us = time_us
        return True

    def at(self, time_us: int) -> tuple[Array, Array] | None:
        """(position, velocity) at a time at or after the newest measurement; None: not known."""
        if self.received_us < 0:
            return None
        ahead_s = max(0, time_us - self._time_us) * 1e-6
        return self._x[0] + ahead_s * self._x[1], self._x[1].copy()

    def age_s(self, time_us: int) -> float:
        """Age of the newest measurement; infinite when there was none."""
        return math.inf if self.received_us < 0 else (time_us - self.received_us) * 1e-6

    def _begin(self, time_us: int, position: Array, velocity: Array | None, variance: float) -> None:
        self._x[0] = position
        self._x[1] = 0.0 if velocity is None or self._still else velocity
        known = velocity is not None
        speed_variance = 0.0 if self._still else (0.25 if known else _START_SPEED_M_S**2)
        self._p[:] = ((variance, 0.0), (0.0, speed_variance))
        self._time_us = self.received_us = time_us
        self._refused_in_a_row = 0
        self.accepted += 1
        self._limit()

    def _predict(self, dt: float) -> None:
        p, q = self._p, self._acceleration_m_s2**2
        self._x[0] += dt * self._x[1]
        p[0, 0] += dt * (2.0 * p[0, 1] + dt * p[1, 1]) + q * dt**3 / 3.0
        p[0, 1] += dt * p[1, 1]
        if not self._still:
            p[0, 1] += q * dt**2 / 2.0
            p[1, 1] += q * dt
        p[1, 0] = p[0, 1]

    def _correct(self, row: int, residual: Array, variance: float) -> None:
        p = self._p
        gain = p[:, row] / (p[row, row] + variance)
        self._x += np.outer(gain, residual)
        p -= np.outer(gain, p[row, :].copy())
        p[:] = 0.5 * (p + p.T)

    def _limit(self) -> None:
        velocity = self._x[1]
        speed = float(np.linalg.norm(velocity))
        if speed > _MAX_SPEED_M_S:
            velocity *= _MAX_SPEED_M_S / speed
        if math.hypot(float(velocity[0]), float(velocity[1])) > _COURSE_SPEED_M_S:
            self.course_rad = math.atan2(float(velocity[1]), float(velocity[0]))
