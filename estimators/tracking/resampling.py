"""Resampling of weighted particles: which of them the next generation consists of.

Source: Arulampalam, Maskell, Gordon and Clapp 2002, "A tutorial on particle filters", algorithms 2 and 3;
roulette: Lum et al. 2005, section III-B. The random numbers are arguments, so a stream of the caller makes
the same generation on every run.
"""

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@kernel
def effective_count(weights: Array) -> float:
    """Effective number of particles, 1 / sum w^2, of weights (n,) that sum to one."""
    total = 0.0
    for weight in weights:
        total += weight * weight
    return 1.0 / total if total > 0.0 else 0.0


@kernel
def systematic(weights: Array, start: float, out: Indices) -> None:
    """Systematic resampling: the least variance, and one random number.

    Args:
        weights: (n,), sum one.
        start: uniform in 0..1.
        out: (m,) indices of the chosen particles, ascending.
    """
    count = out.size
    last = weights.size - 1
    index = 0
    above = weights[0]
    for k in range(count):
        mark = (k + start) / count
        while above < mark and index < last:
            index += 1
            above += weights[index]
        out[k] = index


@kernel
def roulette(weights: Array, marks: Array, out: Indices) -> None:
    """Roulette wheel (multinomial resampling): a spin for each particle of the next generation.

    Args:
        weights: (n,), sum one.
        marks: (m,) uniform in 0..1, ascending.
        out: (m,) indices of the chosen particles, ascending.
    """
    last = weights.size - 1
    index = 0
    above = weights[0]
    for k in range(out.size):
        while above < marks[k] and index < last:
            index += 1
            above += weights[index]
        out[k] = index
