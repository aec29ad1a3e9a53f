"""Marginal probabilities of the association of measurements with targets, by loopy belief propagation.

Source: Williams and Lau 2014, "Approximate evaluation of marginal association probabilities with belief
propagation", equations 19 to 22. Exact where no cycle of targets and measurements is ambiguous; otherwise the
probabilities of a target's measurements are a little too sure.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

__all__ = ["association_marginals"]

Array = NDArray[np.float64]

_CHANGE: Final = 1e-6  # of a message between two rounds at which the propagation has converged
_ROUNDS: Final = 200


def association_marginals(odds: Array, new: Array) -> tuple[Array, Array]:
    """Marginals over all ways to give each target at most one measurement, and each measurement at most one
    target.

    Args:
        odds: (n, m) weight of "measurement j is of target i" against "target i has no measurement".
        new: (m,) above 0, weight of "measurement j is of none of the targets".

    Returns:
        (n, m) probability of each pair, and (m,) of "of none of the targets".
    """
    pairs = np.zeros(odds.shape)
    if not pairs.size:
        return pairs, np.ones(len(new))
    _propagate(np.ascontiguousarray(odds / new), pairs)
    return pairs, np.maximum(0.0, 1.0 - pairs.sum(axis=0))


@kernel
def _propagate(odds: Array, pairs: Array) -> None:
    """Write the probability of each pair; `odds` are against "target i has no measurement, and measurement j
    no target".
    """
    targets, measurements = odds.shape
    to_target = np.ones((targets, measurements))  # messages of the measurements
    to_measurement = np.zeros((targets, measurements))
    for _ in range(_ROUNDS):
        for i in range(targets):
            total = 1.0
            for j in range(measurements):
                total += odds[i, j] * to_target[i, j]
            for j in range(measurements):
                to_measurement[i, j] = odds[i, j] / (total - odds[i, j] * to_target[i, j])
        change = 0.0
        for j in range(measurements):
            total = 1.0
            for i in range(targets):
                total += to_measurement[i, j]
            for i in range(targets):
                message = 1.0 / (total - to_measurement[i, j])
                change = max(change, abs(message - to_target[i, j]))
                to_target[i, j] = message
        if change < _CHANGE:
            break
    for i in range(targets):
        total = 1.0
        for j in range(measurements):
            total += odds[i, j] * to_target[i, j]
        for j in range(measurements):
            pairs[i, j] = odds[i, j] * to_target[i, j] / total
