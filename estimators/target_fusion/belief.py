"""The belief about one target: a Gaussian with growing variance, a gate, and a rival that may replace it.

Steckenrider et al. 2020 fuse the detections of all drones at one step (equation 35), and do not treat a
target that is not always in view. Here detections come one by one, at their own times; between them the
target may have moved.
"""

from typing import Final

import numpy as np

from estimators.interface import Outcome
from estimators.lissajous.model import Array
from estimators.target_fusion.transform import INFORMATION, add_information, belief_of

MEAN: Final = slice(0, 2)


class TargetBelief:
    """One target's place: (x, y, xx, xy, yy), mean and covariance, in the pattern's frame.

    Args:
        walk_m2_s: increase of the variance per axis and second (random walk).
        gate: largest squared Mahalanobis distance of a detection that belongs to it.
        confirmations: number of agreeing detections before a belief is reported.
        max_delay_us: detections that are older than the belief by more than this are rejected.

    Attributes:
        values: (5,) values at `time_us` of the belief or, while there is none, of its first candidate.
        time_us: time of the newest detection in it.
        confirmed: whether there is a belief to report.
        gated: number of detections that belonged to no belief.
    """

    def __init__(self, *, walk_m2_s: float, gate: float, confirmations: int, max_delay_us: int) -> None:
        self._walk_m2_s = walk_m2_s
        self._gate = gate
        self._confirmations = confirmations
        self._max_delay_us = max_delay_us
        self._information: Array = np.zeros(INFORMATION)
        self._rival: Array = np.zeros(5)
        self._rival_us = 0
        self._rival_count = 0
        self._rival_mark = 0
        self._taken = 0
        self.values: Array = np.zeros(5)
        self.time_us = 0
        self.confirmed = False
        self.gated = 0

    def take(self, time_us: int, seen: Array) -> Outcome:
        """Fuse one detection, (x, y, xx, xy, yy) on the ground.

        A detection that is older than the belief is used for the present, with the variance that the target's
        random walk has added since.

        Returns:
            UPDATED; USED for a detection that counts towards a confirmation; IMPLAUSIBLE for one outside the
            gate; LATE.
        """
        if self.confirmed and self.time_us - time_us > self._max_delay_us:
            return Outcome.LATE
        if self.confirmed and self._fuse(self.values, self.time_us, time_us, seen):
            self.time_us = max(self.time_us, time_us)
            self._taken += 1
            return Outcome.UPDATED
        return self._confirm(time_us, seen)

    def at(self, time_us: int) -> Array:
        """The belief (5,) at a later time, with the same mean and a larger variance."""
        return self._faded(self.values, time_us - self.time_us)

    def move_origin(self, x: float, y: float) -> None:
        """Move the origin to the place (x, y) of the present frame."""
        for values in (self.values, self._rival):
            values[0] -= x
            values[1] -= y

    def _confirm(self, time_us: int, seen: Array) -> Outcome:
        """Process a detection outside the gate: a rival place collects those that agree.

        The rival replaces the belief when it has enough detections and the target itself was not detected in
        between. False detections are scattered, but a lost target reappears in one place.
        """
        rivals = self._rival_count > 0 and self._taken == self._rival_mark
        if rivals and self._fuse(self._rival, self._rival_us, time_us, seen):
            self._rival_count += 1
            self._rival_us = max(self._rival_us, time_us)
        else:
            self._rival[:] = seen
            self._rival_us, self._rival_count, self._rival_mark = time_us, 1, self._taken
        if self._rival_count < self._confirmations:
            if not self.confirmed:
                return Outcome.USED
            self.gated += 1
            return Outcome.IMPLAUSIBLE
        self.values[:] = self._rival
        self.time_us = self._rival_us
        self.confirmed, self._rival_count = True, 0
        return Outcome.UPDATED

    def _fuse(self, values: Array, values_us: int, time_us: int, seen: Array) -> bool:
        """Fuse a detection into `values` if it passes the gate; the older of the two first gets its variance
        increased. Returns whether it was fused.
        """
        belief = self._faded(values, time_us - values_us)
        detected = self._faded(seen, values_us - time_us)
        xx, xy, yy = belief[2:] + detected[2:]
        determinant = xx * yy - xy * xy
        dx, dy = belief[MEAN] - detected[MEAN]
        if not determinant > 0.0:
            return False
        if not (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) <= self._gate * determinant:
            return False
        information = self._information
        information[:] = 0.0
        if not (add_information(belief, information) and add_information(detected, information)):
            return False
        return belief_of(information, values)

    def _faded(self, values: Array, later_us: int) -> Array:
        out: Array = values.copy()
        if later_us > 0:
            gained = self._walk_m2_s * 1e-6 * later_us
            out[2] += gained
            out[4] += gained
        return out
