"""The likelihood of a camera's frame at places on the ground, with or without a detection.

Source: Tisdale et al. 2008, equations 3 to 7, corrected (docs/vision_search.md). The probability of a
detection at the image coordinates z, given the place x of the target, is

    p(D, z | x) = N(z; U(x), S) p(D, V | x) + P_false (1 - p(D, V | x)) / A

with the projection U, the image area A, and the covariance S of the detection: by first-order propagation of
the errors of pose and detector at z, or by its root (`Detection`). Kernels return it relative to what a
target far away would give: P_false / A with a detection and 1 - P_false without. So a frame changes a belief
only where its camera looks, and the likelihood without a detection is 1 - p(D, V | x).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.camera_sight import LEAST_HEIGHT_M, CameraSight, Detection, SightModel
from estimators.tracking.frame_kernels import (
    BORDER,
    BROWN,
    CONSTANT,
    DENSITY,
    EAST,
    FAR_SIGMAS,
    FAR_U,
    FAR_V,
    FOCAL,
    FOLD,
    HALF_HEIGHT,
    HALF_WIDTH,
    HEIGHT,
    LEAST_DEPTH,
    LINEAR,
    NOISE,
    NORTH,
    PEAK,
    PLACE,
    QUADRATIC,
    ROTATION,
    SIZE,
    TARGET_PX,
    TURN,
    likelihoods,
    of_place,
    of_turn,
)
from flightsim.foundation.kernels import kernel

__all__ = ["FrameLikelihood", "ground_spread", "image_spread"]

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]

_UPPER: Final = np.triu_indices(3)
_FOLD_STEP: Final = 1.02
_MOST_SPREAD: Final = 1e6  # variance of image coordinates from which a detection says nothing
_ROUNDING: Final = 1e-9
_WIDEST: Final = 10.0  # image coordinate of a border; a distortion without an inverse has no bound
_FARTHEST: Final = 3.0  # image radius up to which the distortion is examined
_LEAST_RATE: Final = 1e-4


@lru_cache(maxsize=64)
def _fold(distortion: tuple[float, ...]) -> float:
    """Squared radius up to which the radial distortion grows."""
    k1, k2, _, _, k3 = distortion
    radius = 0.1
    while radius < _FARTHEST:
        q = radius * radius
        if 1.0 + q * (3.0 * k1 + q * (5.0 * k2 + q * 7.0 * k3)) <= 0.05:
            break
        radius *= _FOLD_STEP
    return radius * radius


@kernel
def _on_ground(a: float, b: float, aa: float, ab: float, bb: float, s: Array) -> tuple[float, float, float]:
    """Covariance (north north, north east, east east) of the place on the ground that a ray (a, b) meets, by
    that of its image coordinates.
    """
    k = ROTATION
    depth = s[HEIGHT] / (s[k + 2] + a * s[k + 5] + b * s[k + 8])
    an, ae = (s[k + 3] - a * s[k]) / depth, (s[k + 4] - a * s[k + 1]) / depth
    bn, be = (s[k + 6] - b * s[k]) / depth, (s[k + 7] - b * s[k + 1]) / depth
    scale = 1.0 / (an * be - ae * bn) ** 2
    nn = scale * (be * be * aa - 2.0 * be * ae * ab + ae * ae * bb)
    ne = scale * (be * an * ab + ae * bn * ab - be * bn * aa - ae * an * bb)
    return nn, ne, scale * (bn * bn * aa - 2.0 * bn * an * ab + an * an * bb)


@kernel
def _detected_places(s: Array, detections: Array, out: Array) -> int:
    """Gaussians on the ground of the detections; returns the number of those that lie on it.

    Args:
        s: numbers of the frame.
        detections: (m, 6), as in `Detection`, and the density at its place.
        out: (m, 5), gets north, east, and the covariance nn, ne, ee of each.
    """
    k, found = ROTATION, 0
    for a, b, first, cross, last, _ in detections:
        if not first * last > 0.0:
            continue
        down = s[k + 2] + a * s[k + 5] + b * s[k + 8]
        if not down > LEAST_DEPTH:
            continue
        depth = s[HEIGHT] / down
        bb = 1.0 / (last * last)  # the inverse of the information
        ab = -cross / first * bb
        aa = (1.0 + (cross / last) ** 2) / (first * first)
        out[found, 0] = s[NORTH] + depth * (s[k] + a * s[k + 3] + b * s[k + 6])
        out[found, 1] = s[EAST] + depth * (s[k + 1] + a * s[k + 4] + b * s[k + 7])
        out[found, 2:] = _on_ground(a, b, aa, ab, bb, s)
        found += 1
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameLikelihood:
    """The likelihood of one frame, ready for the kernels.

    Attributes:
        numbers: what the kernels read of the frame and of the team's model.
        detections: (m, 6), as in `Detection`, and the density at its place.
        box: south, west, north, east; outside the relative likelihood is 1. None: it is 1 everywhere.
    """

    numbers: Array
    detections: Array
    box: Box | None

    @classmethod
    def of(cls, sight: CameraSight, model: SightModel, reach_m: float) -> "FrameLikelihood":
        """The likelihood of a frame.

        Args:
            sight: the frame.
            model: what the team knows about detector and target.
            reach_m: largest distance on the ground that matters, for a camera that sees the horizon.
        """
        s = _numbers(sight, model)
        box = None
        if sight.height_m > 0.0:
            box = _box(sight, model, s, reach_m)
        return cls(numbers=s, detections=_gaussians(sight, s), box=box)

    def at(self, north_m: Array, east_m: Array) -> Array:
        """Relative likelihoods at places (n,)."""
        north, east = (np.ascontiguousarray(values, dtype=np.float64) for values in (north_m, east_m))
        out = np.ones(north.size)
        if self.box is not None:
            likelihoods(north, east, self.numbers, self.detections, out)
        return out

    def places(self) -> Array:
        """(m, 5) Gaussians of the detections on the ground: north, east, covariance nn, ne, ee."""
        out = np.empty((len(self.detections), 5))
        return out[: _detected_places(self.numbers, self.detections, out)]


def _numbers(sight: CameraSight, model: SightModel) -> Array:
    s = np.zeros(SIZE)
    rotation = sight.r_mount_from_ned
    s[NORTH], s[EAST], s[HEIGHT] = sight.place_ned_m[0], sight.place_ned_m[1], sight.height_m
    s[ROTATION : ROTATION + 9] = rotation.ravel()
    s[PLACE : PLACE + 6] = (rotation @ sight.place_m2 @ rotation.T)[_UPPER]
    s[TURN : TURN + 6] = sight.rotation_rad2[_UPPER]
    s[FOCAL] = sight.focal_px
    s[HALF_WIDTH], s[HALF_HEIGHT] = 0.5 * sight.width_px, 0.5 * sight.height_px
    s[BROWN : BROWN + 5] = sight.distortion
    s[FOLD] = _fold(sight.distortion)
    s[TARGET_PX] = model.target_size_m * sight.focal_px * math.sqrt(max(0.0, sight.height_m))
    s[BORDER] = model.border_sides
    rate = model.rate
    s[PEAK], s[CONSTANT], s[LINEAR], s[QUADRATIC] = rate.peak, rate.constant, rate.linear, rate.quadratic
    s[NOISE] = (model.pixel_sigma_px / sight.focal_px) ** 2
    s[DENSITY] = sight.width_px * sight.height_px / sight.focal_px**2 / model.false_rate
    s[FAR_U] = s[FAR_V] = math.inf
    return s


def image_spread(ray: tuple[float, float], sight: CameraSight, model: SightModel) -> Array:
    """(2, 2) covariance of the image coordinates of a place that is seen at (a, b), by the pose alone."""
    aa, ab, bb = _pose_spread(*ray, _numbers(sight, model))
    return np.array([[aa, ab], [ab, bb]])


@kernel
def _pose_spread(a: float, b: float, s: Array) -> tuple[float, float, float]:
    """Covariance (aa, ab, bb) of the image coordinates of a place that is seen at (a, b), by the pose."""
    down = s[ROTATION + 2] + a * s[ROTATION + 5] + b * s[ROTATION + 8]
    place, turn = of_place(a, b, down / s[HEIGHT], s), of_turn(a, b, s)
    return place[0] + turn[0], place[1] + turn[1], place[2] + turn[2]


def ground_spread(ray: tuple[float, float], sight: CameraSight, model: SightModel) -> Array:
    """(2, 2) covariance, north and east, of the place on the ground that a ray (a, b) meets. An error budget
    (Table II) is this for one error at a time.
    """
    (aa, ab), (_, bb) = image_spread(ray, sight, model).tolist()
    nn, ne, ee = _on_ground(*ray, aa, ab, bb, _numbers(sight, model))
    return np.array([[nn, ne], [ne, ee]])


def _gaussians(sight: CameraSight, s: Array) -> Array:
    """(m, 6) of the detections. The density is that of a detection alone, also where it repeats earlier ones
    and its root is small: so much more probable is it than a false one.
    """
    rows, noise = [], float(s[NOISE])
    for k, (a, b) in enumerate(sight.detections.tolist()):
        aa, ab, bb = _pose_spread(a, b, s) if sight.height_m > LEAST_HEIGHT_M else (math.inf,) * 3
        aa, bb = max(0.0, aa) + noise, max(0.0, bb) + noise
        if not max(aa, bb) < _MOST_SPREAD:
            rows.append([a, b, 0.0, 0.0, 0.0, 0.0])
            continue
        most = (1.0 - _ROUNDING) * math.sqrt(aa * bb)  # covariances of single-precision numbers
        alone = Detection.of_covariance(a, b, aa, min(max(ab, -most), most), bb)
        root = alone[2:] if sight.roots is None else sight.roots[k].tolist()
        rows.append([a, b, *root, alone.first * alone.last / math.tau])
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def _box(sight: CameraSight, model: SightModel, s: Array, reach_m: float) -> Box:
    """The box; sets the distances in `s` at which a border does not matter."""
    border, slope = _border_of(sight.width_px, sight.height_px, sight.focal_px, sight.distortion)
    bounds, wide, tall = border, math.inf, math.inf
    for _ in range(3):  # the errors are larger outside of the picture than in it
        wide, tall = _largest_sigmas(*bounds, s)
        if math.isinf(wide):
            break
        more_a, more_b = FAR_SIGMAS / slope * wide, FAR_SIGMAS / slope * tall
        bounds = border[0] - more_a, border[1] - more_b, border[2] + more_a, border[3] + more_b
    north, east, height_m = *sight.place_ned_m[:2], sight.height_m
    xn, xe, xd, yn, ye, yd, zn, ze, zd = s[ROTATION : ROTATION + 9].tolist()
    corners = [
        (xn + a * yn + b * zn, xe + a * ye + b * ze, xd + a * yd + b * zd)
        for a in bounds[::2]
        for b in bounds[1::2]
    ]
    if math.isfinite(wide) and min(down for _, _, down in corners) * reach_m > height_m:
        s[FAR_U], s[FAR_V] = FAR_SIGMAS * sight.focal_px * wide, FAR_SIGMAS * sight.focal_px * tall
        norths = [north + n * height_m / down for n, _, down in corners]
        easts = [east + e * height_m / down for _, e, down in corners]
        return min(norths), min(easts), max(norths), max(easts)
    reach_m = min(reach_m, _reach(sight, model))
    return north - reach_m, east - reach_m, north + reach_m, east + reach_m


@kernel
def _largest_sigmas(a0: float, b0: float, a1: float, b1: float, s: Array) -> tuple[float, float]:
    """Largest standard deviations of image coordinates in a rectangle of rays; infinity: it has the
    horizon.
    """
    wide, tall = 0.0, 0.0
    k = ROTATION
    for i in range(3):
        a = a0 + 0.5 * i * (a1 - a0)
        for j in range(3):
            b = b0 + 0.5 * j * (b1 - b0)
            down = s[k + 2] + a * s[k + 5] + b * s[k + 8]
            if not down > LEAST_DEPTH:
                return math.inf, math.inf
            paa, _, pbb = of_place(a, b, down / s[HEIGHT], s)
            taa, _, tbb = of_turn(a, b, s)
            wide = max(wide, math.sqrt(max(0.0, paa + taa) + s[NOISE]))
            tall = max(tall, math.sqrt(max(0.0, pbb + tbb) + s[NOISE]))
    return wide, tall


@lru_cache(maxsize=64)
def _border_of(
    width_px: int, height_px: int, focal_px: float, distortion: tuple[float, ...]
) -> tuple[tuple[float, float, float, float], float]:
    """Least a and b, largest a and b of the rays that a picture's border shows (by fixed-point iteration),
    and
    the least growth of the distorted radius in it: errors are computed without distortion.
    """
    along = np.linspace(-1.0, 1.0, 9)
    edge = np.concatenate([np.column_stack((along, np.full(9, k))) for k in (-1.0, 1.0)])
    seen = np.vstack((edge, edge[:, ::-1])) * (0.5 * width_px, 0.5 * height_px) / focal_px
    k1, k2, p1, p2, k3 = distortion
    fold = _fold(distortion)
    rays = seen.copy()
    for _ in range(20):
        a, b = rays.T
        q = np.minimum(a * a + b * b, fold)
        radial = 1.0 + q * (k1 + q * (k2 + q * k3))
        tangential = np.column_stack(
            (2.0 * p1 * a * b + p2 * (q + 2.0 * a * a), p1 * (q + 2.0 * b * b) + 2.0 * p2 * a * b)
        )
        rays = np.clip((seen - tangential) / radial[:, None], -_WIDEST, _WIDEST)
    low, high = rays.min(axis=0), rays.max(axis=0)
    q = np.linspace(0.0, float((rays**2).sum(axis=1).max()), 16)
    slope = float(np.clip((1.0 + q * (3.0 * k1 + q * (5.0 * k2 + q * 7.0 * k3))).min(), 0.2, 1.0))
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1])), slope


def _reach(sight: CameraSight, model: SightModel) -> float:
    """Distance on the ground from which on the resolution is too low for a detection; infinity: none is."""
    resolution_px = np.geomspace(0.01, 1e4, 400)
    enough = model.rate.probability(resolution_px) > _LEAST_RATE
    if enough[0]:
        return math.inf
    least_px = float(resolution_px[int(np.argmax(enough))]) if enough.any() else math.inf
    # at the border of the picture the depth is less than the distance by this factor at most
    widest = 1.0 + math.hypot(sight.width_px, sight.height_px) / sight.focal_px
    depth = (model.target_size_m * sight.focal_px / least_px) ** (2.0 / 3.0) * sight.height_m ** (1.0 / 3.0)
    return max(sight.height_m, widest * depth)
