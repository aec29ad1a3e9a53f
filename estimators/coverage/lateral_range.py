"""Kernels of sensors with a sweep width: what tracks pass, and how long and how near (compiled).

Source: Koopman 1946, "Search and Screening", chapter 2: the probability of detection in a time dt at a
distance r is k h / r^3 dt for an observer at a height h that is small against r, so that a straight track at
a lateral distance x detects with 1 - exp(-2 k h / (v x^2)).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

__all__ = ["add_exposure", "sweep"]

Array = NDArray[np.float64]
_LEAST_M2: Final = 1e-6


@kernel
def sweep(places: Array, north: Array, east: Array, half_width_m: float, swept: NDArray[np.bool_]) -> None:
    """Mark the cells that are within half a sweep width of a track.

    Args:
        places: (n, 2) of the track, straight between them.
        north: (rows,) and
        east: (columns,) centres of the cells, evenly spaced.
        half_width_m: half of the sweep width.
        swept: (rows, columns), is marked.
    """
    for k in range(places.shape[0] - 1):
        n0, e0 = places[k, 0], places[k, 1]
        dn, de = places[k + 1, 0] - n0, places[k + 1, 1] - e0
        squared = dn * dn + de * de
        rows = _span(north, min(n0, n0 + dn) - half_width_m, max(n0, n0 + dn) + half_width_m)
        columns = _span(east, min(e0, e0 + de) - half_width_m, max(e0, e0 + de) + half_width_m)
        for i in range(rows[0], rows[1]):
            for j in range(columns[0], columns[1]):
                n, e = north[i] - n0, east[j] - e0
                share = 0.0
                if squared > 0.0:
                    share = min(1.0, max(0.0, (n * dn + e * de) / squared))
                if (n - share * dn) ** 2 + (e - share * de) ** 2 <= half_width_m * half_width_m:
                    swept[i, j] = True


@kernel
def add_exposure(
    places: Array, north: Array, east: Array, inverse_cube_m2: float, reach_m: float, exposure: Array
) -> None:
    """Add the integral of k h / (v r^3) along a track, in closed form for each of its legs.

    Args:
        places, north, east: as of `sweep`.
        inverse_cube_m2: k h / v.
        reach_m: distance from a leg beyond which it adds nothing.
        exposure: (rows, columns), is increased.
    """
    for k in range(places.shape[0] - 1):
        n0, e0 = places[k, 0], places[k, 1]
        dn, de = places[k + 1, 0] - n0, places[k + 1, 1] - e0
        length = math.sqrt(dn * dn + de * de)
        if length == 0.0:
            continue
        rows = _span(north, min(n0, n0 + dn) - reach_m, max(n0, n0 + dn) + reach_m)
        columns = _span(east, min(e0, e0 + de) - reach_m, max(e0, e0 + de) + reach_m)
        for i in range(rows[0], rows[1]):
            for j in range(columns[0], columns[1]):
                n, e = north[i] - n0, east[j] - e0
                along = (n * dn + e * de) / length
                across = max((n * de - e * dn) ** 2 / (length * length), _LEAST_M2)
                before, after = -along, length - along
                ends = after / math.sqrt(across + after * after) - before / math.sqrt(
                    across + before * before
                )
                exposure[i, j] += inverse_cube_m2 * ends / across


@kernel
def _span(centres: Array, low_m: float, high_m: float) -> tuple[int, int]:
    """First and last but one number of the evenly spaced centres between two places."""
    step = centres[1] - centres[0]
    first = math.ceil((low_m - centres[0]) / step)
    last = math.floor((high_m - centres[0]) / step) + 1
    return max(0, int(first)), min(centres.shape[0], int(last))
