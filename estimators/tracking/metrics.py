"""Metrics of estimates: errors, consistency and calibration."""

import math

import numpy as np
from numpy.typing import NDArray

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

    Returns:
        the error, 0..1; NaN without a statement.
    """
    if not len(probabilities):
        return math.nan
    which = np.minimum((probabilities * bins).astype(np.int64), bins - 1)
    excess = np.bincount(which, weights=probabilities - happened, minlength=bins)
    return float(np.sum(np.abs(excess)) / len(probabilities))
