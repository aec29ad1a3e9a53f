"""Kernels of the likelihood of a camera's frame (`camera_likelihood` has its equations).

Places are projected in blocks, by loops with few arrays and no branch: the compiler makes instructions of
them that compute several numbers at once. An exponential and the border are left for each place alone.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

NORTH: Final = 0
EAST: Final = 1
HEIGHT: Final = 2
ROTATION: Final = 3  # 9 numbers, rows of r_mount_from_ned
PLACE: Final = 12  # 6 numbers, covariance of the place in camera axes: xx, xy, xz, yy, yz, zz
TURN: Final = 18  # 6 numbers, covariance of the rotation
FOCAL: Final = 24
HALF_WIDTH: Final = 25
HALF_HEIGHT: Final = 26
BROWN: Final = 27  # 5 numbers
FOLD: Final = 32  # squared radius up to which the distortion is monotonic
TARGET_PX: Final = 33  # resolution times sqrt(depth^3)
BORDER: Final = 34
PEAK: Final = 35
CONSTANT: Final = 36
LINEAR: Final = 37
QUADRATIC: Final = 38
NOISE: Final = 39  # variance of a detection's place in image coordinates
DENSITY: Final = 40  # A / P_false
FAR_U: Final = 41  # pixels; a border farther away does not matter
FAR_V: Final = 42
SIZE: Final = 43


FAR_SIGMAS: Final = 4.5
"""A border that is so far away does not matter (3e-6)."""
LEAST_DEPTH: Final = 1e-3
"""Of a place in view, as a share of the height."""
_STEPS_PER_SIGMA: Final = 256
_NORMAL: Final = ndtr(
    np.arange(-FAR_SIGMAS * _STEPS_PER_SIGMA, FAR_SIGMAS * _STEPS_PER_SIGMA + 2) / _STEPS_PER_SIGMA
)
_GATE: Final = 60.0  # squared distance; beyond it a likelihood is below 1e-13 of its peak
_MOST: Final = 700.0  # of an exponent
_BLOCK: Final = 128  # places; what is computed of them stays in the processor's first cache
_ROWS: Final = 13


@kernel
def of_place(a: float, b: float, inverse_depth: float, s: Array) -> tuple[float, float, float]:
    """Covariance of the image coordinates (aa, ab, bb) by the errors of the place, which enter by H / depth
    with H = [[-a, 1, 0], [-b, 0, 1]]: one half of S of equation 4, first order.
    """
    k = PLACE
    w = inverse_depth * inverse_depth
    aa = w * (a * (a * s[k] - 2.0 * s[k + 1]) + s[k + 3])
    ab = w * (a * (b * s[k] - s[k + 2]) - b * s[k + 1] + s[k + 4])
    bb = w * (b * (b * s[k] - 2.0 * s[k + 2]) + s[k + 5])
    return aa, ab, bb


@kernel
def of_turn(a: float, b: float, s: Array) -> tuple[float, float, float]:
    """The same by the errors of the attitude: rotations enter by H [q]x with q = (1, a, b), whose rows are
    (b, ab, -1 - a^2) and (-a, 1 + b^2, -ab).
    """
    k = TURN
    cross = a * b
    p, r = -1.0 - a * a, 1.0 + b * b
    x = b * s[k] + cross * s[k + 1] + p * s[k + 2]
    y = b * s[k + 1] + cross * s[k + 3] + p * s[k + 4]
    z = b * s[k + 2] + cross * s[k + 4] + p * s[k + 5]
    aa = b * x + cross * y + p * z
    ab = -a * x + r * y - cross * z
    x = r * s[k + 1] - a * s[k] - cross * s[k + 2]
    y = r * s[k + 3] - a * s[k + 1] - cross * s[k + 4]
    z = r * s[k + 4] - a * s[k + 2] - cross * s[k + 5]
    return aa, ab, -a * x + r * y - cross * z


@kernel
def _above(value: float, sigma: float) -> float:
    """Probability that a Gaussian about a value is above 0: one of equation 5's steps, smoothed; to 1e-6 by a
    table, which takes a fifth of the time of the error function.
    """
    if value >= FAR_SIGMAS * sigma:
        return 1.0
    if value <= -FAR_SIGMAS * sigma:
        return 0.0
    at = (value / sigma + FAR_SIGMAS) * _STEPS_PER_SIGMA
    k = int(at)
    return _NORMAL[k] + (at - k) * (_NORMAL[k + 1] - _NORMAL[k])


@kernel
def _within(value: float, half: float, sigma: float) -> float:
    """Probability that a Gaussian about a value lies within -half..half."""
    return max(0.0, _above(half - value, sigma) + _above(half + value, sigma) - 1.0)


@kernel
def _project(
    north: Array, east: Array, s: Array, depth: Array, inverse: Array, a: Array, b: Array, u: Array, v: Array
) -> None:
    """Depth and its inverse, image coordinates, and pixels from the middle, of places."""
    n0, e0, h, focal = s[NORTH], s[EAST], s[HEIGHT], s[FOCAL]
    xn, xe, xd = s[ROTATION], s[ROTATION + 1], s[ROTATION + 2]
    yn, ye, yd = s[ROTATION + 3], s[ROTATION + 4], s[ROTATION + 5]
    zn, ze, zd = s[ROTATION + 6], s[ROTATION + 7], s[ROTATION + 8]
    k1, k2, p1, p2, k3 = s[BROWN], s[BROWN + 1], s[BROWN + 2], s[BROWN + 3], s[BROWN + 4]
    fold = s[FOLD]
    for i in range(north.size):
        depth[i] = xn * (north[i] - n0) + xe * (east[i] - e0) + xd * h
    for i in range(north.size):
        inverse[i] = np.divide(1.0, depth[i])  # without a check for 0
    for i in range(north.size):
        a[i] = (yn * (north[i] - n0) + ye * (east[i] - e0) + yd * h) * inverse[i]
    for i in range(north.size):
        b[i] = (zn * (north[i] - n0) + ze * (east[i] - e0) + zd * h) * inverse[i]
    for i in range(north.size):  # Brown's distortion
        q = a[i] * a[i] + b[i] * b[i]
        near = q if q < fold else fold
        radial = 1.0 + near * (k1 + near * (k2 + near * k3))
        u[i] = focal * (a[i] * radial + 2.0 * p1 * a[i] * b[i] + p2 * (q + 2.0 * a[i] * a[i]))
    for i in range(north.size):
        q = a[i] * a[i] + b[i] * b[i]
        near = q if q < fold else fold
        radial = 1.0 + near * (k1 + near * (k2 + near * k3))
        v[i] = focal * (b[i] * radial + p1 * (q + 2.0 * b[i] * b[i]) + 2.0 * p2 * a[i] * b[i])


@kernel
def _measure(
    inverse: Array,
    u: Array,
    v: Array,
    s: Array,
    half_u: Array,
    half_v: Array,
    inside: Array,
    outside: Array,
    exponent: Array,
) -> None:
    """Half the picture's size for a whole target, by how much places are surely inside of it and surely
    outside, and the exponent of the probability of detection.
    """
    target_px, border = s[TARGET_PX], s[BORDER]
    half_width, half_height, far_u, far_v = s[HALF_WIDTH], s[HALF_HEIGHT], s[FAR_U], s[FAR_V]
    constant, linear, quadratic = s[CONSTANT], s[LINEAR], s[QUADRATIC]
    for i in range(inverse.size):
        exponent[i] = target_px * inverse[i] * np.sqrt(inverse[i])  # first the resolution
    for i in range(inverse.size):
        half_u[i] = half_width - border * exponent[i]
        half_v[i] = half_height - border * exponent[i]
    for i in range(inverse.size):
        by_u, by_v = half_u[i] - abs(u[i]) - far_u, half_v[i] - abs(v[i]) - far_v
        inside[i] = by_u if by_u < by_v else by_v
    for i in range(inverse.size):
        by_u, by_v = abs(u[i]) - half_u[i] - far_u, abs(v[i]) - half_v[i] - far_v
        outside[i] = by_u if by_u > by_v else by_v
    for i in range(inverse.size):
        odds = constant + exponent[i] * (linear + exponent[i] * quadratic)
        odds = odds if odds > -_MOST else -_MOST
        exponent[i] = -(odds if odds < _MOST else _MOST)


@kernel
def _smooth(a: Array, b: Array, inverse: Array, s: Array, sigma_u: Array, sigma_v: Array) -> None:
    """Standard deviations of the pixels of places."""
    focal, noise = s[FOCAL], s[NOISE]
    for i in range(a.size):
        place, turn = of_place(a[i], b[i], inverse[i], s), of_turn(a[i], b[i], s)
        sigma_u[i] = focal * np.sqrt(max(0.0, place[0] + turn[0]) + noise)
        sigma_v[i] = focal * np.sqrt(max(0.0, place[2] + turn[2]) + noise)


@kernel
def _density(a: float, b: float, detections: Array) -> float:
    """Mean density of detections for a target whose image coordinates are a and b."""
    density = 0.0
    for k in range(detections.shape[0]):
        first, cross, last = detections[k, 2], detections[k, 3], detections[k, 4]
        da, db = a - detections[k, 0], b - detections[k, 1]
        one, other = first * da + cross * db, last * db
        distance = one * one + other * other
        if distance < _GATE:
            density += detections[k, 5] * math.exp(-0.5 * distance)
    return density / detections.shape[0]


@kernel
def _needs_smoothing(depth: Array, outside: Array, inside: Array, least_depth: float) -> bool:
    """Whether there are places whose likelihood depends on the errors of the pose."""
    for i in range(depth.size):
        if depth[i] > least_depth and not outside[i] > 0.0 and not inside[i] > 0.0:
            return True
    return False


@kernel
def likelihoods(north: Array, east: Array, s: Array, detections: Array, out: Array) -> None:
    """Likelihoods (n,) of a frame for a target at places (n,), relative to one far away.

    Args:
        north, east: (n,) places.
        s: numbers of the frame and of the team's model.
        detections: (m, 6) rows of `camera_sight.Detection`, and the density at its place.
        out: (n,), gets the likelihoods.
    """
    least_depth, peak, detected = LEAST_DEPTH * s[HEIGHT], s[PEAK], detections.shape[0] > 0
    rows = np.empty((_ROWS, _BLOCK))
    for first in range(0, north.size, _BLOCK):
        part = slice(first, min(first + _BLOCK, north.size))
        count = part.stop - first
        depth, inverse, a, b = rows[0, :count], rows[1, :count], rows[2, :count], rows[3, :count]
        u, v, half_u, half_v = rows[4, :count], rows[5, :count], rows[6, :count], rows[7, :count]
        inside, outside, exponent = rows[8, :count], rows[9, :count], rows[10, :count]
        sigma_u, sigma_v = rows[11, :count], rows[12, :count]
        _project(north[part], east[part], s, depth, inverse, a, b, u, v)
        _measure(inverse, u, v, s, half_u, half_v, inside, outside, exponent)
        if _needs_smoothing(depth, outside, inside, least_depth):
            _smooth(a, b, inverse, s, sigma_u, sigma_v)
        for i in range(count):
            if not depth[i] > least_depth or outside[i] > 0.0 or half_u[i] <= 0.0 or half_v[i] <= 0.0:
                out[first + i] = 1.0
                continue
            seen = peak
            if not inside[i] > 0.0:
                seen *= _within(u[i], half_u[i], sigma_u[i]) * _within(v[i], half_v[i], sigma_v[i])
            seen /= 1.0 + math.exp(exponent[i])
            out[first + i] = 1.0 - seen
            if detected:
                out[first + i] += seen * _density(a[i], b[i], detections) * s[DENSITY]
