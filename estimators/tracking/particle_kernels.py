"""Kernels of the particles of a target's place: their density, new ones, and the next generation."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.resampling import systematic
from flightsim.foundation.kernels import kernel

__all__ = ["DRAWS", "add_particles", "count_near", "densities", "reflect", "regenerate", "spiral"]

Array = NDArray[np.float64]
Draws = NDArray[np.uint16]
Bins = NDArray[np.int32]
Box = tuple[float, float, float, float]  # south, west, and bins per metre along each axis

DRAWS: Final = 4
"""Numbers of 16 bits for each particle of a generation, two for each axis: one of the generator's."""

_BINS: Final = 32  # along each axis, over the particles: for their density
_BOX_SIGMAS: Final = 4.0  # a few particles farther off would make the bins wide
_NEAR: Final = 9.0  # squared distance
_GATE: Final = 80.0  # squared distance beyond which a Gaussian is 0
_SPREAD: Final = 0.4  # of the distance to neighbours, per axis; a uniform cell has a deviation of 0.29
_DRAW_UNIT: Final = math.sqrt(6.0) / 2.0**16  # the sum of two draws has the standard deviation 1 in it
_GOLDEN_RAD: Final = math.pi * (3.0 - math.sqrt(5.0))


@kernel
def reflect(places: Array, rates: Array, low: Array, high: Array) -> None:
    """Particles that have left the area come back, as at a wall."""
    for axis in range(places.shape[0]):
        span = high[axis] - low[axis]
        for i in range(places.shape[1]):
            past = places[axis, i] - low[axis]
            if past < 0.0 or past > span:
                past = past % (2.0 * span)
                if past > span:
                    past = 2.0 * span - past
                    rates[axis, i] = -rates[axis, i]
                places[axis, i] = low[axis] + past


@kernel
def _box_of(places: Array, weights: Array) -> Box:
    """The bins over the particles. Both axes in one loop: each sum waits for its last addition."""
    north, east = places[0], places[1]
    total, mean_n, mean_e, square_n, square_e = 0.0, 0.0, 0.0, 0.0, 0.0
    low_n, high_n, low_e, high_e = north[0], north[0], east[0], east[0]
    for i in range(weights.size):
        low_n, high_n = min(low_n, north[i]), max(high_n, north[i])
        low_e, high_e = min(low_e, east[i]), max(high_e, east[i])
        total += weights[i]
        mean_n += weights[i] * north[i]
        mean_e += weights[i] * east[i]
    mean_n, mean_e = mean_n / total, mean_e / total
    for i in range(weights.size):
        square_n += weights[i] * (north[i] - mean_n) ** 2
        square_e += weights[i] * (east[i] - mean_e) ** 2
    reach_n, reach_e = _BOX_SIGMAS * math.sqrt(square_n / total), _BOX_SIGMAS * math.sqrt(square_e / total)
    low_n, high_n = max(low_n, mean_n - reach_n), min(high_n, mean_n + reach_n)
    low_e, high_e = max(low_e, mean_e - reach_e), min(high_e, mean_e + reach_e)
    least_m = 1e-6 * _BINS
    return low_n, low_e, _BINS / max(high_n - low_n, least_m), _BINS / max(high_e - low_e, least_m)


@kernel
def _bins_of(places: Array, box: Box) -> Bins:
    """The bins of places (n,); beyond the box the nearest."""
    north, east = places[0], places[1]
    south, west, per_n, per_e = box
    rows, columns = np.empty(north.size), np.empty(north.size)
    out = np.empty(north.size, np.int32)
    for i in range(north.size):
        row = (north[i] - south) * per_n
        row = row if row > 0.0 else 0.0
        rows[i] = row if row < _BINS - 1.0 else _BINS - 1.0
    for i in range(north.size):
        column = (east[i] - west) * per_e
        column = column if column > 0.0 else 0.0
        columns[i] = column if column < _BINS - 1.0 else _BINS - 1.0
    for i in range(north.size):
        out[i] = np.int32(rows[i]) * np.int32(_BINS) + np.int32(columns[i])
    return out


@kernel
def _numbers(bins: Bins) -> Array:
    """Number of the particles in each bin."""
    number = np.zeros(_BINS * _BINS)
    for k in bins:
        number[k] += 1.0
    return number


@kernel
def _probabilities(bins: Bins, weights: Array) -> Array:
    """Sum of the weights in each bin."""
    probability = np.zeros(_BINS * _BINS)
    for i in range(weights.size):
        probability[bins[i]] += weights[i]
    return probability


@kernel
def _between(north: float, east: float, bins: Array, box: Box) -> float:
    """Value of the bins at a place, linear between their middles; 0 beyond the box."""
    row, column = (north - box[0]) * box[2], (east - box[1]) * box[3]
    if not (0.0 <= row <= _BINS and 0.0 <= column <= _BINS):
        return 0.0
    row, column = min(_BINS - 1.0, max(0.0, row - 0.5)), min(_BINS - 1.0, max(0.0, column - 0.5))
    r, c = min(_BINS - 2, int(row)), min(_BINS - 2, int(column))
    u, v, k = row - r, column - c, r * _BINS + c
    near = (1.0 - v) * bins[k] + v * bins[k + 1]
    return (1.0 - u) * near + u * ((1.0 - v) * bins[k + _BINS] + v * bins[k + _BINS + 1])


@kernel
def densities(places: Array, weights: Array, out: Array) -> None:
    """Probability per square metre about each particle, (n,): of its bin."""
    box = _box_of(places, weights)
    bins = _bins_of(places, box)
    probability = _probabilities(bins, weights)
    for i in range(weights.size):
        out[i] = max(1e-300, probability[bins[i]]) * box[2] * box[3]


@kernel
def _inverted(gaussians: Array) -> Array:
    """(m, 6) of Gaussians (m, 5) with a covariance: north, east, the inverse nn, ne, ee, and the density in
    the middle.
    """
    out = np.empty((gaussians.shape[0], 6))
    for k, (north, east, nn, ne, ee) in enumerate(gaussians):
        scale = 1.0 / (nn * ee - ne * ne)
        out[k, 0], out[k, 1] = north, east
        out[k, 2], out[k, 3], out[k, 4] = scale * ee, -scale * ne, scale * nn
        out[k, 5] = math.sqrt(scale) / math.tau
    return out


@kernel
def _squared(north: float, east: float, g: Array) -> float:
    """Squared distance of a place from the middle of an inverted Gaussian."""
    n, e = north - g[0], east - g[1]
    return n * n * g[2] + 2.0 * n * e * g[3] + e * e * g[4]


@kernel
def count_near(places: Array, gaussians: Array) -> int:
    """Number of places within three standard deviations of the Gaussian that has the fewest."""
    least = places.shape[1]
    for g in _inverted(gaussians):
        count = 0
        for i in range(places.shape[1]):
            if _squared(places[0, i], places[1, i], g) < _NEAR:
                count += 1
        least = min(least, count)
    return least


@kernel
def _density_of(places: Array, inverted: Array, drawn: int) -> Array:
    """Number per square metre at places of what is drawn from inverted Gaussians, equally many from each."""
    density = np.zeros(places.shape[1])
    near = np.empty(density.size, np.int64)
    for g in inverted:
        scale = drawn * g[5] / inverted.shape[0]
        count = 0
        for i in range(density.size):  # apart from the exponentials, which the compiler computes for all else
            if _squared(places[0, i], places[1, i], g) < _GATE:
                near[count] = i
                count += 1
        for i in near[:count]:
            density[i] += scale * math.exp(-0.5 * _squared(places[0, i], places[1, i], g))
    return density


def spiral(count: int, turn_rad: float) -> Array:
    """(2, n) places that stand for a Gaussian of unit variance: along a spiral of the golden angle, that is
    turned by an angle.
    """
    places, cosine, sine = _unturned(count), math.cos(turn_rad), math.sin(turn_rad)
    return np.array([[cosine, -sine], [sine, cosine]]) @ places


@lru_cache(maxsize=4)
def _unturned(count: int) -> Array:
    k = np.arange(count)
    radius, angle = np.sqrt(-2.0 * np.log((k + 0.5) / count)), _GOLDEN_RAD * k
    return np.stack((radius * np.cos(angle), radius * np.sin(angle)))


@kernel
def add_particles(
    places: Array,
    rates: Array,
    weights: Array,
    gaussians: Array,
    places_of_unit: Array,
    new_places: Array,
    new_rates: Array,
    new_weights: Array,
) -> None:
    """Add particles that are spread over Gaussians, along a spiral of the golden angle, so that each stands
    for a cell of its own: random ones would be in lumps. Where both kinds are, each has the weight of a
    particle that was drawn from the mixture of their densities (balance heuristic, Veach and Guibas 1995), so
    that the probability of a place stays what it was.

    Args:
        places, rates: (2, n).
        weights: (n,), sum one; become those beside the new particles.
        gaussians: (m, 5) north, east, covariance nn, ne, ee.
        places_of_unit: (2, k) places that stand for a Gaussian of unit variance (`spiral`).
        new_places, new_rates, new_weights: (2, k) and (k,), get the new particles.
    """
    count, drawn = weights.size, new_weights.size
    box = _box_of(places, weights)
    per_area = box[2] * box[3]
    bins = _bins_of(places, box)
    number, probability = _numbers(bins), _probabilities(bins, weights)
    inverted = _inverted(gaussians)
    for j in range(gaussians.shape[0]):
        g = gaussians[j]
        root = math.sqrt(g[2])
        across = g[3] / root
        rest = math.sqrt(max(0.0, g[4] - across * across))
        for k in range(j, drawn, gaussians.shape[0]):
            one, other = places_of_unit[0, k], places_of_unit[1, k]
            new_places[0, k] = g[0] + root * one
            new_places[1, k] = g[1] + across * one + rest * other
    for k in range(drawn):
        like = k * count // drawn
        new_rates[0, k], new_rates[1, k] = rates[0, like], rates[1, like]
    more = _density_of(places, inverted, drawn)
    for i in range(count):
        if more[i] > 0.0:
            dense = per_area * _between(places[0, i], places[1, i], number, box)
            if dense > 0.0:
                weights[i] *= dense / (dense + more[i])
    more = _density_of(new_places, inverted, drawn)
    for k in range(drawn):
        dense = per_area * _between(new_places[0, k], new_places[1, k], number, box)
        new_weights[k] = per_area * _between(new_places[0, k], new_places[1, k], probability, box)
        new_weights[k] /= dense + more[k]


@kernel
def regenerate(
    places: Array,
    rates: Array,
    weights: Array,
    start: float,
    draws: Draws,
    new_places: Array,
    new_rates: Array,
) -> None:
    """Resample, and spread each copy by its share of the distance to the neighbours of its original: the root
    of a bin's area for each particle in it. The spread has a triangular density along each axis, close to the
    optimal kernel (Musso, Oudjane and Le Gland 2001), and costs a tenth of a Gaussian's.

    Args:
        places, rates: (2, n).
        weights: (n,), sum one.
        start: uniform in 0..1.
        draws: (m, 4) uniform in 0..65535.
        new_places, new_rates: (2, m), the result.
    """
    count = new_places.shape[1]
    box = _box_of(places, weights)
    bins = _bins_of(places, box)
    spreads = _numbers(bins)
    for k in range(spreads.size):
        if spreads[k] > 0.0:
            spreads[k] = _SPREAD * _DRAW_UNIT * math.sqrt(1.0 / (box[2] * box[3] * spreads[k]))
    chosen = np.empty(count, np.int64)
    systematic(weights, start, chosen)
    for i in range(count):
        one = chosen[i]
        spread = spreads[bins[one]]
        for axis in range(2):
            off = float(draws[i, 2 * axis]) + float(draws[i, 2 * axis + 1]) - 65535.0
            new_places[axis, i] = places[axis, one] + spread * off
            new_rates[axis, i] = rates[axis, one]
