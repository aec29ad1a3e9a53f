"""A sensor of range and bearing in the plane, whose probability of detection falls with distance.

Source: Yousuf, Lendek and Busoniu, section 2.2, with the corrections of docs/multi_target.md: two standard
deviations, atan2, wrapped differences of bearings.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots
from flightsim.foundation.options import Options

__all__ = ["RangeBearingSensor", "Viewpoint", "detection_probabilities"]

Array = NDArray[np.float64]

_CLUTTER_FLOOR: Final = 1e-9  # false detections per metre and radian: a scan can't be impossible

_slots = Slots()
GAIN: Final = _slots.place()
FORWARD: Final = _slots.place()
RIGHT: Final = _slots.place()
REACH: Final = _slots.place()
RANGE_SIGMA: Final = _slots.place()
BEARING_SIGMA: Final = _slots.place()
SENSOR_SIZE: Final = _slots.size


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """Place and heading from which a scan is taken: metres north and east, clockwise from north."""

    north_m: float
    east_m: float
    heading_rad: float = 0.0

    @property
    def values(self) -> Array:
        """(3,) for kernels."""
        return np.array([self.north_m, self.east_m, self.heading_rad])


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeBearingSensor(Options):
    """What is known about the sensor.

    A target at the offset (f, r), forward and right of the vehicle, is detected with the probability
    gain exp(-|zeta| / 2), zeta = (f / forward_scale_m, r / right_scale_m); the paper's G, F_X and F_Y.

    Attributes:
        gain: probability to detect a target directly below.
        forward_scale_m, right_scale_m: scales of the fall with distance.
        reach_m: radius of the field of view.
        range_sigma_m, bearing_sigma_rad: standard deviations of a measurement, with the errors of the
            vehicle's own place and heading.
        clutter_per_scan: mean number of false detections, uniform over the field of view.
    """

    gain: float = 0.98
    forward_scale_m: Positive = 15.0
    right_scale_m: Positive = 15.0
    reach_m: Positive = 100.0
    range_sigma_m: Positive = 0.6
    bearing_sigma_rad: Positive = 0.035
    clutter_per_scan: NotNegative = 0.0

    def check_together(self) -> None:
        if not 0.0 < self.gain <= 1.0:
            raise ValueError(f"gain {self.gain:g} is not in 0..1, or is 0")

    @property
    def values(self) -> Array:
        """(`SENSOR_SIZE`,) for kernels."""
        return np.array(
            [
                *(self.gain, self.forward_scale_m, self.right_scale_m, self.reach_m),
                *(self.range_sigma_m, self.bearing_sigma_rad),
            ]
        )

    def probability(self, north_m: Array, east_m: Array, viewpoint: Viewpoint) -> Array:
        """Probability to detect a target at each place."""
        n, e = np.broadcast_arrays(north_m, east_m)
        found = np.empty(n.size)
        detection_probabilities(
            np.ascontiguousarray(n, dtype=np.float64).ravel(),
            np.ascontiguousarray(e, dtype=np.float64).ravel(),
            self.values,
            viewpoint.values,
            found,
        )
        return found.reshape(n.shape)

    def clutter_density(self, range_m: Array) -> Array:
        """Density of false detections at each range, per metre and radian. Over the disc of the field of view
        they are uniform, so the density grows with the range.
        """
        density: Array = self.clutter_per_scan * range_m / (math.pi * self.reach_m**2)
        return np.maximum(density, _CLUTTER_FLOOR)

    def places(self, scan: Array, viewpoint: Viewpoint) -> Array:
        """North and east of each measurement, (m, 2), without noise: the inverse of the measurement.

        Args:
            scan: (m, 2) range and bearing from the nose.
            viewpoint: of the scan.
        """
        bearing = scan[:, 1] + viewpoint.heading_rad
        return np.column_stack(
            (
                viewpoint.north_m + scan[:, 0] * np.cos(bearing),
                viewpoint.east_m + scan[:, 0] * np.sin(bearing),
            )
        )

    def covariances(self, scan: Array, viewpoint: Viewpoint) -> Array:
        """Covariance of each place, (m, 2, 2) north and east: across the line of sight the bearing's noise
        times the range.
        """
        bearing = scan[:, 1] + viewpoint.heading_rad
        along = self.range_sigma_m**2
        across = (self.bearing_sigma_rad * scan[:, 0]) ** 2
        c, s = np.cos(bearing), np.sin(bearing)
        found = np.empty((len(scan), 2, 2))
        found[:, 0, 0] = along * c * c + across * s * s
        found[:, 1, 1] = along * s * s + across * c * c
        found[:, 0, 1] = found[:, 1, 0] = (along - across) * s * c
        return found


@kernel
def detection_probabilities(
    north_m: Array, east_m: Array, sensor: Array, viewpoint: Array, found: Array
) -> None:
    """Write the probability to detect a target at each of n places into `found`, (n,)."""
    gain, inverse_f, inverse_r = sensor[GAIN], 1.0 / sensor[FORWARD], 1.0 / sensor[RIGHT]
    reach_squared = sensor[REACH] * sensor[REACH]
    cosine, sine = math.cos(viewpoint[2]), math.sin(viewpoint[2])
    for i in range(north_m.size):
        n, e = north_m[i] - viewpoint[0], east_m[i] - viewpoint[1]
        forward, right = (cosine * n + sine * e) * inverse_f, (cosine * e - sine * n) * inverse_r
        inside = n * n + e * e <= reach_squared
        found[i] = gain * math.exp(-0.5 * math.sqrt(forward * forward + right * right)) if inside else 0.0
