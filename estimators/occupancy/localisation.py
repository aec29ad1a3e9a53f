"""Place of a target from the readings of several passes.

A Gaussian's logarithm is a parabola: ln z = c - k (n^2 + e^2) + 2 k (n0 n + e0 e). Amplitude, width and
centre of a round Gaussian therefore come from one linear fit. A single straight pass does not determine the
centre's distance from the track, which the covariance of the fit shows.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# relative error of a reading, because a target is not exactly round, and the level is not exact
_SHAPE_ERROR: Final = 0.15
_LARGEST_SIGMA_M: Final = 60.0  # standard deviation of the centre; a fit with a larger one is not used
_LEAST_READINGS: Final = 6


def gaussian_centre(
    north_m: Array, east_m: Array, residual_nt: Array, *, noise_nt: float
) -> tuple[float, float] | None:
    """Centre of the round Gaussian that fits readings best, by weighted least squares of their logarithms.

    Args:
        north_m, east_m: (n,) positions of the readings.
        residual_nt: (n,) readings less map; those of the sign of the largest are used.
        noise_nt: standard deviation of one reading.

    Returns:
        (north m, east m); None when the readings do not determine it.
    """
    if len(residual_nt) == 0:
        return None
    sign = math.copysign(1.0, float(residual_nt[int(np.argmax(np.abs(residual_nt)))]))
    kept = sign * residual_nt > 2.0 * noise_nt
    if int(np.count_nonzero(kept)) < _LEAST_READINGS:
        return None
    size = sign * residual_nt[kept]
    middle_n, middle_e = (
        float(np.average(north_m[kept], weights=size)),
        float(np.average(east_m[kept], weights=size)),
    )
    scale_m = max(1.0, float(np.hypot(north_m[kept] - middle_n, east_m[kept] - middle_e).max()))
    north, east = (north_m[kept] - middle_n) / scale_m, (east_m[kept] - middle_e) / scale_m
    weight = 1.0 / np.hypot(noise_nt / size, _SHAPE_ERROR)
    design = np.column_stack((np.ones(len(size)), north, east, -(north**2 + east**2)))
    weighted = design * weight[:, None]
    normal = weighted.T @ weighted
    if not np.linalg.cond(normal) < 1e12:
        return None
    solution = np.linalg.solve(normal, weighted.T @ (weight * np.log(size)))
    curvature = float(solution[3])
    if not curvature > 0.0:
        return None
    centre_n, centre_e = float(solution[1]) / (2.0 * curvature), float(solution[2]) / (2.0 * curvature)
    # d(centre) = d(c) / 2k - centre dk / k; consecutive readings have the same error, so more of them do not
    # reduce it
    covariance = np.linalg.inv(normal) * len(size) / 4.0
    jacobian = np.array(
        [
            [0.0, 0.5 / curvature, 0.0, -centre_n / curvature],
            [0.0, 0.0, 0.5 / curvature, -centre_e / curvature],
        ]
    )
    spread_m = scale_m * math.sqrt(float(np.trace(jacobian @ covariance @ jacobian.T)))
    if not spread_m < _LARGEST_SIGMA_M:
        return None
    return middle_n + scale_m * centre_n, middle_e + scale_m * centre_e
