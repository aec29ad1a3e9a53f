"""What a target looks like: few numbers of the pixels that show it, and how well they identify it.

A look is a short vector of a target in one frame, such as the colour of its patch against the ground around
it. Looks of one target differ: by noise from frame to frame, and slowly, with the side that is seen, its
shadow and the ground behind it. So the mean of many looks is not known better than the slow part.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import Positive, Share
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

__all__ = ["AppearanceParameters", "KnownLook", "Look", "LookMean"]

Array = NDArray[np.float64]
Look = NDArray[np.float64]
"""(d,) of a target in one frame; all NaN: not measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AppearanceParameters(Options):
    """Spread of looks, for brightness, red less green and blue less green of a patch of few pixels, in levels
    of 255. Measured on rendered persons in clothes of five colours (docs/handoff.md).

    Attributes:
        mean: of all targets.
        sigma: standard deviation between targets.
        slow_sigma, slow_s: of the part of one target that changes slowly, and its correlation time.
        noise_sigma: of the part that changes from frame to frame.
        unlike: probability that a target looks like any other from now on: it has entered a shadow, or the
            front end measures its surroundings.
    """

    mean: tuple[float, ...] = (-43.0, 4.0, 36.0)
    sigma: tuple[float, ...] = (15.0, 13.0, 6.0)
    slow_sigma: tuple[float, ...] = (12.0, 6.0, 6.0)
    slow_s: Positive = 8.0
    noise_sigma: tuple[float, ...] = (7.0, 4.0, 4.0)
    unlike: Share = 0.02


class LookMean:
    """Mean of the looks of one track while it certainly is of one target.

    Attributes:
        count: number of looks.
    """

    def __init__(self) -> None:
        self.count = 0
        self._sum: Array | None = None
        self._first_us = self._last_us = 0

    def add(self, time_us: int, look: Look) -> None:
        """Add a look; one that was not measured is left out."""
        if math.isfinite(float(look.sum())):
            self._sum = look.copy() if self._sum is None else self._sum + look
            if not self.count:
                self._first_us = time_us
            self._last_us = time_us
            self.count += 1

    def mean(self) -> Array:
        """(d,) of the looks; there must be one."""
        assert self._sum is not None, "no look yet"
        found: Array = self._sum / self.count
        return found

    @property
    def span_s(self) -> float:
        """Time from the first look to the last."""
        return (self._last_us - self._first_us) * 1e-6


class KnownLook:
    """What is known of how the designated target looks: a Gaussian for each number.

    Args:
        parameters: spread of looks.
    """

    def __init__(self, parameters: AppearanceParameters) -> None:
        self.parameters = parameters
        self.mean: Array = np.array(parameters.mean)
        self.variance: Array = np.square(parameters.sigma)
        self.known = False
        self._any_mean, self._any_variance = self.mean, self.variance
        self._slow, self._noise = np.square(parameters.slow_sigma), np.square(parameters.noise_sigma)

    def learn(self, looks: LookMean) -> None:
        """Looks that are of the target."""
        if not looks.count:
            return
        of_looks = self._variance_of(looks)
        gain = self.variance / (self.variance + of_looks)
        self.mean = self.mean + gain * (looks.mean() - self.mean)
        self.variance = (1.0 - gain) * self.variance
        self.known = True

    def likelihood_ratio(self, looks: LookMean) -> float:
        """How many times as probable looks are of the target as of any other; 1: nothing is known."""
        if not (self.known and looks.count):
            return 1.0
        unlike = self.parameters.unlike
        seen, of_looks = looks.mean(), self._variance_of(looks)
        as_target = _log_density(seen, self.mean, self.variance, of_looks)
        as_other = _log_density(seen, self._any_mean, self._any_variance, of_looks)
        return unlike + (1.0 - unlike) * math.exp(min(50.0, as_target - as_other))

    def _variance_of(self, looks: LookMean) -> Array:
        """(d,) of the mean of looks against the target's own."""
        # the mean of a first-order process over a time of many correlation times
        apart = 1.0 + looks.span_s / (2.0 * self.parameters.slow_s)
        found: Array = self._slow / apart + self._noise / looks.count
        return found


@kernel
def _log_density(seen: Array, mean: Array, variance: Array, of_looks: Array) -> float:
    summed = 0.0
    for k in range(seen.size):
        total = variance[k] + of_looks[k]
        summed += (seen[k] - mean[k]) ** 2 / total + math.log(total)
    return -0.5 * summed
