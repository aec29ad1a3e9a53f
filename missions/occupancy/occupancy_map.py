"""The occupancy map of a search: scores of cells that searching lowers and that identified anomalies raise.

Source: Lum, Rysdyk and Pongpunwattana 2005, section IV-B, equations 10 and 11; docs/papers.md. North and east
are metres from home; arrays have rows to the north and columns to the east.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from missions.errors import PlanError
from missions.occupancy.detection import DetectionModel

Array = NDArray[np.float64]

MAX_CELLS: Final = 250_000
Cell = tuple[int, int]
"""(row, column): row 0 is the southernmost, column 0 the westernmost."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GridLayout:
    """Square cells over a rectangle.

    Attributes:
        south_m, west_m: corner of the rectangle, north and east of home.
        cell_m: side of a cell.
        rows, columns: number of rows and columns.

    Raises:
        PlanError: the size gives no map.
    """

    south_m: float
    west_m: float
    cell_m: float
    rows: int
    columns: int

    def __post_init__(self) -> None:
        if not (math.isfinite(self.cell_m) and self.cell_m > 0.0):
            raise PlanError(f"`cell_m` {self.cell_m:g} m is not possible; ask for more than 0")
        if self.rows < 2 or self.columns < 2:
            raise PlanError(
                f"`cell_m` {self.cell_m:g} m leaves {self.rows} x {self.columns} cells in the area; "
                "ask for smaller cells or a larger `width_m, height_m`: at least 2 x 2 make a map"
            )
        if self.rows * self.columns > MAX_CELLS:
            raise PlanError(
                f"`cell_m` {self.cell_m:g} m makes {self.rows * self.columns} cells, more than {MAX_CELLS}; "
                "ask for larger cells or a smaller `width_m, height_m`"
            )

    @classmethod
    def over(
        cls, *, width_m: float, height_m: float, cell_m: float, centre_ne_m: tuple[float, float]
    ) -> "GridLayout":
        """Cells over `width_m` (east) by `height_m` (north) around a centre; partial cells are left out."""
        if not (math.isfinite(cell_m) and cell_m > 0.0):
            raise PlanError(f"`cell_m` {cell_m:g} m is not possible; ask for more than 0")
        rows, columns = math.floor(height_m / cell_m + 1e-9), math.floor(width_m / cell_m + 1e-9)
        return cls(
            south_m=centre_ne_m[0] - 0.5 * rows * cell_m,
            west_m=centre_ne_m[1] - 0.5 * columns * cell_m,
            cell_m=cell_m,
            rows=rows,
            columns=columns,
        )

    @property
    def north_m(self) -> float:
        """Northern edge, m from home."""
        return self.south_m + self.rows * self.cell_m

    @property
    def east_m(self) -> float:
        """Eastern edge, m from home."""
        return self.west_m + self.columns * self.cell_m

    def contains(self, north_m: float, east_m: float) -> bool:
        """Whether a place is on the map."""
        return self.south_m <= north_m < self.north_m and self.west_m <= east_m < self.east_m

    def cell_at(self, north_m: float, east_m: float) -> Cell:
        """The cell that contains a place; for places off the map the nearest cell."""
        row = math.floor((north_m - self.south_m) / self.cell_m)
        column = math.floor((east_m - self.west_m) / self.cell_m)
        return min(max(row, 0), self.rows - 1), min(max(column, 0), self.columns - 1)

    def centre_of(self, cell: Cell) -> tuple[float, float]:
        """North and east of a cell's centre."""
        return self.south_m + (cell[0] + 0.5) * self.cell_m, self.west_m + (cell[1] + 0.5) * self.cell_m

    def centres(self) -> tuple[Array, Array]:
        """North (rows, 1) and east (1, columns) of every cell's centre."""
        north: Array = self.south_m + (np.arange(self.rows, dtype=np.float64) + 0.5) * self.cell_m
        east: Array = self.west_m + (np.arange(self.columns, dtype=np.float64) + 0.5) * self.cell_m
        return north[:, None], east[None, :]


class OccupancyMap:
    """Scores of the cells, shared by every searcher, and the probability of detection so far.

    The initial scores are the prior probability that the target is in a cell. Later they are no longer
    probabilities: equation 11 isn't normalised, and raising adds belief.

    Attributes:
        layout: the cells.
        scores: (rows, columns), used for decisions.
        remaining: (rows, columns), prior probability times the probability of having missed the target there
            so far. It does not change when a target is identified, so 1 minus its sum is the cumulative
            probability of detection (Bourgault et al. 2003).
    """

    def __init__(self, layout: GridLayout, prior: Array | None = None) -> None:
        """Initialise the map.

        Args:
            layout: the cells.
            prior: (rows, columns), relative probability of each cell, finite and not negative; None: all
                equal.

        Raises:
            PlanError: the prior has another shape, or no probability above zero.
        """
        shape = (layout.rows, layout.columns)
        start = np.ones(shape) if prior is None else np.array(prior, dtype=np.float64)
        if start.shape != shape:
            raise PlanError(f"the prior has {start.shape} cells, the map {shape}")
        if not np.all(np.isfinite(start)) or np.any(start < 0.0) or not start.sum() > 0.0:
            raise PlanError("the prior is not a probability: it must be finite, not negative, and not all 0")
        self.layout = layout
        self.scores: Array = start / start.sum()
        self.remaining: Array = self.scores.copy()

    @property
    def probability_of_detection(self) -> float:
        """Probability that a target on the map would have been detected so far."""
        return 1.0 - float(self.remaining.sum())

    def search(
        self, start_ne_m: tuple[float, float], end_ne_m: tuple[float, float], model: DetectionModel
    ) -> None:
        """Lower the scores along a straight stretch of track on which nothing was detected (eq. 10, 11)."""
        north, east = self.layout.centres()
        missed = 1.0 - model.probability(north, east, start_ne_m, end_ne_m)
        self.scores *= missed
        self.remaining *= missed

    def raise_around(self, north_m: float, east_m: float, *, radius_m: float, height: float) -> None:
        """Raise the scores around an identified target by a Gaussian, so that other searchers converge.

        Args:
            north_m, east_m: position of the target.
            radius_m: scores farther away do not change; it is two standard deviations of the Gaussian.
            height: height of the Gaussian's peak, in multiples of the prior's mean score.
        """
        north, east = self.layout.centres()
        distance2 = (north - north_m) ** 2 + (east - east_m) ** 2
        sigma_m = 0.5 * radius_m
        peak = height / (self.layout.rows * self.layout.columns)
        self.scores += np.where(distance2 <= radius_m**2, peak * np.exp(-0.5 * distance2 / sigma_m**2), 0.0)
