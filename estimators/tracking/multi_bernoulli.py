"""The Poisson multi-Bernoulli filter: each detected target has a probability to exist and a place, and the
targets that were never detected are a Poisson set.

Source: Williams 2015, "Marginal multi-Bernoulli filters: RFS derivation of MHT, JIPDA, and
association-based MeMBer", algorithm TOMB/P: the mixture of the PMBM filter is merged after each scan to one
multi-Bernoulli with its marginal probabilities of existence and association. The measurements are converted
to places; the probability of detection of a target is that at its mean.

Unlike in the PHD filter a certain target that is missed stays certain, and one that is detected does not
count for more than one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.gaussian_components import Components, Likelihood, clutter_per_m2
from estimators.tracking.intensity import BirthIntensity, Cluster
from estimators.tracking.marginal_association import association_marginals
from estimators.tracking.motion import Motion
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint
from flightsim.foundation.checks import Count, Positive
from flightsim.foundation.options import Options

__all__ = ["MultiBernoulli", "MultiBernoulliParameters"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiBernoulliParameters(Options):
    """Parameters of the filter.

    Attributes:
        least_existence: targets that exist with a smaller probability are dropped.
        most_targets: the targets that exist most probably are kept.
        gate_squared: squared Mahalanobis distance of a measurement beyond which its likelihood counts as 0.
    """

    least_existence: Positive = 1e-3
    most_targets: Count = 300
    gate_squared: Positive = 30.0


class MultiBernoulli:
    """The detected targets.

    Args:
        sensor: what is known about the sensor.
        motion: of the targets.
        parameters: of the filter.

    Attributes:
        sensor, motion, parameters: as given.
        targets: weight of each: the probability that it exists.
    """

    def __init__(
        self,
        sensor: RangeBearingSensor,
        motion: Motion | None = None,
        parameters: MultiBernoulliParameters | None = None,
    ) -> None:
        self.sensor = sensor
        self.motion = motion or Motion()
        self.parameters = parameters or MultiBernoulliParameters()
        self.targets = Components.none(self.motion)

    @property
    def expected_targets(self) -> float:
        return float(self.targets.weights.sum())

    def predict(self, dt_s: float) -> None:
        self.targets = self.targets.moved(dt_s, self.motion)

    def update(self, scan: Array, viewpoint: Viewpoint, birth: BirthIntensity) -> None:
        scan = np.asarray(scan, dtype=np.float64).reshape(-1, 2)
        targets = self.targets
        exists = targets.weights
        detected = self.sensor.probability(targets.means[:, 0], targets.means[:, 1], viewpoint)
        unmeasured = 1.0 - exists * detected  # it does not exist, or is not detected
        missed = exists * (1.0 - detected) / unmeasured
        if not len(scan):
            self._keep(Components(weights=missed, means=targets.means, covariances=targets.covariances))
            return
        places, noise = self.sensor.places(scan, viewpoint), self.sensor.covariances(scan, viewpoint)
        born = self.sensor.probability(places[:, 0], places[:, 1], viewpoint) * birth(
            places[:, 0], places[:, 1]
        )
        unexplained = born + clutter_per_m2(self.sensor, scan)
        seen = Likelihood.of(targets, places, noise, self.parameters.gate_squared)
        odds = (exists * detected / unmeasured)[:, None] * seen.density
        pairs, new = association_marginals(odds, unexplained)
        self._keep(
            Components.joined(
                (
                    _merged(missed * (1.0 - pairs.sum(axis=1)), pairs, targets, seen),
                    Components.born(new * born / unexplained, places, noise, self.motion),
                )
            )
        )

    def _keep(self, targets: Components) -> None:
        p = self.parameters
        kept = np.flatnonzero(targets.weights >= p.least_existence)
        order = np.argsort(-targets.weights[kept], kind="stable")[: p.most_targets]
        self.targets = targets.of(kept[order])

    def clusters(self) -> Sequence[Cluster]:
        return self.targets.clusters()

    def remove(self, cluster: Cluster) -> None:
        off = self.targets.means[:, :2] - (cluster.north_m, cluster.east_m)
        kept = np.ones(len(self.targets), dtype=np.bool_)
        kept[int(np.argmin(np.hypot(off[:, 0], off[:, 1])))] = False
        self.targets = self.targets.of(kept)

    def points(self) -> tuple[Array, Array, Array]:
        return self.targets.points()


def _merged(missed: Array, pairs: Array, targets: Components, seen: Likelihood) -> Components:
    """Each target with the mean and covariance of its mixture over the measurements that may be its own.

    Args:
        missed: (n,) probability that it exists and has no measurement.
        pairs: (n, m) probability that it has each measurement.
        targets: before the scan.
        seen: updated by each measurement.
    """
    shares = np.column_stack((missed, pairs))
    exists = shares.sum(axis=1)
    shares /= np.maximum(exists, 1e-300)[:, None]
    means = np.concatenate((targets.means[:, None], seen.means), axis=1)
    covariances = np.concatenate((targets.covariances[:, None], seen.covariances), axis=1)
    mean = np.einsum("nk,nki->ni", shares, means)
    off = means - mean[:, None]
    spread = covariances + off[..., :, None] * off[..., None, :]
    return Components(weights=exists, means=mean, covariances=np.einsum("nk,nkij->nij", shares, spread))
