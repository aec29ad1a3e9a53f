"""Decides whether the readings of a pass show a target or only the error of the map they are compared with.

A published map has an error that is the same on every pass: stripes along the survey lines, and the
interpolation between them. It is correlated over about half the distance of the lines, which is as wide as a
target. Single readings beyond a threshold are therefore weak evidence, however many there are. A target adds
a bump to the readings. Its amplitude is estimated from all readings of the pass by generalised least squares,
with the covariance of map error, noise and an unknown level; amplitude over its standard deviation is the
signal-to-noise ratio of the matched filter (Kay, Fundamentals of Statistical Signal Processing II, section
4.4). The result is the largest ratio over places and widths of the bump.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_RATIO: Final = 4.0
"""Smallest signal-to-noise ratio of an anomaly; the bank of bumps has about 150 templates, some of them
similar.
"""

_WIDTHS_M: Final = (
    90.0,
    130.0,
    180.0,
)  # bumps (1 + r^2 / w^2)^(-5/2): a dipole's decay, or a Gaussian of w / sqrt(5)
_OFFSETS_M: Final = np.linspace(-120.0, 120.0, 7)
_UNKNOWN_LEVEL: Final = 10.0  # standard deviation of the level, in multiples of a reading's error


def signal_to_noise(
    north_m: Array,
    east_m: Array,
    difference_nt: Array,
    *,
    noise_nt: float,
    map_error_nt: float,
    correlation_m: float,
) -> float:
    """Largest signal-to-noise ratio of a bump in the readings of a pass.

    Args:
        north_m, east_m: (n,) places of the readings, some 10 m apart.
        difference_nt: (n,) readings minus map, with any level.
        noise_nt: standard deviation of a reading, white.
        map_error_nt: standard deviation of the map.
        correlation_m: correlation distance of the map's error (exponential).
    """
    apart_m = np.hypot(north_m[:, None] - north_m, east_m[:, None] - east_m)
    level_nt = _UNKNOWN_LEVEL * np.hypot(noise_nt, map_error_nt)
    covariance = map_error_nt**2 * np.exp(-apart_m / correlation_m) + level_nt**2
    covariance[np.diag_indices_from(covariance)] += noise_nt**2
    peak = int(np.argmax(np.abs(difference_nt - np.median(difference_nt))))
    offset_n_m, offset_e_m = (offsets.ravel() for offsets in np.meshgrid(_OFFSETS_M, _OFFSETS_M))
    distance2 = (north_m[:, None] - north_m[peak] - offset_n_m) ** 2 + (
        east_m[:, None] - east_m[peak] - offset_e_m
    ) ** 2
    bumps = np.concatenate([(1.0 + distance2 / width_m**2) ** -2.5 for width_m in _WIDTHS_M], axis=1)
    root = np.linalg.cholesky(covariance)
    white = np.linalg.solve(root, np.column_stack((difference_nt - difference_nt.mean(), bumps)))
    return float(np.max(np.abs(white[:, 0] @ white[:, 1:]) / np.linalg.norm(white[:, 1:], axis=0)))
