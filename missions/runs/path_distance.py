"""Distance of a track from a path that may cross itself: a compiled kernel."""

import math

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]


@kernel
def follow_path(path: Array, track: Array, back_m: float, ahead_m: float, errors: Array) -> None:
    """Write the distance of track[k] from the path (m, 3) to errors[k], searched near the place found for
    track[k - 1].

    Legs are searched from `back_m` before that place to `ahead_m` plus the last error after it.
    """
    first = 0  # leg of the place that was found last
    along_m = 0.0  # distance of that place from the leg's start
    last_error = ahead_m
    legs = path.shape[0] - 1
    for k in range(track.shape[0]):
        leg = first
        behind = along_m
        while leg > 0 and behind < back_m:
            leg -= 1
            behind += _leg_length(path, leg)
        ahead = -behind
        best = math.inf
        while leg < legs and ahead <= ahead_m + last_error:
            length = _leg_length(path, leg)
            dx = path[leg + 1, 0] - path[leg, 0]
            dy = path[leg + 1, 1] - path[leg, 1]
            dz = path[leg + 1, 2] - path[leg, 2]
            ox = track[k, 0] - path[leg, 0]
            oy = track[k, 1] - path[leg, 1]
            oz = track[k, 2] - path[leg, 2]
            f = 0.0
            if length > 0.0:
                f = min(1.0, max(0.0, (ox * dx + oy * dy + oz * dz) / (length * length)))
            distance = math.sqrt((ox - f * dx) ** 2 + (oy - f * dy) ** 2 + (oz - f * dz) ** 2)
            if distance < best:
                best = distance
                first = leg
                along_m = f * length
            ahead += length
            leg += 1
        errors[k] = best
        last_error = best


@kernel
def _leg_length(path: Array, leg: int) -> float:
    dx = path[leg + 1, 0] - path[leg, 0]
    dy = path[leg + 1, 1] - path[leg, 1]
    dz = path[leg + 1, 2] - path[leg, 2]
    return math.sqrt(dx * dx + dy * dy + dz * dz)
