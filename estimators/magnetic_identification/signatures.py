"""The signatures of sources as kernels: their terms at places, what measurements say about their strengths,
and the integral over the strengths that are expected.

A source is a column of an array (width, n): each quantity of all sources is contiguous, so that the compiler
vectorizes the loops.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots

Array = NDArray[np.float64]

_source = Slots()
NORTH: Final = _source.place()
EAST: Final = _source.place()
NORTH_SPEED: Final = _source.place()
EAST_SPEED: Final = _source.place()
LOG_DEPTH: Final = _source.place()  # of a dipole below the first measurement
DIPOLE: Final = _source.size
AXIS: Final = LOG_DEPTH  # of a Gaussian, from north
LOG_ALONG: Final = _source.place()  # logarithm of the standard deviation along the axis, m
LOG_ACROSS: Final = _source.place()
GAUSSIAN: Final = _source.size


@kernel(error_model="numpy")
def gaussian_terms(sources: Array, places: Array, out: Array) -> None:
    """Gaussian signatures of amplitude one.

    Args:
        sources: (GAUSSIAN, n).
        places: (4, m) north, east, height and time of measurements.
        out: (m, 1, n).
    """
    count = sources.shape[1]
    shape = np.empty((4, count))
    for k in range(count):
        cosine, sine = math.cos(sources[AXIS, k]), math.sin(sources[AXIS, k])
        per_along, per_across = math.exp(-sources[LOG_ALONG, k]), math.exp(-sources[LOG_ACROSS, k])
        shape[0, k], shape[1, k] = cosine * per_along, sine * per_along
        shape[2, k], shape[3, k] = -sine * per_across, cosine * per_across
    for j in range(places.shape[1]):
        north_m, east_m, time_s = places[0, j], places[1, j], places[3, j]
        row = out[j, 0]
        for k in range(count):
            off_n = north_m - sources[NORTH, k] - time_s * sources[NORTH_SPEED, k]
            off_e = east_m - sources[EAST, k] - time_s * sources[EAST_SPEED, k]
            along = off_n * shape[0, k] + off_e * shape[1, k]
            across = off_n * shape[2, k] + off_e * shape[3, k]
            row[k] = -0.5 * (along * along + across * across)
        for k in range(count):
            row[k] = math.exp(row[k])


@kernel(error_model="numpy")
def dipole_terms(
    sources: Array, places: Array, field: tuple[float, float, float], height_m: float, out: Array
) -> None:
    """Signatures of dipoles along each axis, whose strength is one at a distance of their depth.

    A signature is the part of B = mu_0 / 4 pi (3 (m r) r / r^5 - m / r^3) along the Earth's field (Blakely
    1995, section 8.3): linear in the moment.

    Args:
        sources: (DIPOLE, n).
        places: (4, m) north, east, height and time of measurements.
        field: direction of the Earth's field, NED.
        height_m: height that the depths are below.
        out: (m, 3, n).
    """
    field_n, field_e, field_d = field
    count = sources.shape[1]
    depths_m = np.exp(sources[LOG_DEPTH])
    for j in range(places.shape[1]):
        north_m, east_m, above_m, time_s = places[0, j], places[1, j], places[2, j] - height_m, places[3, j]
        for k in range(count):
            x = north_m - sources[NORTH, k] - time_s * sources[NORTH_SPEED, k]
            y = east_m - sources[EAST, k] - time_s * sources[EAST_SPEED, k]
            depth_m = depths_m[k]
            up = max(1.0, depth_m + above_m)
            square = x * x + y * y + up * up
            scale = depth_m * depth_m * depth_m / (square * math.sqrt(square))
            along = 3.0 * (x * field_n + y * field_e - up * field_d) / square
            out[j, 0, k] = scale * (along * x - field_n)
            out[j, 1, k] = scale * (along * y - field_e)
            out[j, 2, k] = scale * (-along * up - field_d)


@kernel(error_model="numpy")
def add_to_strengths(white: Array, measured: Array, precision: Array, product: Array) -> None:
    """Add what whitened measurements say about the strengths.

    Args:
        white: (m, terms, n) whitened terms.
        measured: (m,) whitened measurements.
        precision: (terms, terms, n) of the strengths, changed in place.
        product: (terms, n) precision times the most likely strengths, changed in place.
    """
    for j in range(white.shape[0]):
        for a in range(white.shape[1]):
            for b in range(a + 1):
                for k in range(white.shape[2]):
                    precision[a, b, k] += white[j, a, k] * white[j, b, k]
            for k in range(white.shape[2]):
                product[a, k] += white[j, a, k] * measured[j]
    for a in range(white.shape[1]):
        for b in range(a):
            precision[b, a] = precision[a, b]


@kernel(error_model="numpy")
def integrate_mixture(
    precision: Array, product: Array, parts: Array, gains: Array, means: Array, variances: Array
) -> None:
    """The integral over strengths that are a mixture of normal numbers.

    Args:
        precision, product: (n,) of the likelihood exp(-precision a^2 / 2 + product a).
        parts: (m, 3) logarithm of the share, mean and variance of each part.
        gains: (n,) out: its logarithm.
        means, variances: (n,) out: of the strengths, given the measurements.
    """
    for k in range(gains.size):
        best = -math.inf
        total = first = second = 0.0
        for j in range(parts.shape[0]):
            mean, variance = parts[j, 1], parts[j, 2]
            one = 1.0 + precision[k] * variance
            square = product[k] * product[k] * variance + 2.0 * product[k] * mean - precision[k] * mean * mean
            log = parts[j, 0] + 0.5 * (square / one - math.log(one))
            if log > best:
                scale = math.exp(best - log)
                total, first, second, best = total * scale, first * scale, second * scale, log
            share = math.exp(log - best)
            after, left = (product[k] * variance + mean) / one, variance / one
            total += share
            first += share * after
            second += share * (left + after * after)
        gains[k] = best + math.log(total)
        means[k] = first / total
        variances[k] = second / total - means[k] * means[k]


@kernel(error_model="numpy")
def integrate_vectors(
    precision: Array, product: Array, variance: float, gains: Array, means: Array, covariances: Array
) -> None:
    """The integral over strengths along three axes that are independent normal numbers without a mean.

    Args:
        precision, product: (3, 3, n) and (3, n) of the likelihood exp(-a P a / 2 + p a).
        variance: of each strength.
        gains: (n,) out: its logarithm.
        means, covariances: (3, n) and (3, 3, n) out: of the strengths, given the measurements.
    """
    for k in range(gains.size):
        a, d = 1.0 + variance * precision[0, 0, k], 1.0 + variance * precision[1, 1, k]
        f = 1.0 + variance * precision[2, 2, k]
        b, c, e = variance * precision[0, 1, k], variance * precision[0, 2, k], variance * precision[1, 2, k]
        aa, ab, ac = d * f - e * e, c * e - b * f, b * e - c * d
        determinant = a * aa + b * ab + c * ac
        scale = variance / determinant
        covariances[0, 0, k] = scale * aa
        covariances[0, 1, k] = covariances[1, 0, k] = scale * ab
        covariances[0, 2, k] = covariances[2, 0, k] = scale * ac
        covariances[1, 1, k] = scale * (a * f - c * c)
        covariances[1, 2, k] = covariances[2, 1, k] = scale * (b * c - a * e)
        covariances[2, 2, k] = scale * (a * d - b * b)
        total = 0.0
        for i in range(3):
            mean = 0.0
            for j in range(3):
                mean += covariances[i, j, k] * product[j, k]
            means[i, k] = mean
            total += mean * product[i, k]
        gains[k] = 0.5 * (total - math.log(determinant))


@kernel
def predict(white: Array, measured: float, means: Array, covariances: Array, weights: Array) -> float:
    """Square of the difference between a whitened measurement and its prediction, over the variance of that.

    Args:
        white: (terms, n) whitened terms of that measurement.
        measured: the measurement.
        means, covariances: (terms, n) and (terms, terms, n) of the strengths, given those before.
        weights: (n,) of the sources.
    """
    mean = square = 0.0
    for k in range(weights.size):
        off, variance = measured, 1.0
        for a in range(white.shape[0]):
            off -= white[a, k] * means[a, k]
            for b in range(white.shape[0]):
                variance += white[a, k] * white[b, k] * covariances[a, b, k]
        mean += weights[k] * off
        square += weights[k] * (off * off + variance)
    return mean * mean / (square - mean * mean)


@kernel
def reweigh(weights: Array, before: Array, after: Array) -> float:
    """Multiply weights by ratios of densities.

    Args:
        weights: (n,), sum one, changed in place.
        before, after: (n,) logarithms of the densities.

    Returns:
        Logarithm of the mean ratio.
    """
    best = (after - before).max()
    total = 0.0
    for k in range(weights.size):
        weights[k] *= math.exp(after[k] - before[k] - best)
        total += weights[k]
    for k in range(weights.size):
        weights[k] /= total
    return best + math.log(total)


@kernel
def replace_taken(taken: NDArray[np.bool_], new: Array, out: Array) -> None:
    """Columns of `out` (m, n) become those of `new` where they are taken."""
    for i in range(out.shape[0]):
        for k in range(out.shape[1]):
            if taken[k]:
                out[i, k] = new[i, k]
