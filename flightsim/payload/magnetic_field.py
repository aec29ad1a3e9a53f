"""The true magnetic field: geology and main field on a grid, and the targets."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.main_field import MainField
from flightsim.payload.daily_variation import DailyVariation
from flightsim.payload.magnetic_map import MagneticMap, bilinear
from flightsim.payload.signature import Signature

Array = NDArray[np.float64]


class MagneticField:
    """Total field at any place: the true background and signatures.

    A mission has a published map, `survey.surveyed` of the background, so reading - map is the sum of the
    targets' fields, noise, and the error of the survey. Beyond the grid's edges and in its holes the field is
    that of the nearest data, so that a magnetometer has a reading everywhere.

    Attributes:
        home: origin of the frame.
        signatures: the targets.
    """

    def __init__(
        self,
        background: MagneticMap,
        signatures: Sequence[Signature] = (),
        *,
        decimal_year: float = 2026.0,
        daily: DailyVariation | None = None,
    ) -> None:
        """Put the targets into the field.

        Args:
            background: the true field without them.
            signatures: the targets.
            decimal_year: date of the main field, which gives the direction.
            daily: variation in time; None: there is none.

        Raises:
            MagneticMapError: a target outside the grid.
        """
        for number, signature in enumerate(signatures, 1):
            background.require_inside(f"target {number}", signature.north_m, signature.east_m)
        self.home = background.home
        self.signatures = tuple(signatures)
        self._background = background.without_holes()
        self._daily = daily
        row_step_m, column_step_m = background.spacing_m
        self._axes = (
            (float(background.north_m[0]), row_step_m, background.north_m.size - 1.0),
            (float(background.east_m[0]), column_step_m, background.east_m.size - 1.0),
        )
        main = MainField(background.home, decimal_year)
        self._field_ned_nt: Array = main.total_nt * main.direction_ned

    def total_nt(self, north_m: float, east_m: float, height_m: float, time_s: float = 0.0) -> float:
        """Total field at a place, local NED of the map's home, a height above it, and a time since boot."""
        (south_m, row_step_m, last_row), (west_m, column_step_m, last_column) = self._axes
        row = min(last_row, max(0.0, (north_m - south_m) / row_step_m))
        column = min(last_column, max(0.0, (east_m - west_m) / column_step_m))
        background = self._background
        total: float = bilinear(background.total_field_nt, row, column)
        if background.vertical_gradient_nt_m is not None:
            gradient: float = bilinear(background.vertical_gradient_nt_m, row, column)
            total += gradient * (height_m - background.height_m)
        for signature in self.signatures:
            drift_n, drift_e = signature.velocity_ne_m_s
            north, east = north_m - drift_n * time_s, east_m - drift_e * time_s
            total += signature.anomaly_at_nt(north, east, height_m, self._field_ned_nt)
        return total if self._daily is None else total + self._daily.at_nt(time_s)

    def total_at_nt(self, north_m: Array, east_m: Array, height_m: float) -> Array:
        """Total field at places of any shape, at one height above home, at boot, without daily variation."""
        background = self._background
        total = background.interpolate(
            np.clip(north_m, background.north_m[0], background.north_m[-1]),
            np.clip(east_m, background.east_m[0], background.east_m[-1]),
            height_m,
        )
        for signature in self.signatures:
            total = total + signature.anomaly_nt(north_m, east_m, height_m, self._field_ned_nt)
        return total
