"""Goodness of fit of a hypothesis: what is left of its probability when its predictions are worse than they
state.

Bayes compares hypotheses with each other: the best of several bad ones gets all of the probability. Each
measurement is therefore also compared with what the hypothesis predicted from those before it (whitened
residuals). Their squares sum up to a chi-square number where the hypothesis is right, a posterior predictive
check (Gelman, Meng and Stern 1996). Its counterpart is the same hypothesis whose errors are larger than
stated by an unknown factor: something that resembles the class, but is not of it.
"""

import math
from typing import Final

__all__ = ["fitting_share"]

_RESEMBLES: Final = 0.15  # prior odds of something that resembles a class
_LEAST_SHARE: Final = 0.3  # where nothing fits, a class keeps so much: that is no reason to dismiss it
_LEAST_STEPS: Final = 5


def fitting_share(misfit: float, steps: int) -> float:
    """Share of its probability that a hypothesis keeps, `_LEAST_SHARE`..1.

    Args:
        misfit: sum of the squared whitened residuals.
        steps: number of measurements.
    """
    if steps < _LEAST_STEPS:
        return 1.0
    factor = misfit / steps
    if factor <= 1.0:
        return 1.0
    # logarithm of the ratio of both densities with the variances' most likely factor, less the cost of
    # choosing it (Schwarz 1978)
    gain_nats = 0.5 * steps * (factor - 1.0 - math.log(factor)) - 0.5 * math.log(steps)
    odds = _RESEMBLES * math.exp(min(gain_nats, 100.0))
    return _LEAST_SHARE + (1.0 - _LEAST_SHARE) / (1.0 + odds)
