"""Kernels of the particles of a target's place: their density, new ones, and the next generation."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.resampling import systematic
from flightsim.foundation.kernels import kernel

__all__ = ["DRAWS", "add_particles", "count_near", "densities", "reflect", "regenerate"]

Array = NDArray[np.float64]
Draws = NDArray[np.uint16]
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
    """The bins over the particles."""
    box = (0.0, 0.0, 0.0, 0.0)
    for axis in range(2):
        total, mean, square = 0.0, 0.0, 0.0
        low = high = places[axis, 0]
        for i in range(weights.size):
            x = places[axis, i]
            low, high = min(low, x), max(high, x)
            total += weights[i]
            mean += weights[i] * x
        mean /= total
        for i in range(weights.size):
            square += weights[i] * (places[axis, i] - mean) ** 2
        reach = _BOX_SIGMAS * math.sqrt(square / total)
        low, high = max(low, mean - reach), min(high, mean + reach)
        per_m = _BINS / max(high - low, 1e-6 * _BINS)
        box = (low, box[1], per_m, box[3]) if axis == 0 else (box[0], low, box[2], per_m)
    return box


@kernel
def _bin_of(north: float, east: float, box: Box) -> int:
    """The bin of a place; beyond the box the nearest."""
    row = min(_BINS - 1.0, max(0.0, (north - box[0]) * box[2]))
    column = min(_BINS - 1.0, max(0.0, (east - box[1]) * box[3]))
    return int(row) * _BINS + int(column)


@kernel
def _binned(places: Array, weights: Array, box: Box) -> tuple[Array, Array]:
    """Number of the particles in each bin, and the sum of their weights."""
    number, probability = np.zeros(_BINS * _BINS), np.zeros(_BINS * _BINS)
    for i in range(weights.size):
        k = _bin_of(places[0, i], places[1, i], box)
        number[k] += 1.0
        probability[k] += weights[i]
    return number, probability


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
    _, bins = _binned(places, weights, box)
    for i in range(weights.size):
        out[i] = max(1e-300, bins[_bin_of(places[0, i], places[1, i], box)]) * box[2] * box[3]


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
def add_particles(
    places: Array,
    rates: Array,
    weights: Array,
    gaussians: Array,
    turn_rad: float,
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
        weights: (n,), sum one.
        gaussians: (m, 5) north, east, covariance nn, ne, ee.
        turn_rad: by which the spiral is turned.
        new_places, new_rates, new_weights: (2, n + k) and (n + k,), the result.
    """
    count, drawn = weights.size, new_weights.size - weights.size
    box = _box_of(places, weights)
    per_area = box[2] * box[3]
    number, probability = _binned(places, weights, box)
    new_places[:, :count], new_rates[:, :count], new_weights[:count] = places, rates, weights
    for k in range(drawn):
        g, i = gaussians[k % gaussians.shape[0]], count + k
        radius, angle = math.sqrt(-2.0 * math.log((k + 0.5) / drawn)), turn_rad + _GOLDEN_RAD * k
        one, other = radius * math.cos(angle), radius * math.sin(angle)
        root = math.sqrt(g[2])
        across = g[3] / root
        new_places[0, i] = g[0] + root * one
        new_places[1, i] = g[1] + across * one + math.sqrt(max(0.0, g[4] - across * across)) * other
        new_rates[:, i] = rates[:, k * count // drawn]
        new_weights[i] = per_area * _between(new_places[0, i], new_places[1, i], probability, box)
    drawn_density = np.zeros(new_weights.size)
    for g in _inverted(gaussians):
        scale = drawn * g[5] / gaussians.shape[0]
        for i in range(new_weights.size):
            distance = _squared(new_places[0, i], new_places[1, i], g)
            if distance < _GATE:
                drawn_density[i] += scale * math.exp(-0.5 * distance)
    for i in range(new_weights.size):
        more = drawn_density[i]
        if more > 0.0:
            dense = per_area * _between(new_places[0, i], new_places[1, i], number, box)
            if i >= count:
                new_weights[i] /= dense + more
            elif dense > 0.0:
                new_weights[i] *= dense / (dense + more)


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
    bins, _ = _binned(places, weights, box)
    for k in range(bins.size):
        if bins[k] > 0.0:
            bins[k] = _SPREAD * _DRAW_UNIT * math.sqrt(1.0 / (box[2] * box[3] * bins[k]))
    chosen = np.empty(count, np.int64)
    systematic(weights, start, chosen)
    for i in range(count):
        one = chosen[i]
        spread = bins[_bin_of(places[0, one], places[1, one], box)]
        for axis in range(2):
            off = float(draws[i, 2 * axis]) + float(draws[i, 2 * axis + 1]) - 65535.0
            new_places[axis, i] = places[axis, one] + spread * off
            new_rates[axis, i] = rates[axis, one]
