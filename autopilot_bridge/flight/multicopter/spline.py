"""Smooth curves through waypoints (NAV_SPLINE_WAYPOINT), flown at a speed that the curve allows.

A cubic Hermite curve between two places with given directions there, as ArduCopter's SplineCurve
(AP_Math/SplineCurve); the speed profile over it is the usual forward and backward pass over the limits of
lateral and tangential acceleration (Lynch and Park, Modern Robotics, 2017, section 9.4).
"""

import math
from typing import Final

import numpy as np

from autopilot_bridge.flight.context import Array
from autopilot_bridge.flight.parameters import FlightParameters

_SAMPLES: Final = 97
_LATERAL_SHARE: Final = 0.7  # of the acceleration, for the curve; the rest is left to speed up and brake
_LONGEST_TANGENTS: Final = 4.0  # sum of both tangents over the distance, as ArduCopter limits them
_SLOWEST_M_S: Final = 0.3


class SplineCurve:
    """One curve, in local NED, with the highest speeds at which it can be flown.

    Args:
        start_ned_m, end_ned_m: where it begins and ends, (3,).
        start_tangent_m, end_tangent_m: tangents at the ends, (3,); their length is the curve's parameter
            speed.
        parameters: accelerations and vertical speeds.
        speed_m_s: along the curve.
        end_speed_m_s: speed at its end; 0: a stop.

    Attributes:
        length_m: of the curve.
    """

    def __init__(
        self,
        start_ned_m: Array,
        end_ned_m: Array,
        start_tangent_m: Array,
        end_tangent_m: Array,
        *,
        parameters: FlightParameters,
        speed_m_s: float,
        end_speed_m_s: float,
    ) -> None:
        self._start = np.array(start_ned_m, dtype=np.float64)
        self._end = np.array(end_ned_m, dtype=np.float64)
        tangents = np.array([start_tangent_m, end_tangent_m], dtype=np.float64)
        reach = float(np.linalg.norm(tangents.sum(axis=0)))
        longest = _LONGEST_TANGENTS * float(np.linalg.norm(self._end - self._start))
        if reach > longest:
            tangents *= longest / reach
        self._tangents = tangents
        self._u = np.linspace(0.0, 1.0, _SAMPLES)
        points = np.array([self._at(float(u), 0) for u in self._u])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        self._along_m = np.concatenate(([0.0], np.cumsum(steps)))
        self.length_m = float(self._along_m[-1])
        self._speeds = self._profile(parameters, speed_m_s, end_speed_m_s)

    def _at(self, u: float, derivative: int) -> Array:
        """Point of the curve, or its first or second derivative, at 0..1."""
        if derivative == 0:
            h = (2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2)
        elif derivative == 1:
            h = (6 * u**2 - 6 * u, 3 * u**2 - 4 * u + 1, -6 * u**2 + 6 * u, 3 * u**2 - 2 * u)
        else:
            h = (12 * u - 6, 6 * u - 4, -12 * u + 6, 6 * u - 2)
        point: Array = h[0] * self._start + h[1] * self._tangents[0] + h[2] * self._end
        return point + h[3] * self._tangents[1]

    def _profile(self, p: FlightParameters, speed_m_s: float, end_speed_m_s: float) -> Array:
        """Highest speed at each sample, m/s."""
        limits = np.full(_SAMPLES, speed_m_s)
        lateral = _LATERAL_SHARE * p.acceleration_m_s2
        tangential = (1.0 - _LATERAL_SHARE) * p.acceleration_m_s2 + 0.1 * p.acceleration_m_s2
        for k, u in enumerate(self._u):
            first, second = self._at(float(u), 1), self._at(float(u), 2)
            size = float(np.linalg.norm(first))
            if size < 1e-6:
                continue
            curvature = float(np.linalg.norm(np.cross(first, second))) / size**3
            if curvature > 1e-9:
                limits[k] = min(limits[k], math.sqrt(lateral / curvature))
            climb = -float(first[2]) / size
            if abs(climb) > 1e-3:
                vertical = p.climb_speed_m_s if climb > 0.0 else p.descend_speed_m_s
                limits[k] = min(limits[k], vertical / abs(climb))
        limits[-1] = min(limits[-1], end_speed_m_s)
        steps = np.diff(self._along_m)
        for k in range(_SAMPLES - 2, -1, -1):
            limits[k] = min(limits[k], math.sqrt(limits[k + 1] ** 2 + 2.0 * tangential * steps[k]))
        return limits

    @property
    def entry_speed_m_s(self) -> float:
        """Highest speed at which the curve may be entered."""
        return float(self._speeds[0])

    def speed_at(self, along_m: float) -> float:
        """Highest speed after a distance along the curve; a small speed at the end, so that the end is
        reached.
        """
        speed = float(np.interp(along_m, self._along_m, self._speeds))
        return max(speed, _SLOWEST_M_S) if along_m < self.length_m else speed

    def motion_at(self, along_m: float, speed_m_s: float) -> tuple[Array, Array, Array]:
        """(position m, velocity m/s, centripetal acceleration m/s^2) after a distance along the curve."""
        u = float(np.interp(along_m, self._along_m, self._u))
        first, second = self._at(u, 1), self._at(u, 2)
        size = float(np.linalg.norm(first))
        if size < 1e-6:
            return self._at(u, 0), np.zeros(3), np.zeros(3)
        tangent = first / size
        bend = (second - tangent * float(tangent @ second)) / size**2
        return self._at(u, 0), tangent * speed_m_s, bend * speed_m_s**2


class SplineFlight:
    """A moving point on a curve: its distance along the curve, and its speed.

    Attributes:
        along_m: distance along the curve.
        speed_m_s: along it.
    """

    def __init__(self, curve: SplineCurve, speed_m_s: float, parameters: FlightParameters) -> None:
        self.curve = curve
        self.along_m = 0.0
        self.speed_m_s = min(max(0.0, speed_m_s), curve.entry_speed_m_s)
        self._acceleration = (1.0 - _LATERAL_SHARE) * parameters.acceleration_m_s2

    @property
    def done(self) -> bool:
        """At the end of the curve."""
        return self.along_m >= self.curve.length_m

    def advance(self, dt_s: float) -> tuple[Array, Array, Array]:
        """Advance one tick; returns the motion there, as `SplineCurve.motion_at`."""
        limit = self.curve.speed_at(self.along_m)
        self.speed_m_s = min(limit, self.speed_m_s + self._acceleration * dt_s)
        self.along_m = min(self.curve.length_m, self.along_m + self.speed_m_s * dt_s)
        return self.curve.motion_at(self.along_m, self.speed_m_s)
