"""Speed along a path: as fast as commanded, as slow as curvature requires, and smooth in time.

Between two stops, the speed limit follows from curvature and yaw rate, and a forward and a backward pass
apply the tangential acceleration (Bobrow, Dubowsky, Gibson 1985, for a point mass). Then the distance flown,
as a function of time, is averaged over a triangular window, which bounds jerk and makes starts and stops
smooth. Averaging shifts speed along the path, so the result is checked, and the limits are lowered where they
were exceeded.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.patterns.curve import Array
from missions.vehicle.limits import MulticopterLimits

STEP_S: Final = 0.02
_GRID_M: Final = 0.1
_CORRECTIONS: Final = 6
_SLOWEST_M_S: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Distance, speed and tangential acceleration every `STEP_S`, from rest to rest."""

    arc_m: Array
    speed_m_s: Array
    acceleration_m_s2: Array


def speed_profile(
    arc_m: Array, curvature_per_m: Array, speed_m_s: float, limits: MulticopterLimits
) -> Profile:
    """Profile along a path without stops.

    Args:
        arc_m: distances (n,) at which curvature is given, increasing.
        curvature_per_m: curvature (n,).
        speed_m_s: commanded speed.
        limits: limits of the vehicle.
    """
    start, stop = float(arc_m[0]), float(arc_m[-1])
    count = max(16, int(np.ceil((stop - start) / _GRID_M)))
    even = np.linspace(start, stop, count + 1)
    grid = np.union1d(even, arc_m)  # in bends the knots are closer together
    grid = grid[np.concatenate(([True], np.diff(grid) > 1e-7))]
    bend = np.abs(np.interp(grid, arc_m, curvature_per_m))
    bend = np.maximum(bend, 1e-9)
    limit = np.minimum(
        speed_m_s**2, np.minimum(limits.lateral_m_s2 / bend, (limits.yaw_rate_rad_s / bend) ** 2)
    )
    limit = np.maximum(limit, _SLOWEST_M_S**2)
    allowed = limit.copy()
    for _ in range(_CORRECTIONS):
        profile = _smoothed(grid, _passes(grid, allowed, limits.tangential_m_s2), limits.smoothing_s)
        ratio = profile.speed_m_s**2 / np.interp(profile.arc_m, grid, limit)
        if ratio.max() <= 1.001:
            return profile
        excess = np.ones_like(even)
        nearest = np.clip(np.rint((profile.arc_m - start) / (stop - start) * count).astype(np.intp), 0, count)
        np.maximum.at(excess, nearest, ratio)
        # spread to neighbours within the window, because they cause the excess
        reach = max(1, int(0.5 * limits.smoothing_s * speed_m_s / _GRID_M))
        excess = np.interp(grid, even, _running_max(excess, reach))
        allowed = np.maximum(allowed / excess, _SLOWEST_M_S**2)
    stretch = float(np.sqrt(max(1.0, ratio.max())))
    return _stretched(profile, stretch)


def _passes(grid: Array, limit: Array, acceleration: float) -> Array:
    """Largest squared speeds below `limit`, zero at both ends, that change by at most 2 a per metre."""
    squared = limit.copy()
    squared[0] = squared[-1] = 0.0
    rise = 2.0 * acceleration * grid
    squared = np.minimum.accumulate(squared - rise) + rise
    backward = (squared + rise)[::-1]
    return np.maximum((np.minimum.accumulate(backward)[::-1]) - rise, 0.0)


def _smoothed(grid: Array, squared: Array, smoothing_s: float) -> Profile:
    speed = np.sqrt(squared)
    pace = speed[:-1] + speed[1:]
    times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(grid) / pace)))
    steps = int(np.ceil(times[-1] / STEP_S))
    t = np.arange(steps + 1) * STEP_S
    # exact for constant acceleration inside an interval: quadratic in time
    k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(grid) - 2)
    since = np.minimum(t, times[-1]) - times[k]
    span = times[k + 1] - times[k]
    arc = grid[k] + since * (speed[k] + 0.5 * (speed[k + 1] - speed[k]) * since / span)
    half = max(1, round(0.5 * smoothing_s / STEP_S))
    box = np.full(half, 1.0 / half)
    kernel = np.convolve(box, box)
    padded = np.concatenate((np.full(2 * half, grid[0]), arc, np.full(2 * half, grid[-1])))
    arc = np.clip(np.convolve(padded, kernel, mode="valid"), grid[0], grid[-1])
    speed_out = np.gradient(arc, STEP_S)
    return Profile(arc_m=arc, speed_m_s=speed_out, acceleration_m_s2=np.gradient(speed_out, STEP_S))


def _running_max(values: Array, reach: int) -> Array:
    padded = np.concatenate((np.ones(reach), values, np.ones(reach)))
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)


def _stretched(profile: Profile, factor: float) -> Profile:
    """The same path, slower by `factor` >= 1 everywhere."""
    if factor == 1.0:
        return profile
    old = np.arange(len(profile.arc_m)) * STEP_S * factor
    new = np.arange(int(np.ceil(old[-1] / STEP_S)) + 1) * STEP_S
    arc = np.interp(new, old, profile.arc_m)
    speed = np.interp(new, old, profile.speed_m_s) / factor
    acceleration = np.interp(new, old, profile.acceleration_m_s2) / factor**2
    return Profile(arc_m=arc, speed_m_s=speed, acceleration_m_s2=acceleration)
