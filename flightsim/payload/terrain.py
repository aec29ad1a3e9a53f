"""Terrain: heights of the ground above home on a grid, and what it hides.

Generated terrain is self-affine: the power spectrum of its heights falls with the wavenumber k as
k^(-2H-2), with the Hurst exponent H between 0.5 and 0.9 for most landscapes (Turcotte 1997, Fractals and
Chaos in Geology and Geophysics, section 7.4).

Only sensors use the terrain. The ground on which vehicles and targets stand is the plane of home.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options
from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload.area_grid import AreaGrid

Array = NDArray[np.float64]

_STEPS_PER_LINE: Final = 2.0  # samples of a line of sight per grid spacing


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainSpec(AreaGrid):
    """Terrain to be generated; beyond its edges it continues with its edge heights.

    Attributes:
        relief_m: standard deviation of the heights.
        hurst: Hurst exponent; a larger one makes smoother ground.
        stream: number of the terrain; terrains of one seed with different numbers are independent.
    """

    spacing_m: Positive = 5.0
    relief_m: Positive = 10.0
    hurst: float = 0.8
    stream: int = 0

    def check_together(self) -> None:
        if not 0.0 < self.hurst < 1.0:
            raise ValueError(f"hurst = {self.hurst} is not accepted: a number between 0 and 1 is")

    def made(self, seed: int) -> "Terrain":
        """The terrain of a world's seed."""
        rng = np.random.Generator(np.random.PCG64(RandomStreams(seed).child("terrain", self.stream)))
        rows, columns = self.shape
        # a field made by Fourier transform repeats itself: a quarter of one of twice the size is used
        size = (2 * rows, 2 * columns)
        k = math.tau * np.hypot(
            np.fft.fftfreq(size[0], self.spacing_m)[:, None],
            np.fft.rfftfreq(size[1], self.spacing_m)[None, :],
        )
        k[0, 0] = math.inf  # no mean
        spectrum = np.fft.rfft2(rng.standard_normal(size)) * k ** -(self.hurst + 1.0)
        heights: Array = np.fft.irfft2(spectrum, s=size)[:rows, :columns]
        heights = heights - heights.mean()
        heights *= self.relief_m / float(np.sqrt(np.mean(heights**2)))
        return Terrain(south_m=self.south_m, west_m=self.west_m, spacing_m=self.spacing_m, height_m=heights)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Terrain(Options):
    """Heights of the ground on a grid.

    Attributes:
        south_m, west_m: place of the first row and column, local NED of home.
        spacing_m: distance of the grid lines.
        height_m: (rows, columns) heights above home; rows go north, columns east.
    """

    south_m: float
    west_m: float
    spacing_m: Positive
    height_m: Array

    def check_together(self) -> None:
        if self.height_m.ndim != 2 or min(self.height_m.shape) < 2 or not np.all(np.isfinite(self.height_m)):
            raise ValueError(
                f"height_m of shape {self.height_m.shape} is not accepted: finite heights on a grid of 2 x 2 "
                "points or more are"
            )

    def at(self, north_m: Array, east_m: Array) -> Array:
        """Height above home at places, bilinear; beyond the edges that of the nearest edge."""
        rows, columns = self.height_m.shape
        y = np.clip((north_m - self.south_m) / self.spacing_m, 0.0, rows - 1.0)
        x = np.clip((east_m - self.west_m) / self.spacing_m, 0.0, columns - 1.0)
        row = np.minimum(y.astype(np.int64), rows - 2)
        column = np.minimum(x.astype(np.int64), columns - 2)
        fy, fx, h = y - row, x - column, self.height_m
        south = h[row, column] * (1.0 - fx) + h[row, column + 1] * fx
        north = h[row + 1, column] * (1.0 - fx) + h[row + 1, column + 1] * fx
        found: Array = south * (1.0 - fy) + north * fy
        return found

    def hides(
        self, eye_ned_m: tuple[float, float, float], north_m: float, east_m: float, size_m: float
    ) -> bool:
        """Whether the ground is between an eye and the top of an object that stands on it.

        Args:
            eye_ned_m: place of the eye, local NED of home.
            north_m, east_m: place of the object.
            size_m: its height.
        """
        count = math.ceil(
            _STEPS_PER_LINE * math.hypot(north_m - eye_ned_m[0], east_m - eye_ned_m[1]) / self.spacing_m
        )
        top_m = float(self.at(np.array([north_m]), np.array([east_m]))[0]) + size_m
        share = np.arange(1, count, dtype=np.float64) / max(count, 1)
        ground = self.at(
            eye_ned_m[0] + share * (north_m - eye_ned_m[0]), eye_ned_m[1] + share * (east_m - eye_ned_m[1])
        )
        line = -eye_ned_m[2] + share * (top_m + eye_ned_m[2])
        return bool(np.any(ground > line))
