"""The Bayes filter of a target's place on a grid, updated where a camera looks.

Source: Tisdale et al. 2008, sections II and IV-A. A frame changes the cells of its footprint only, because
the likelihood is relative to that of a place far away (`camera_likelihood`). The sum over all cells is kept
up to date by what changed, and read anew when it has lost digits.
"""

import math
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from estimators.errors import EstimatorError
from estimators.tracking.camera_likelihood import FrameLikelihood
from estimators.tracking.camera_sight import CameraSight, SightModel
from estimators.tracking.frame_kernels import likelihoods
from estimators.tracking.grid import GridLayout
from flightsim.foundation.kernels import kernel

__all__ = ["Scale", "SearchGrid"]

Array = NDArray[np.float64]
Cells = NDArray[Any]

_LARGEST: Final = 1e25  # of a cell of the linear scale, before all are divided: float32 ends at 3e38
_SMALLEST: Final = 1e-30  # below it a cell is 0: subnormal numbers are slow
_LARGEST_LOG: Final = 50.0
_LOST: Final = 1e-4  # share of the sum at which it has lost four digits
_NARROW: Final = 0.25  # least variance in cells squared down to which sums over cells are exact to 1 %
_NEGLIGIBLE: Final = 1e-16  # probability of a cell; ten million of them have an entropy of 4e-8 nats
_LEAST_STEP: Final = 0.1  # of a walk, in cells squared
_THREE_CELLS: Final = 0.5  # variance in cells squared up to which three weights have the right one


class Scale(StrEnum):
    """What a cell's number is."""

    LINEAR = "linear"
    """The probability times a factor common to all cells; what falls below 1e-30 of the largest is lost."""
    LOG = "log"
    """Its logarithm, with the same precision for improbable cells; slower."""


class SearchGrid:
    """Probability of a target's place in square cells.

    A frame's likelihood is taken at the middle of each cell. Where the pose is known better than a place
    within a cell, to a variance of cell^2 / 12, the difference is one more error of the projection.

    Args:
        layout: the cells.
        model: detector and target.
        prior: (rows, columns), relative probability of each cell, finite, not negative; None: all equal.
        scale: what the cells store.
        dtype: float32 or float64.
        walk_m_sqrt_s: standard deviation per axis of the target's walk in one second; it stays in the area.

    Raises:
        EstimatorError: the prior is no probability, or the type is another.
    """

    def __init__(
        self,
        layout: GridLayout,
        model: SightModel,
        *,
        prior: Array | None = None,
        scale: Scale = Scale.LINEAR,
        dtype: Any = np.float64,
        walk_m_sqrt_s: float = 0.0,
    ) -> None:
        if np.dtype(dtype) not in (np.dtype(np.float32), np.dtype(np.float64)):
            raise EstimatorError(f"dtype {np.dtype(dtype)} is not float32 or float64")
        shape = (layout.rows, layout.columns)
        start = np.ones(shape) if prior is None else np.asarray(prior, dtype=np.float64)
        if start.shape != shape:
            raise EstimatorError(f"the prior has {start.shape} cells, the map {shape}")
        if not np.all(np.isfinite(start)) or np.any(start < 0.0) or not start.sum() > 0.0:
            raise EstimatorError("the prior is no probability: finite, not negative, and not all 0 is one")
        if not (math.isfinite(walk_m_sqrt_s) and walk_m_sqrt_s >= 0.0):
            raise EstimatorError(f"walk_m_sqrt_s {walk_m_sqrt_s:g} is not possible; give 0 or more")
        self.layout, self.model, self.scale = layout, model, scale
        start = start / start.max()
        with np.errstate(divide="ignore"):
            self._cells: Cells = (np.log(start) if scale is Scale.LOG else start).astype(dtype)
        self._within_m2 = layout.cell_m**2 / 12.0
        self._coarse = False  # a detection was blurred by the cells
        self._walk_cells2_s = (walk_m_sqrt_s / layout.cell_m) ** 2
        self._walked_cells2 = 0.0
        self._offset = 0.0  # of the logarithms
        self._sum = self._full_sum = self._summed()
        self._undetected = 1.0
        self._detected = False

    def predict(self, dt_s: float) -> None:
        """Diffuse the belief; short times are added up until they matter."""
        self._walked_cells2 += self._walk_cells2_s * max(0.0, dt_s)
        if self._walked_cells2 < _LEAST_STEP:
            return
        variance, self._walked_cells2 = self._walked_cells2, 0.0
        p = self.probability()
        if variance <= _THREE_CELLS:
            p = _spread_by_three(_spread_by_three(p, variance).T, variance).T
        else:
            p = gaussian_filter(p, math.sqrt(variance), mode="reflect", truncate=5.0)
        p = p / p.max()
        self._offset = 0.0
        with np.errstate(divide="ignore"):
            self._cells[:] = np.log(p) if self.scale is Scale.LOG else p
        self._sum = self._full_sum = self._summed()

    def update(self, sight: CameraSight) -> float:
        layout = self.layout
        reach_m = (layout.rows + layout.columns) * layout.cell_m + math.dist(
            sight.place_ned_m[:2], (layout.south_m, layout.west_m)
        )
        blur_m2 = self._within_m2 - sight.known_m2
        self._coarse = self._coarse or (blur_m2 > 0.0 and len(sight.detections) > 0)
        frame = FrameLikelihood.of(sight.blurred(blur_m2), self.model, reach_m)
        box = frame.box
        if box is None:
            return 1.0
        first_row = max(0, math.floor((box[0] - layout.south_m) / layout.cell_m))
        first_column = max(0, math.floor((box[1] - layout.west_m) / layout.cell_m))
        rows = min(layout.rows, math.ceil((box[2] - layout.south_m) / layout.cell_m)) - first_row
        columns = min(layout.columns, math.ceil((box[3] - layout.west_m) / layout.cell_m)) - first_column
        if rows <= 0 or columns <= 0:
            return 1.0
        part = self._cells[first_row : first_row + rows, first_column : first_column + columns]
        south_m = layout.south_m + (first_row + 0.5) * layout.cell_m
        west_m = layout.west_m + (first_column + 0.5) * layout.cell_m
        if self.scale is Scale.LOG:
            before, after, largest = _add_logs(
                part, south_m, west_m, layout.cell_m, frame.numbers, frame.detections, self._offset
            )
        else:
            before, after, largest = _multiply(
                part, south_m, west_m, layout.cell_m, frame.numbers, frame.detections
            )
        evidence = max(0.0, 1.0 + (after - before) / self._sum)
        self._sum += after - before
        self._count(sight, evidence)
        self._keep_in_range(largest)
        return evidence

    def _count(self, sight: CameraSight, evidence: float) -> None:
        self._detected = self._detected or bool(len(sight.detections))
        if not self._detected:
            self._undetected *= evidence

    def _keep_in_range(self, largest: float) -> None:
        """Read the sum anew when it has lost digits, and divide all cells when they become too large."""
        too_large = largest > (math.exp(_LARGEST_LOG) if self.scale is Scale.LOG else _LARGEST)
        if not too_large and self._sum > _LOST * self._full_sum:
            self._full_sum = max(self._full_sum, self._sum)
            return
        most = float(self._cells.max())
        if not math.isfinite(most) or (self.scale is Scale.LINEAR and most <= 0.0):
            # nothing is left: what was observed has contradicted every place
            self._cells[:] = 0.0 if self.scale is Scale.LOG else 1.0
            self._offset = 0.0
        elif self.scale is Scale.LOG:
            self._offset = most
        else:
            self._cells /= most
        self._sum = self._full_sum = self._summed()

    def _summed(self) -> float:
        if self.scale is Scale.LOG:
            return float(np.exp(self._cells.astype(np.float64) - self._offset).sum())
        return float(self._cells.sum(dtype=np.float64))

    def probability(self) -> Array:
        """(rows, columns), sum one."""
        if self.scale is Scale.LOG:
            cells = self._cells.astype(np.float64)
            p: Array = np.exp(cells - cells.max())
        else:
            p = self._cells.astype(np.float64)
        return np.asarray(p / p.sum())

    @property
    def probability_of_detection(self) -> float:
        return 1.0 - self._undetected

    @property
    def mode_ne_m(self) -> tuple[float, float]:
        """Centre of the most probable cell."""
        row, column = np.unravel_index(int(np.argmax(self._cells)), self._cells.shape)
        return self.layout.centre_of((int(row), int(column)))

    def moments(self) -> tuple[Array, Array]:
        p = self.probability() if self.scale is Scale.LOG else self._cells
        layout = self.layout
        total, row1, column1, row2, column2, cross = _index_moments(p)
        mean_row, mean_column = row1 / total, column1 / total
        side = layout.cell_m
        mean = np.array(
            [layout.south_m + (mean_row + 0.5) * side, layout.west_m + (mean_column + 0.5) * side]
        )
        across = cross / total
        between = np.array([[row2 / total, across], [across, column2 / total]])
        variances, axes = np.linalg.eigh(between)
        if variances[0] < _NARROW:
            peak = None if self._coarse else self._peak()
            if peak is not None:
                (mean_row, mean_column), between = peak
                mean = np.array(
                    [layout.south_m + (mean_row + 0.5) * side, layout.west_m + (mean_column + 0.5) * side]
                )
                return mean, side**2 * between
        # the place within a cell counts where a belief is narrower than that, and not once more where the
        # cells themselves show its width
        covariance = side**2 * (axes * np.maximum(variances, 1.0 / 12.0)) @ axes.T
        return mean, np.asarray(covariance)

    def _peak(self) -> tuple[Array, Array] | None:
        """Mean and covariance, in cells, of the Gaussian through the nine cells about the most probable one;
        None: they are none of a Gaussian. A sum over cells is not exact when few of them have a weight.
        """
        row, column = np.unravel_index(int(np.argmax(self._cells)), self._cells.shape)
        part = self._cells[max(0, row - 1) : row + 2, max(0, column - 1) : column + 2].astype(np.float64)
        if part.shape != (3, 3) or (self.scale is Scale.LINEAR and part.min() <= 0.0):
            return None
        log = part if self.scale is Scale.LOG else np.log(part)
        slope = 0.5 * np.array([log[2, 1] - log[0, 1], log[1, 2] - log[1, 0]])
        across = 0.25 * (log[2, 2] - log[2, 0] - log[0, 2] + log[0, 0])
        information = -np.array(
            [
                [log[2, 1] - 2.0 * log[1, 1] + log[0, 1], across],
                [across, log[1, 2] - 2.0 * log[1, 1] + log[1, 0]],
            ]
        )
        if not (information[0, 0] > 0.0 and np.linalg.det(information) > 0.0):
            return None
        covariance = np.linalg.inv(information)
        off = covariance @ slope
        if np.abs(off).max() > 1.0:
            return None
        return np.array([row, column]) + off, covariance

    @property
    def entropy_nats(self) -> float:
        cells, total = (self.probability(), 1.0) if self.scale is Scale.LOG else (self._cells, self._sum)
        return _entropy(cells, _NEGLIGIBLE * total) + 2.0 * math.log(self.layout.cell_m)

    def shares(self, layout: GridLayout) -> Array:
        own = self.layout
        by_rows = _rebinned(
            self.probability(), own.south_m, own.cell_m, layout.south_m, layout.cell_m, layout.rows
        )
        by_columns = _rebinned(
            by_rows.T, own.west_m, own.cell_m, layout.west_m, layout.cell_m, layout.columns
        )
        return np.ascontiguousarray(by_columns.T)


def _rebinned(
    p: Array, start_m: float, side_m: float, to_start_m: float, to_side_m: float, count: int
) -> Array:
    """Sums of cells along the first axis over other intervals: a cell counts by the share that lies in each,
    and what lies outside of all counts in the nearest.
    """
    below = np.vstack((np.zeros((1, p.shape[1])), np.cumsum(p, axis=0)))
    edges = (to_start_m + to_side_m * np.arange(count + 1) - start_m) / side_m
    edges = np.clip(edges, 0.0, len(p))
    edges[0], edges[-1] = 0.0, len(p)
    index = np.minimum(edges.astype(np.int64), len(p) - 1)
    share = (edges - index)[:, None]
    at_edges = below[index] * (1.0 - share) + below[index + 1] * share
    return np.maximum(np.diff(at_edges, axis=0), 0.0)  # rounding


def _spread_by_three(p: Array, variance: float) -> Array:
    """One step of a walk along the first axis, with the weights v/2, 1 - v, v/2; the area's edges reflect."""
    moved: Array = (1.0 - variance) * p
    moved[1:] += 0.5 * variance * p[:-1]
    moved[:-1] += 0.5 * variance * p[1:]
    moved[0] += 0.5 * variance * p[0]
    moved[-1] += 0.5 * variance * p[-1]
    return moved


@kernel
def _entropy(cells: Cells, least: float) -> float:
    """Entropy, nats, of cells that are probabilities times a factor; those below `least` don't count."""
    total, weighted = 0.0, 0.0
    for i in range(cells.shape[0]):
        row, count = cells[i], 0
        for j in range(row.size):
            count += 1 if row[j] > least else 0
        for j in range(row.size if count > 0 else 0):
            if row[j] > least:
                p = float(row[j])
                total += p
                weighted += p * math.log(p)
    return math.log(total) - weighted / total


@kernel
def _middles(first_m: float, cell_m: float, count: int) -> Array:
    """Middles of a row of cells."""
    found = np.empty(count)
    for k in range(count):
        found[k] = first_m + k * cell_m
    return found


@kernel
def _multiply(
    cells: Cells, south_m: float, west_m: float, cell_m: float, s: Array, detections: Array
) -> tuple[float, float, float]:
    """Multiply cells by the likelihood of a frame; returns their sum before and after, and the largest."""
    before, after, largest = 0.0, 0.0, 0.0
    columns = cells.shape[1]
    north, factors = np.empty(columns), np.empty(columns)
    east = _middles(west_m, cell_m, columns)
    for i in range(cells.shape[0]):
        first, last = 0, columns
        while first < last and cells[i, first] == 0.0:
            first += 1
        while first < last and cells[i, last - 1] == 0.0:
            last -= 1
        north[first:last] = south_m + i * cell_m
        likelihoods(north[first:last], east[first:last], s, detections, factors[first:last])
        for j in range(first, last):
            old = float(cells[i, j])
            new = old * factors[j]
            if new < _SMALLEST:
                new = 0.0
            cells[i, j] = new
            before += old
            after += new
            largest = max(largest, new)
    return before, after, largest


@kernel
def _add_logs(
    cells: Cells, south_m: float, west_m: float, cell_m: float, s: Array, detections: Array, offset: float
) -> tuple[float, float, float]:
    """Add the logarithm of the likelihood to cells; returns their sum before and after, and the largest, all
    of exp(cell - offset).
    """
    before, after, largest = 0.0, 0.0, 0.0
    columns = cells.shape[1]
    north, factors = np.empty(columns), np.empty(columns)
    east = _middles(west_m, cell_m, columns)
    for i in range(cells.shape[0]):
        north[:] = south_m + i * cell_m
        likelihoods(north, east, s, detections, factors)
        for j in range(columns):
            likelihood = factors[j]
            if likelihood == 1.0:
                continue
            old = math.exp(cells[i, j] - offset)
            cells[i, j] += math.log(likelihood) if likelihood > 0.0 else -1e30
            new = old * likelihood
            before += old
            after += new
            largest = max(largest, new)
    return before, after, largest


@kernel
def _index_moments(p: Cells) -> tuple[float, float, float, float, float, float]:
    """Sum, sums of p times row and column, and central second moments: of rows, of columns, and of both.

    The sums go along the rows, for all columns at once; their digits suffice for a variance of 1e-8 cells
    squared a thousand cells from the middle.

    Args:
        p: (rows, columns), not negative.
    """
    rows, columns = p.shape
    sums, firsts, seconds = np.zeros(columns), np.zeros(columns), np.zeros(columns)
    middle = 0.5 * (rows - 1)
    for i in range(rows):
        row, off = p[i], i - middle
        for j in range(columns):
            sums[j] += row[j]
        for j in range(columns):
            firsts[j] += off * row[j]
        for j in range(columns):
            seconds[j] += off * off * row[j]
    total, column1 = sums.sum(), 0.0
    for j in range(columns):
        column1 += sums[j] * j
    off_row, mean_column = firsts.sum() / total, column1 / total
    row2 = seconds.sum() - total * off_row * off_row
    column2, cross = 0.0, 0.0
    for j in range(columns):
        off = j - mean_column
        column2 += sums[j] * off * off
        cross += off * (firsts[j] - off_row * sums[j])
    return total, total * (middle + off_row), column1, row2, column2, cross
