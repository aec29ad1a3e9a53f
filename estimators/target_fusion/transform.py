"""The target's place from a drone's detection, and the fusion over the team, as compiled kernels.

Source: Steckenrider, Leamy, Furukawa 2020 (SSRR), equations 31 to 35. The live estimator and the Monte Carlo
study use them.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

# Gaussian belief in information form: inverse covariance (xx, xy, yy) and inverse covariance times mean
I_XX: Final = 0
I_XY: Final = 1
I_YY: Final = 2
I_X: Final = 3
I_Y: Final = 4
INFORMATION: Final = 5


@kernel
def ground_target(
    x: float,
    y: float,
    p_xx: float,
    p_xy: float,
    p_yy: float,
    heading_rad: float,
    heading_variance: float,
    seen: Array,
    seen_covariance: Array,
    out: Array,
) -> None:
    """Transform a target seen from a drone to the ground frame, with its covariance (equations 31 to 34).

    Args:
        x, y, p_xx, p_xy, p_yy: the drone's place and its covariance.
        heading_rad, heading_variance: heading of the frame of `seen`, from the x axis towards y.
        seen, seen_covariance: (2,), (2, 2): forward, and sideways in the direction of y.
        out: (5,), overwritten: x, y, then the covariance xx, xy, yy.
    """
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    forward, side = seen[0], seen[1]
    out[0] = x + c * forward - s * side
    out[1] = y + s * forward + c * side
    a, b, d = seen_covariance[0, 0], seen_covariance[0, 1], seen_covariance[1, 1]
    jx, jy = -s * forward - c * side, c * forward - s * side
    out[2] = p_xx + c * c * a - 2.0 * c * s * b + s * s * d + heading_variance * jx * jx
    out[3] = p_xy + c * s * (a - d) + (c * c - s * s) * b + heading_variance * jx * jy
    out[4] = p_yy + s * s * a + 2.0 * c * s * b + c * c * d + heading_variance * jy * jy


@kernel
def add_information(belief: Array, information: Array) -> bool:
    """Multiply a Gaussian (x, y, xx, xy, yy) into a belief in information form (equations 10, 35).

    Returns:
        False for a covariance that is singular or not finite; the belief is then unchanged.
    """
    xx, xy, yy = belief[2], belief[3], belief[4]
    determinant = xx * yy - xy * xy
    if not (determinant > 0.0 and math.isfinite(determinant)):
        return False
    i_xx, i_xy, i_yy = yy / determinant, -xy / determinant, xx / determinant
    information[I_XX] += i_xx
    information[I_XY] += i_xy
    information[I_YY] += i_yy
    information[I_X] += i_xx * belief[0] + i_xy * belief[1]
    information[I_Y] += i_xy * belief[0] + i_yy * belief[1]
    return True


@kernel
def belief_of(information: Array, out: Array) -> bool:
    """Mean and covariance (x, y, xx, xy, yy) of a belief in information form; False if it has none."""
    xx, xy, yy = information[I_XX], information[I_XY], information[I_YY]
    determinant = xx * yy - xy * xy
    if not (determinant > 0.0 and math.isfinite(determinant)):
        return False
    out[2], out[3], out[4] = yy / determinant, -xy / determinant, xx / determinant
    out[0] = out[2] * information[I_X] + out[3] * information[I_Y]
    out[1] = out[3] * information[I_X] + out[4] * information[I_Y]
    return True
