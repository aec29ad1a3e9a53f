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

__all__ = ["Appearance", "AppearanceParameters", "Look", "Looks"]

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


class Looks:
    """The looks of one track, by two hypotheses: it is of the target, or of another.

    Attributes:
        as_target, as_other: (d, 5) what is known of the look by each: for each number the means of the own
            look and of the slow part, the variances of both, and their covariance.
        time_us: time of the newest look.
        log_ratio: logarithm of how many times as probable the looks are of the target as of another, since
            they were counted.
    """

    def __init__(self, time_us: int, as_target: Array, as_other: Array) -> None:
        self.as_target, self.as_other = as_target, as_other
        self.time_us = time_us
        self.log_ratio = 0.0


class Appearance:
    """What the target looks like, and how well looks fit it.

    Args:
        parameters: spread of looks.
    """

    def __init__(self, parameters: AppearanceParameters) -> None:
        self.parameters = parameters
        self._any = np.zeros((len(parameters.mean), 5))
        self._any[:, 0], self._any[:, 2] = parameters.mean, np.square(parameters.sigma)
        self._any[:, 3] = self._slow = np.square(parameters.slow_sigma)
        self._noise = np.square(parameters.noise_sigma)
        self._known: tuple[int, Array] | None = None  # of the target, when it was certain last

    def learn(self, looks: Looks | None) -> None:
        """The looks of a track are those of the target."""
        if looks is not None:
            self._known = looks.time_us, looks.as_target.copy()

    def designate(self, looks: Looks | None) -> None:
        """A track turns out to be the target: so are all its looks."""
        if looks is not None:
            looks.as_target = looks.as_other.copy()
            self.learn(looks)

    def add(self, looks: Looks | None, time_us: int, look: Look) -> Looks | None:
        """Add a look of a track.

        Args:
            looks: of the track so far; None: it is the first one since the track may have changed its target.
            time_us: of the look.
            look: (d,); one that was not measured is left out.
        """
        if not math.isfinite(float(look.sum())):
            return looks
        if looks is None:
            as_target = self._any.copy() if self._known is None else self._known[1].copy()
            if self._known is not None:
                self._wait(as_target, time_us - self._known[0])
            looks = Looks(time_us, as_target, self._any.copy())
        for filtered in (looks.as_target, looks.as_other):
            self._wait(filtered, time_us - looks.time_us)
        looks.time_us = time_us
        looks.log_ratio += _observe(looks.as_target, look, self._noise)
        looks.log_ratio -= _observe(looks.as_other, look, self._noise)
        return looks

    def _wait(self, filtered: Array, time_us: int) -> None:
        kept = math.exp(-1e-6 * time_us / self.parameters.slow_s)
        filtered[:, 1] *= kept
        filtered[:, 3] = kept * kept * filtered[:, 3] + (1.0 - kept * kept) * self._slow
        filtered[:, 4] *= kept

    def ratio(self, looks: Looks | None) -> float:
        """How many times as probable looks are of the target as of another; 1: nothing is known."""
        if looks is None:
            return 1.0
        unlike = self.parameters.unlike
        return unlike + (1.0 - unlike) * math.exp(min(50.0, looks.log_ratio))


@kernel
def _observe(filtered: Array, look: Array, noise: Array) -> float:
    """Kalman filter of the sum of both states; returns the logarithm of the look's density."""
    log = 0.0
    for k in range(look.size):
        own, slow, both = filtered[k, 2], filtered[k, 3], filtered[k, 4]
        off = look[k] - filtered[k, 0] - filtered[k, 1]
        total = own + slow + 2.0 * both + noise[k]
        log -= 0.5 * (off * off / total + math.log(total))
        first, second = (own + both) / total, (slow + both) / total
        filtered[k, 0] += first * off
        filtered[k, 1] += second * off
        filtered[k, 2] = own - first * first * total
        filtered[k, 3] = slow - second * second * total
        filtered[k, 4] = both - first * second * total
    return log
