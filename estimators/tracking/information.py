"""Mutual information between the targets and the event that a scan detects at least one of them.

The event is that of Dames and Kumar 2015, "Autonomous localization of an unknown number of targets without
data association using teams of mobile sensors". For a Poisson random finite set the information has a closed
form, derived in docs/multi_target.md: with the intensity D and the probability of detection p,

    I = h(p0) + E[P0 ln P0] + E[(1 - P0) ln(1 - P0)],    P0 = product of (1 - p(x)) over the targets,
    p0 = E[P0] = exp(-int p D),    E[P0 ln P0] = p0 int (1 - p) ln(1 - p) D,
    E[(1 - P0) ln(1 - P0)] = -p0 + sum over k >= 2 of E[P0^k] / (k (k - 1)),    E[P0^k] = exp(-int (1 - (1 -
    p)^k) D)

h is the entropy of a binary event. The sum is exact to k = 16. Beyond, it is an integral (midpoint rule with
its first correction) over 1 / k, by Boole's rule in each octave, and ends where (1 - p)^k has vanished.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.range_bearing import FORWARD, GAIN, REACH, RIGHT
from flightsim.foundation.kernels import kernel

__all__ = ["condensed", "detection_information", "detections_at", "information_at"]

Array = NDArray[np.float64]

_EXACT: Final = 16  # the terms up to this k are summed one by one
_START: Final = _EXACT + 0.5
_BASE: Final = _EXACT + 2  # first node of the octaves; those before it are k = 0..17
_MOST_OCTAVES: Final = 24
_UNDETECTED: Final = 30.0  # (1 - p)^k < exp(-30) counts as 0
_LATER: Final = (8.0 / 7.0, 4.0 / 3.0, 8.0 / 5.0)  # k of the inner nodes: equal steps of 1 / k in an octave
_BOOLE: Final = (14.0 / 45.0, 64.0 / 45.0, 24.0 / 45.0, 64.0 / 45.0, 14.0 / 45.0)
_MIDPOINT: Final = 1.0 / 24.0
_LEAST: Final = 1e-9  # probabilities of detection below this count as 0


def detection_information(mass: Array, probability: Array) -> float:
    """Mutual information, nats, between a Poisson set of targets and the event of a detection.

    Args:
        mass: (n,) expected number of targets at each point of the intensity.
        probability: (n,) probability to detect a target there, 0..1.
    """
    return float(_information(np.ascontiguousarray(mass), np.ascontiguousarray(probability)))


def information_at(north_m: Array, east_m: Array, mass: Array, sensor: Array, viewpoints: Array) -> Array:
    """Mutual information of a scan from each viewpoint, nats, (v,).

    Args:
        north_m, east_m, mass: (n,) points of the intensity.
        sensor: `RangeBearingSensor.values`.
        viewpoints: (v, 3) north, east, heading.
    """
    found = np.empty(len(viewpoints))
    _information_at(
        np.ascontiguousarray(north_m),
        np.ascontiguousarray(east_m),
        np.ascontiguousarray(mass),
        sensor,
        np.ascontiguousarray(viewpoints),
        found,
    )
    return found


def detections_at(north_m: Array, east_m: Array, mass: Array, sensor: Array, viewpoints: Array) -> Array:
    """Expected number of detections in a scan from each viewpoint, (v,): int p D.

    Args:
        north_m, east_m, mass: (n,) points of the intensity.
        sensor: `RangeBearingSensor.values`.
        viewpoints: (v, 3) north, east, heading.
    """
    found = np.empty(len(viewpoints))
    _detections_at(north_m, east_m, mass, sensor, np.ascontiguousarray(viewpoints), found)
    return found


@kernel
def _detections_at(
    north_m: Array, east_m: Array, mass: Array, sensor: Array, viewpoints: Array, found: Array
) -> None:
    gain, inverse_f, inverse_r = sensor[GAIN], 1.0 / sensor[FORWARD], 1.0 / sensor[RIGHT]
    reach_squared = sensor[REACH] * sensor[REACH]
    for v in range(found.size):
        cosine, sine = math.cos(viewpoints[v, 2]), math.sin(viewpoints[v, 2])
        total = 0.0
        for i in range(mass.size):
            n, e = north_m[i] - viewpoints[v, 0], east_m[i] - viewpoints[v, 1]
            if n * n + e * e > reach_squared:
                continue
            forward, right = (cosine * n + sine * e) * inverse_f, (cosine * e - sine * n) * inverse_r
            total += mass[i] * gain * math.exp(-0.5 * math.sqrt(forward * forward + right * right))
        found[v] = total


@kernel
def _information_at(
    north_m: Array, east_m: Array, mass: Array, sensor: Array, viewpoints: Array, found: Array
) -> None:
    gain, inverse_f, inverse_r = sensor[GAIN], 1.0 / sensor[FORWARD], 1.0 / sensor[RIGHT]
    reach_squared = sensor[REACH] * sensor[REACH]
    probability, kept = np.empty(mass.size), np.empty(mass.size)
    for v in range(found.size):
        cosine, sine = math.cos(viewpoints[v, 2]), math.sin(viewpoints[v, 2])
        count = 0
        for i in range(mass.size):
            n, e = north_m[i] - viewpoints[v, 0], east_m[i] - viewpoints[v, 1]
            if n * n + e * e > reach_squared:
                continue
            forward, right = (cosine * n + sine * e) * inverse_f, (cosine * e - sine * n) * inverse_r
            probability[count] = gain * math.exp(-0.5 * math.sqrt(forward * forward + right * right))
            kept[count] = mass[i]
            count += 1
        found[v] = _information(kept[:count], probability[:count])


@kernel
def _information(mass: Array, probability: Array) -> float:
    least, detectable = 1.0, 0.0
    for i in range(mass.size):
        if mass[i] > 0.0 and probability[i] > _LEAST:
            least = min(least, probability[i])
            detectable += mass[i]
    if not detectable > 0.0:
        return 0.0
    # octaves until the smallest probability has left nothing undetected
    octaves = 1
    while octaves < _MOST_OCTAVES and least * _START * 2.0**octaves < _UNDETECTED:
        octaves += 1
    nodes = _BASE + 4 * octaves + 1
    kept = np.zeros(nodes)  # int (1 - p)^k D at each node: k = 0..17, then the octaves from 16.5
    power = np.empty(nodes)
    log_term = 0.0
    for i in range(mass.size):
        w, p = mass[i], probability[i]
        if not (w > 0.0 and p > _LEAST):
            continue
        q = 1.0 - p
        log_q = math.log(q) if q > 0.0 else -math.inf
        if q > 0.0:
            log_term += w * q * log_q
        power[0] = 1.0
        for k in range(1, _BASE):
            power[k] = power[k - 1] * q
        power[_BASE] = math.exp(_START * log_q)
        for inner in range(3):
            power[_BASE + 1 + inner] = math.exp(_START * _LATER[inner] * log_q)
        for node in range(_BASE + 4, nodes):  # one octave on: the square
            power[node] = power[node - 4] * power[node - 4]
        for node in range(1, nodes):
            kept[node] += w * power[node]
    return _from_moments(kept, detectable, log_term, octaves)


@kernel
def _from_moments(kept: Array, total: float, log_term: float, octaves: int) -> float:
    """The information from int (1 - p)^k D at the nodes of k, and int (1 - p) ln(1 - p) D."""
    none = math.exp(kept[1] - total)
    if none >= 1.0:
        return 0.0
    entropy = -none * math.log(none) - (1.0 - none) * math.log1p(-none) if none > 0.0 else 0.0
    series = 0.0
    for k in range(2, _EXACT + 1):
        series += math.exp(kept[k] - total) / (k * (k - 1.0))
    # beyond: the integral from 16.5, Boole's rule in each octave, and the correction of the midpoint rule
    slope = math.exp(kept[_EXACT + 1] - total) / (_EXACT * (_EXACT + 1.0))
    slope -= math.exp(kept[_EXACT] - total) / (_EXACT * (_EXACT - 1.0))
    series += _MIDPOINT * slope
    first = _START
    for octave in range(octaves):
        node, start = _BASE + 4 * octave, 1.0 / first
        step = 0.125 * start
        part = 0.0
        for at in range(5):  # dk / (k (k - 1)) = du / (1 - u), u = 1 / k
            part += _BOOLE[at] * math.exp(kept[node + at] - total) / (1.0 - start + at * step)
        series += step * part
        first *= 2.0
    series -= math.exp(-total) * math.log1p(-1.0 / first)
    return max(0.0, entropy + none * log_term - none + series)


def condensed(north_m: Array, east_m: Array, mass: Array, *, cell_m: float) -> tuple[Array, Array, Array]:
    """The masses summed up in square cells, at their centres of mass: fewer points for a sensor whose
    probability of detection hardly changes within a cell.

    Args:
        north_m, east_m, mass: (n,) points of an intensity.
        cell_m: side of a cell.
    """
    if not len(mass):
        return north_m, east_m, mass
    row, column = np.floor(north_m / cell_m).astype(np.int64), np.floor(east_m / cell_m).astype(np.int64)
    row -= row.min()
    column -= column.min()
    cell = row * (int(column.max()) + 1) + column
    _, number = np.unique(cell, return_inverse=True)
    total: Array = np.bincount(number, weights=mass).astype(np.float64)
    kept = total > 0.0
    total = total[kept]
    north = np.bincount(number, weights=mass * north_m)[kept] / total
    east = np.bincount(number, weights=mass * east_m)[kept] / total
    return north, east, total
