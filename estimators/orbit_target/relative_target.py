"""Position and velocity of the target relative to an aircraft that does not know its own position.

A Kalman filter on measurements of a camera, a compass, a pitot tube and a barometer. Its state is the
horizontal offset p from the aircraft to the target and the velocity u of the target against the air, in NED
axes:

    dp/dt = u - v_air,    u = v_target - v_wind

Wind and target motion enter the relative motion only as their difference u. To the filter a static target in
wind is the same as a moving one in still air, and neither GPS nor the wind is needed. (Tolman
et al. 2021 take the relative velocity to be that of the aircraft, equation 34, and fly in still air.)

The measurements are bearing and depression of the line of sight. Equation 40, offset = height /
tan(depression), is in the measurement model, so that a flat line of sight from far away has a correspondingly
small weight.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.orbit_target.parameters import RelativeTargetParameters
from estimators.tracking.gaussian import Gaussian, Innovation
from estimators.tracking.line_of_sight import LineOfSight

Array = NDArray[np.float64]

OFFSET: Final = slice(0, 2)  # north, east, m, from aircraft to target
DRIFT: Final = slice(2, 4)  # velocity of the target against the air, m/s
SIZE: Final = 4

_KEPT: Final = 256
_LEAST_OFFSET_M: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeState:
    """An estimate at one moment, horizontal, NED axes.

    Attributes:
        time_us: vehicle time.
        offset_ne_m: offset from the aircraft to the target.
        offset_rate_ne_m_s: rate of the offset: velocity of the target relative to the aircraft.
        offset_std_m: standard deviation of the offset, the larger axis.
    """

    time_us: int
    offset_ne_m: tuple[float, float]
    offset_rate_ne_m_s: tuple[float, float]
    offset_std_m: float


class RelativeTarget:
    """The filter. Air velocities must come in the order of time (`move`); a line of sight may be up to a
    second late.

    Args:
        parameters: noise parameters.
    """

    def __init__(self, parameters: RelativeTargetParameters | None = None) -> None:
        self.parameters = parameters or RelativeTargetParameters()
        self.accepted = 0
        self.rejected = 0
        self._belief = Gaussian(SIZE)
        self._x, self._p = self._belief.mean, self._belief.covariance
        self._time_us = -1
        self._air = (0.0, 0.0)
        self._path: deque[tuple[int, float, float]] = deque(maxlen=_KEPT)
        self._known = False

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""
        return self._known

    @property
    def offset_covariance_m2(self) -> Array:
        """(2, 2) covariance of the offset, north and east."""
        return self._p[OFFSET, OFFSET].copy()

    @property
    def drift_ne_m_s(self) -> tuple[float, float]:
        """Velocity of the target relative to the air."""
        return float(self._x[2]), float(self._x[3])

    def start(
        self,
        time_us: int,
        *,
        offset_ne_m: tuple[float, float],
        offset_std_m: float,
        drift_ne_m_s: tuple[float, float],
        drift_std_m_s: float,
    ) -> None:
        """Start (again) from a target position of another source (equation 33).

        The past track through the air is kept, because images that have not yet arrived were taken from it.
        """
        if self._known and time_us >= self._time_us:
            self.move(time_us, self._air)
        else:
            self._path.clear()
            self._path.append((time_us, 0.0, 0.0))
        self._x[:] = (*offset_ne_m, *drift_ne_m_s)
        self._p[:] = np.diag((offset_std_m**2, offset_std_m**2, drift_std_m_s**2, drift_std_m_s**2))
        self._time_us = time_us
        self._known = True

    def move(self, time_us: int, air_velocity_ne_m_s: tuple[float, float]) -> None:
        """Advance to a time, with the aircraft's velocity through the air."""
        if not self._known or time_us <= self._time_us:
            self._air = air_velocity_ne_m_s
            return
        dt = (time_us - self._time_us) * 1e-6
        north = 0.5 * dt * (self._air[0] + air_velocity_ne_m_s[0])
        east = 0.5 * dt * (self._air[1] + air_velocity_ne_m_s[1])
        x, p = self._x, self.parameters
        x[0] += dt * x[2] - north
        x[1] += dt * x[3] - east
        f = np.eye(SIZE)
        f[0, 2] = f[1, 3] = dt
        walks = (p.offset_rate_m_per_root_s**2 * dt, p.drift_acceleration_m_s2_per_root_hz**2 * dt)
        self._belief.predict(f, np.repeat(walks, 2))
        self._time_us = time_us
        self._air = air_velocity_ne_m_s
        _, n0, e0 = self._path[-1]
        self._path.append((time_us, n0 + north, e0 + east))

    def see(self, time_us: int, line: LineOfSight, height_m: float) -> bool:
        """Fuse a line of sight at the time of its image; returns False when it is not of this target.

        Args:
            time_us: time of the image.
            line: measured line of sight.
            height_m: height of the aircraft over the target's ground.
        """
        found = self._innovation(time_us, line, height_m)
        if found is None:
            return False
        if found.distance_squared > self.parameters.gate:
            self.rejected += 1
            return False
        self._belief.update(found)
        self.accepted += 1
        return True

    def distance_squared(self, time_us: int, line: LineOfSight, height_m: float) -> float:
        """Normalized innovation squared of a line of sight."""
        found = self._innovation(time_us, line, height_m)
        return math.inf if found is None else found.distance_squared

    def _innovation(self, time_us: int, line: LineOfSight, height_m: float) -> Innovation | None:
        if not self._known or not height_m > 0.0:
            return None
        flown = self._flown_since(time_us)
        if flown is None:
            return None
        late_s = (self._time_us - time_us) * 1e-6
        # the offset at the time of the image: the distance flown since is subtracted
        north = self._x[0] - late_s * self._x[2] + flown[0]
        east = self._x[1] - late_s * self._x[3] + flown[1]
        rho = max(_LEAST_OFFSET_M, math.hypot(north, east))
        slant2 = rho * rho + height_m * height_m
        residual = np.array(
            (
                math.remainder(line.bearing_rad - math.atan2(east, north), math.tau),
                line.depression_rad - math.atan2(height_m, rho),
            )
        )
        to_offset = np.array(
            (
                (-east / rho**2, north / rho**2),
                (-height_m * north / (rho * slant2), -height_m * east / (rho * slant2)),
            )
        )
        h = np.zeros((2, SIZE))
        h[:, OFFSET] = to_offset
        h[:, DRIFT] = -late_s * to_offset
        sigma2 = self.parameters.angle_rad**2
        # near the vertical the bearing is not meaningful
        noise = np.diag((sigma2 * slant2 / rho**2, sigma2))
        return self._belief.innovation(residual, h, noise)

    def _flown_since(self, time_us: int) -> tuple[float, float] | None:
        """Distance flown through the air since a time, (north, east) m; None when that is too long ago."""
        last = self._path[-1]
        if time_us >= last[0]:
            dt = (time_us - last[0]) * 1e-6
            return (-self._air[0] * dt, -self._air[1] * dt) if dt < 1.0 else None
        later = last
        for sample in reversed(self._path):
            if sample[0] <= time_us:
                share = (time_us - sample[0]) / max(1, later[0] - sample[0])
                return (
                    last[1] - (sample[1] + share * (later[1] - sample[1])),
                    last[2] - (sample[2] + share * (later[2] - sample[2])),
                )
            later = sample
        return None

    def state(self, time_us: int) -> RelativeState:
        """The estimate at the present or a later time, at the present velocity through the air."""
        ahead_s = (time_us - self._time_us) * 1e-6
        rate = (float(self._x[2]) - self._air[0], float(self._x[3]) - self._air[1])
        return RelativeState(
            time_us=time_us,
            offset_ne_m=(float(self._x[0]) + ahead_s * rate[0], float(self._x[1]) + ahead_s * rate[1]),
            offset_rate_ne_m_s=rate,
            offset_std_m=math.sqrt(max(self._p[0, 0], self._p[1, 1])),
        )
