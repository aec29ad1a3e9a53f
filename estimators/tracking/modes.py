"""Modes of a particle belief: the separate groups of particles, each with its weight.

The density is a smoothed histogram. Its cells are visited from the densest down; a cell joins the group of a
neighbour, and two groups that meet become one unless the lower peak stands out over their saddle (the
persistence of Chazal, Guibas, Oudot and Skraba 2013, "Persistence-based clustering in Riemannian manifolds").
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ANGLE_BINS: Final = 60
_MOST_BINS: Final = 40
_LEAST_WEIGHT: Final = 0.02  # of the belief; smaller groups are left out
_STANDS_OUT: Final = 1.6  # peak over saddle of a group that is a mode of its own
_EMPTY: Final = 1e-3  # of the highest density: cells below it belong to no group


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """One group of particles.

    Attributes:
        weight: its share of the belief.
        mean: (x, y, angle).
        sigmas: their standard deviations.
        covariance_xy: covariance of x and y.
    """

    weight: float
    mean: tuple[float, float, float]
    sigmas: tuple[float, float, float]
    covariance_xy: float

    def moved(self, mean: tuple[float, float], turn_rad: float) -> "Mode":
        """The mode after a rotation from x to y.

        Args:
            mean: mean of x and y after it.
            turn_rad: angle of the rotation.
        """
        cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
        x2, y2, xy = self.sigmas[0] ** 2, self.sigmas[1] ** 2, self.covariance_xy
        twice = 2.0 * cosine * sine * xy
        return Mode(
            weight=self.weight,
            mean=(*mean, math.remainder(self.mean[2] + turn_rad, math.tau)),
            sigmas=(
                math.sqrt(max(0.0, cosine * cosine * x2 + sine * sine * y2 - twice)),
                math.sqrt(max(0.0, sine * sine * x2 + cosine * cosine * y2 + twice)),
                self.sigmas[2],
            ),
            covariance_xy=cosine * sine * (x2 - y2) + (cosine * cosine - sine * sine) * xy,
        )


def find_modes(points: Array, weights: Array, *, least_cell: float = 5.0) -> list[Mode]:
    """The modes of weighted particles in the plane with an angle, the heaviest first.

    Args:
        points: (n, 3) x, y and an angle in rad, -pi..pi.
        weights: (n,), sum one.
        least_cell: smallest side of a cell in x and y.
    """
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    counts = np.clip(np.ceil((high - low) / least_cell), 1, _MOST_BINS).astype(np.int64)
    sides = np.maximum((high - low) / counts, 1e-9)
    cells = np.empty((len(points), 3), dtype=np.int64)
    cells[:, :2] = np.minimum((points[:, :2] - low) / sides, counts - 1)
    cells[:, 2] = np.floor((points[:, 2] + math.pi) * _ANGLE_BINS / math.tau).astype(np.int64) % _ANGLE_BINS
    shape = (int(counts[0]) + 2, int(counts[1]) + 2, _ANGLE_BINS)
    flat = np.ravel_multi_index((cells[:, 0] + 1, cells[:, 1] + 1, cells[:, 2]), shape)
    filled: Array = np.bincount(flat, weights=weights, minlength=math.prod(shape)).astype(np.float64)
    density = _smooth(filled.reshape(shape))
    group = _groups(density)[flat]
    found = []
    for number in np.unique(group[group >= 0]):
        inside = group == number
        weight = float(weights[inside].sum())
        if weight >= _LEAST_WEIGHT:
            found.append(_mode_of(points[inside], weights[inside] / weight, weight))
    return sorted(found, key=lambda mode: -mode.weight)


def _smooth(density: Array) -> Array:
    """Binomial smoothing over neighbours; the angle wraps around, the edges in x and y are empty."""
    for axis in range(3):
        density = 0.5 * density + 0.25 * (np.roll(density, 1, axis) + np.roll(density, -1, axis))
    return density


def _groups(density: Array) -> Indices:
    """Number of the group of each cell of the flattened histogram; -1: none."""
    values = density.ravel()
    order = np.flatnonzero(values > _EMPTY * values.max())
    order = order[np.argsort(-values[order], kind="stable")]
    parent = np.full(values.size, -1, dtype=np.int64)
    _join(order, values, density.shape[0], density.shape[1], density.shape[2], parent)
    return parent


@kernel
def _join(order: Indices, heights: Array, rows: int, columns: int, angles: int, parent: Indices) -> None:
    """Join cells to groups, from the densest down; a group has the number of its peak.

    Args:
        order: cells, the densest first.
        heights: (rows * columns * angles,) density.
        rows, columns, angles: of the histogram.
        parent: (rows * columns * angles,) -1 everywhere; after it, the group of each cell.
    """
    roots = np.empty(26, dtype=np.int64)  # one for each neighbour
    for cell in order:
        row, column, angle = cell // (columns * angles), cell // angles % columns, cell % angles
        count = 0
        best = -1
        for down in range(-1, 2):
            for right in range(-1, 2):
                if not (0 <= row + down < rows and 0 <= column + right < columns):
                    continue
                for turn in range(-1, 2):
                    turned = (angle + turn) % angles
                    beside = ((row + down) * columns + column + right) * angles + turned
                    if parent[beside] < 0:
                        continue
                    peak = _root(parent, beside)
                    roots[count] = peak
                    count += 1
                    higher = best < 0 or heights[peak] > heights[best]
                    if higher or (heights[peak] == heights[best] and peak < best):
                        best = peak
        parent[cell] = cell if best < 0 else best
        for k in range(count):
            if roots[k] != best and heights[roots[k]] < _STANDS_OUT * heights[cell]:
                parent[roots[k]] = best
    for cell in order:
        parent[cell] = _root(parent, cell)


@kernel
def _root(parent: Indices, cell: int) -> int:
    """The peak of a cell's group; the way to it becomes shorter."""
    while parent[cell] != cell:
        parent[cell] = parent[parent[cell]]
        cell = parent[cell]
    return cell


def _mode_of(points: Array, weights: Array, weight: float) -> Mode:
    x, y = (float(weights @ points[:, k]) for k in (0, 1))
    mean_angle = math.atan2(float(weights @ np.sin(points[:, 2])), float(weights @ np.cos(points[:, 2])))
    off = np.angle(np.exp(1j * (points[:, 2] - mean_angle)))
    spreads = (points[:, 0] - x, points[:, 1] - y, off)
    sigmas = tuple(math.sqrt(float(weights @ (spread * spread))) for spread in spreads)
    return Mode(
        weight=weight,
        mean=(x, y, mean_angle),
        sigmas=(sigmas[0], sigmas[1], sigmas[2]),
        covariance_xy=float(weights @ (spreads[0] * spreads[1])),
    )
