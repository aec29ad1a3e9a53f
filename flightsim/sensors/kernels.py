"""Compiled parts the sensor models share: quantisation, saturation, Gauss-Markov noise."""

import math

from flightsim.foundation.kernels import kernel


@kernel
def quantise(value: float, quantum: float) -> float:
    """`value` rounded to the nearest multiple of `quantum`; a quantum of zero leaves it alone."""
    if quantum <= 0.0:
        return value
    return math.floor(value / quantum + 0.5) * quantum


@kernel
def saturate(value: float, limit: float) -> float:
    """`value` limited to -limit..limit."""
    return min(limit, max(-limit, value))


def gauss_markov(sigma: float, time_constant_s: float, interval_s: float) -> tuple[float, float]:
    """Coefficients (decay, drive) of x[k+1] = decay x[k] + drive n[k], n standard normal.

    The exact discretisation of a first-order Gauss-Markov process with stationary standard deviation `sigma`
    (Gelb, Applied Optimal Estimation, section 3.8).
    """
    decay = math.exp(-interval_s / time_constant_s)
    return decay, sigma * math.sqrt(1.0 - decay * decay)
