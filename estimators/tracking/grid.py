"""Grid beliefs: the probability of a target's place in square cells over an area.

North and east are metres from home; arrays have rows to the north and columns to the east.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.tracking.cell_count import MAX_CELLS, cells_over

Array = NDArray[np.float64]

GridCell = tuple[int, int]
"""(row, column): row 0 is the southernmost, column 0 the westernmost."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GridLayout:
    """Square cells over a rectangle.

    Attributes:
        south_m, west_m: corner of the rectangle, north and east of home.
        cell_m: side of a cell.
        rows, columns: number of rows and columns.
    """

    south_m: float
    west_m: float
    cell_m: float
    rows: int
    columns: int

    @classmethod
    def over(
        cls,
        *,
        width_m: float,
        height_m: float,
        cell_m: float,
        centre_ne_m: tuple[float, float],
        most_cells: int = MAX_CELLS,
    ) -> "GridLayout":
        """Cells over `width_m` (east) by `height_m` (north) around a centre; partial cells are left out.

        Raises:
            EstimatorError: there are too few cells or too many.
        """
        rows, columns = cells_over(width_m, height_m, cell_m, most_cells)
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

    def cell_at(self, north_m: float, east_m: float) -> GridCell:
        """The cell that contains a place; for places off the map the nearest cell."""
        row = math.floor((north_m - self.south_m) / self.cell_m)
        column = math.floor((east_m - self.west_m) / self.cell_m)
        return min(max(row, 0), self.rows - 1), min(max(column, 0), self.columns - 1)

    def centre_of(self, cell: GridCell) -> tuple[float, float]:
        """North and east of a cell's centre."""
        return self.south_m + (cell[0] + 0.5) * self.cell_m, self.west_m + (cell[1] + 0.5) * self.cell_m

    def centres(self) -> tuple[Array, Array]:
        """North (rows, 1) and east (1, columns) of every cell's centre."""
        north: Array = self.south_m + (np.arange(self.rows, dtype=np.float64) + 0.5) * self.cell_m
        east: Array = self.west_m + (np.arange(self.columns, dtype=np.float64) + 0.5) * self.cell_m
        return north[:, None], east[None, :]


class GridBelief:
    """Probability that the target is in a cell and that no searcher has detected it so far.

    Without normalization 1 minus the sum is the cumulative probability of detection (Bourgault et al. 2003).
    The moments and the entropy are those of the normalized belief.

    Args:
        layout: the cells.
        prior: (rows, columns), relative probability of each cell, finite and not negative; None: all equal.

    Attributes:
        mass: (rows, columns).

    Raises:
        EstimatorError: the prior has another shape, or no probability above zero.
    """

    def __init__(self, layout: GridLayout, prior: Array | None = None) -> None:
        shape = (layout.rows, layout.columns)
        start = np.ones(shape) if prior is None else np.array(prior, dtype=np.float64)
        if start.shape != shape:
            raise EstimatorError(f"the prior has {start.shape} cells, the map {shape}")
        if not np.all(np.isfinite(start)) or np.any(start < 0.0) or not start.sum() > 0.0:
            raise EstimatorError(
                "the prior is not a probability: it must be finite, not negative, and not all 0"
            )
        self.layout = layout
        self.mass: Array = start / start.sum()

    def update(self, likelihood: Array) -> None:
        """Multiply by the likelihood of what was observed: of no detection, 1 - p(D | cell)."""
        self.mass *= likelihood

    def normalize(self) -> float:
        """Condition on the observations; returns the probability that they had. After a detection the belief
        is a probability again; without any probability left it is uniform.
        """
        total = float(self.mass.sum())
        self.mass[:] = self.mass / total if total > 0.0 else 1.0 / self.mass.size
        return total

    @property
    def probability_of_detection(self) -> float:
        """Probability that a target on the map would have been detected so far."""
        return 1.0 - float(self.mass.sum())

    @property
    def mode_ne_m(self) -> tuple[float, float]:
        """Centre of the most probable cell."""
        row, column = np.unravel_index(int(np.argmax(self.mass)), self.mass.shape)
        return self.layout.centre_of((int(row), int(column)))

    def moments(self) -> tuple[Array, Array]:
        """Mean (2,) and covariance (2, 2) of the place, north and east, with that of a cell in it."""
        north, east = self.layout.centres()
        p = self.mass / self.mass.sum()
        mean = np.array([float(np.sum(p * north)), float(np.sum(p * east))])
        off_n, off_e = north - mean[0], east - mean[1]
        across = float(np.sum(p * off_n * off_e))
        within = self.layout.cell_m**2 / 12.0
        return mean, np.array(
            [[float(np.sum(p * off_n**2)) + within, across], [across, float(np.sum(p * off_e**2)) + within]]
        )

    @property
    def entropy_nats(self) -> float:
        """Entropy of the cell that holds the target."""
        p = self.mass[self.mass > 0.0] / self.mass.sum()
        return float(-np.sum(p * np.log(p)))
