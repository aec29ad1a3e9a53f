"""Metrics of estimates: errors, consistency, calibration, and the distance between sets of targets."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.association import assign

__all__ = [
    "Gospa",
    "calibration_error",
    "crps",
    "gospa",
    "inside_ellipse",
    "mean_square",
    "nees",
    "ospa",
    "rms",
]

Array = NDArray[np.float64]


def mean_square(values: Array) -> float:
    """Mean of the squares of all elements; NaN when there are none."""
    return float(np.mean(values * values)) if values.size else math.nan


def rms(values: Array) -> float:
    """Root of the mean square of all elements; NaN when there are none."""
    return math.sqrt(mean_square(values)) if values.size else math.nan


def nees(errors: Array, covariances: Array) -> Array:
    """Normalized estimation error squared, e' P^-1 e (Bar-Shalom, Li and Kirubarajan 2001, section 5.4). Its
    mean is n for a consistent estimator.

    Args:
        errors: (..., n) estimate minus truth.
        covariances: (..., n, n) the estimator's own.
    """
    solved = np.linalg.solve(covariances, errors[..., None])[..., 0]
    found: Array = np.sum(errors * solved, axis=-1)
    return found


def inside_ellipse(errors: Array, covariances: Array, probability: float = 0.95) -> float:
    """Share of errors in the plane that are inside the estimator's own ellipse; consistent: `probability`.

    Args:
        errors, covariances: (n, 2), (n, 2, 2).
        probability: probability of the ellipse, in 0..1; in the plane its NEES is -2 ln(1 - p).
    """
    return float(np.mean(nees(errors, covariances) <= -2.0 * math.log(1.0 - probability)))


def crps(values: Array, weights: Array, truth: float) -> float:
    """Continuous ranked probability score of weighted samples, in their unit: the mean error of a
    deterministic estimate, less half of the mean distance between samples (Gneiting and Raftery 2007,
    equation 21).

    Args:
        values, weights: (n,) samples and their weights, which need not be normalized.
        truth: true value.
    """
    order = np.argsort(values)
    x, w = values[order], weights[order] / np.sum(weights)
    above = np.cumsum(w)
    # the integral of (F(x) - 1{x >= truth})^2 between samples gives E|X - X'| = 2 sum F (1 - F) dx
    spread = float(np.sum(above[:-1] * (1.0 - above[:-1]) * np.diff(x)))
    return float(np.sum(w * np.abs(x - truth))) - spread


def calibration_error(probabilities: Array, happened: NDArray[np.bool_], bins: int = 10) -> float:
    """Expected calibration error: mean difference between stated probability and frequency over equal bins of
    probability, weighted by the number of statements in each (Naeini, Cooper and Hauskrecht 2015).

    Args:
        probabilities, happened: (n,) stated probabilities of events, and whether each happened.
        bins: number of bins.
    """
    which = np.minimum((probabilities * bins).astype(np.int64), bins - 1)
    excess = np.bincount(which, weights=probabilities - happened, minlength=bins)
    return float(np.sum(np.abs(excess)) / len(probabilities))


@dataclass(frozen=True, slots=True, kw_only=True)
class Gospa:
    """GOSPA of a set of estimates (alpha = 2), and its parts.

    Attributes:
        distance: the metric, in the unit of the positions.
        localization: part of the p-th power that the errors of assigned estimates make.
        missed, false: number of targets without estimate, of estimates without target.
    """

    distance: float
    localization: float
    missed: int
    false: int


def ospa(estimates: Array, targets: Array, *, cutoff: float, order: float = 1.0) -> float:
    """Optimal subpattern assignment metric (Schuhmacher, Vo and Vo 2008, equation 3).

    Args:
        estimates, targets: (n, d), (m, d) positions.
        cutoff: largest distance; the penalty of a missing or an additional estimate.
        order: p of the metric.
    """
    few, many = sorted((estimates, targets), key=len)
    if not len(many):
        return 0.0
    cost = np.minimum(_distances(few, many), cutoff) ** order
    chosen = float(cost[np.arange(len(few)), assign(cost)].sum()) if len(few) else 0.0
    return float(((chosen + cutoff**order * (len(many) - len(few))) / len(many)) ** (1.0 / order))


def gospa(estimates: Array, targets: Array, *, cutoff: float, order: float = 2.0) -> Gospa:
    """Generalized OSPA with alpha = 2 (Rahmathullah, Garcia-Fernandez and Svensson 2017, equation 3): not
    normalized by the number of targets; a target that is missed and an estimate that is false cost cutoff^p /
    2 each.

    Args:
        estimates, targets: (n, d), (m, d) positions.
        cutoff: a pair farther apart counts as one missed target and one false estimate.
        order: p of the metric.
    """
    few, many = sorted((estimates, targets), key=len)
    assigned, localization = 0, 0.0
    if len(few):
        cost = np.minimum(_distances(few, many), cutoff) ** order
        chosen = cost[np.arange(len(few)), assign(cost)]
        near = chosen < cutoff**order
        assigned, localization = int(np.count_nonzero(near)), float(chosen[near].sum())
    missed, false = len(targets) - assigned, len(estimates) - assigned
    total = localization + 0.5 * cutoff**order * (missed + false)
    return Gospa(
        distance=float(total ** (1.0 / order)), localization=localization, missed=missed, false=false
    )


def _distances(few: Array, many: Array) -> Array:
    found: Array = np.linalg.norm(few[:, None, :] - many[None, :, :], axis=-1)
    return found
