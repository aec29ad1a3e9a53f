"""Dipoles that explain an anomaly: place, depth and moment, from the readings of all lines around it.

The field of a dipole is linear in its moment, and a level of each line is too, so only the place is searched
(variable projection: Golub and Pereyra 1973, SIAM Journal on Numerical Analysis 10). A scalar magnetometer
reads the component along the Earth's field (Blakely 1995, "Potential theory in gravity and magnetic
applications", section 8.3).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

__all__ = ["DipoleSource", "fitted_dipole"]

Array = NDArray[np.float64]

_MU0_4PI_NT: Final = 1e-7 * 1e9
_OFFSETS_M: Final = (-120.0, 0.0, 120.0)  # of the starts of the search
_BELOW_M: Final = (60.0, 120.0)
_NEAREST_M: Final = 10.0  # below the readings
_DEEPEST_M: Final = 800.0
_FARTHEST_M: Final = 300.0  # of the place from the peak
_LEAST_POINTS: Final = 30
_LEVEL_WEIGHT: Final = 1.0
_LEAST_EXPLAINED: Final = 0.6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DipoleSource:
    """A dipole.

    Attributes:
        north_m, east_m, height_m: place, from the origin of the survey's frame.
        moment_ned_a_m2: (3,) moment.
        explained: share of the variance of the readings around it that it explains.
    """

    north_m: float
    east_m: float
    height_m: float
    moment_ned_a_m2: Array
    explained: float

    @property
    def moment_a_m2(self) -> float:
        return float(np.linalg.norm(self.moment_ned_a_m2))

    def field_nt(self, north_m: Array, east_m: Array, height_m: Array, direction_ned: Array) -> Array:
        """Its field (n,) along the Earth's field at places (n,)."""
        place = np.array((self.north_m, self.east_m, self.height_m))
        found: Array = _kernels(np.column_stack((north_m, east_m, height_m)), place, direction_ned) @ (
            self.moment_ned_a_m2
        )
        return found


def fitted_dipole(
    places_m: Array,
    values_nt: Array,
    line_of: NDArray[np.int64],
    *,
    near_ne_m: tuple[float, float],
    direction_ned: Array,
) -> DipoleSource | None:
    """The dipole that explains readings around a place best; None: none explains most of them.

    Args:
        places_m: (n, 3) north, east, height of the readings.
        values_nt: (n,) differential measurements.
        line_of: (n,) number of the line of each; lines have levels of their own.
        near_ne_m: the strongest reading's place.
        direction_ned: (3,) of the Earth's field.
    """
    if len(values_nt) < _LEAST_POINTS:
        return None
    lines = np.unique(line_of)
    levels = (line_of[:, None] == lines).astype(np.float64)
    base = values_nt - levels @ np.linalg.lstsq(levels, values_nt, rcond=None)[0]
    # the lines are levelled, so a level of its own has to be small: as many further equations
    prior = np.column_stack((np.zeros((len(lines), 3)), _LEVEL_WEIGHT * np.eye(len(lines))))
    wanted = np.concatenate((values_nt, np.zeros(len(lines))))
    top_m = float(places_m[:, 2].min())

    def solved(place: Array) -> tuple[Array, Array]:
        design = np.vstack((np.column_stack((_kernels(places_m, place, direction_ned), levels)), prior))
        scale = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
        found = np.linalg.lstsq(design / scale, wanted, rcond=None)[0]
        return found / scale, wanted - design / scale @ found

    centre = np.array((*near_ne_m, top_m))
    starts = [centre + np.array((n, e, -below)) for n in _OFFSETS_M for e in _OFFSETS_M for below in _BELOW_M]
    start = min(starts, key=lambda place: float(np.sum(solved(place)[1] ** 2)))
    low = centre - np.array((_FARTHEST_M, _FARTHEST_M, _DEEPEST_M))
    high = centre + np.array((_FARTHEST_M, _FARTHEST_M, -_NEAREST_M))
    fit = least_squares(lambda place: solved(place)[1], start, bounds=(low, high), x_scale=50.0, max_nfev=60)
    coefficients, left = solved(fit.x)
    variance = float(np.sum(base**2))
    explained = 1.0 - float(np.sum(left**2)) / variance if variance > 0.0 else 0.0
    if explained < _LEAST_EXPLAINED or not math.isfinite(explained):
        return None
    north_m, east_m, height_m = fit.x.tolist()
    return DipoleSource(
        north_m=north_m,
        east_m=east_m,
        height_m=height_m,
        moment_ned_a_m2=coefficients[:3],
        explained=explained,
    )


def _kernels(places_m: Array, source_m: Array, direction_ned: Array) -> Array:
    """Field (n, 3), nT, of unit moments north, east and down, along the Earth's field."""
    away = places_m - source_m
    away[:, 2] *= -1.0  # heights to down
    distance = np.linalg.norm(away, axis=1)
    along = away @ direction_ned
    kernels: Array = _MU0_4PI_NT * (
        3.0 * away * (along / distance**5)[:, None] - direction_ned / distance[:, None] ** 3
    )
    return kernels
