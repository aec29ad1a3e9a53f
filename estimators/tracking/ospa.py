"""Distances between a set of estimates and the set of targets: OSPA and GOSPA."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.association import assign

Array = NDArray[np.float64]


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
