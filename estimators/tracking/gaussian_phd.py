"""The PHD filter with Gaussian components (Vo and Ma 2006, "The Gaussian mixture probability hypothesis
density filter"), with measurements converted to places and births driven by the measurements.

The probability of detection of a component is that at its mean; a component that is wide against the scale
of the sensor is therefore only approximated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.gaussian_components import Components, Likelihood, clutter_per_m2
from estimators.tracking.intensity import BirthIntensity, Cluster
from estimators.tracking.motion import Motion
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint
from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options

__all__ = ["GaussianPhd", "GaussianPhdParameters"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianPhdParameters(Options):
    """Parameters of the mixture.

    Attributes:
        least_weight: components below it are dropped (Vo and Ma 2006: T).
        merge_distance_squared: components within this squared Mahalanobis distance are merged (U).
        max_components: the components of largest weight are kept (J_max).
        gate_squared: squared Mahalanobis distance of a measurement beyond which its likelihood counts as 0.
    """

    least_weight: Positive = 1e-4
    merge_distance_squared: Positive = 4.0
    max_components: int = 500
    gate_squared: Positive = 30.0

    def check_together(self) -> None:
        if not 1 <= self.max_components <= 100_000:
            raise ValueError(f"max_components {self.max_components} is not in 1..100000")


class GaussianPhd:
    """The intensity as Gaussian components.

    Args:
        sensor: what is known about the sensor.
        motion: of the targets.
        parameters: of the mixture.

    Attributes:
        sensor, motion, parameters: as given.
        components: weight of each: the expected number of targets.
    """

    def __init__(
        self,
        sensor: RangeBearingSensor,
        motion: Motion | None = None,
        parameters: GaussianPhdParameters | None = None,
    ) -> None:
        self.sensor = sensor
        self.motion = motion or Motion()
        self.parameters = parameters or GaussianPhdParameters()
        self.components = Components.none(self.motion)

    @property
    def expected_targets(self) -> float:
        return float(self.components.weights.sum())

    def predict(self, dt_s: float) -> None:
        self.components = self.components.moved(dt_s, self.motion)

    def update(self, scan: Array, viewpoint: Viewpoint, birth: BirthIntensity) -> None:
        scan = np.asarray(scan, dtype=np.float64).reshape(-1, 2)
        old = self.components
        detected = self.sensor.probability(old.means[:, 0], old.means[:, 1], viewpoint)
        parts = [replace(old, weights=old.weights * (1.0 - detected))]
        if len(scan):
            places, noise = self.sensor.places(scan, viewpoint), self.sensor.covariances(scan, viewpoint)
            born = self.sensor.probability(places[:, 0], places[:, 1], viewpoint) * birth(
                places[:, 0], places[:, 1]
            )
            seen = Likelihood.of(old, places, noise, self.parameters.gate_squared)
            explained = (detected * old.weights)[:, None] * seen.density
            total = clutter_per_m2(self.sensor, scan) + born + explained.sum(axis=0)
            near = seen.density > 0.0
            parts.append(
                Components(
                    weights=(explained / total)[near],
                    means=seen.means[near],
                    covariances=seen.covariances[near],
                )
            )
            parts.append(Components.born(born / total, places, noise, self.motion))
        self.components = self._reduced(Components.joined(parts))

    def _reduced(self, whole: Components) -> Components:
        """Drop, merge and limit the components (Vo and Ma 2006, table II)."""
        p = self.parameters
        kept = np.flatnonzero(whole.weights >= p.least_weight)
        kept = kept[np.argsort(-whole.weights[kept], kind="stable")]
        weights, means, covariances = whole.weights[kept], whole.means[kept], whole.covariances[kept]
        size = means.shape[1]
        inverse = np.linalg.inv(covariances + 1e-12 * np.eye(size))
        free = np.ones(len(weights), dtype=np.bool_)
        merged: list[tuple[float, Array, Array]] = []
        for i in range(len(weights)):
            if not free[i]:
                continue
            off = means - means[i]
            # the distance to the heaviest component, by the covariance of each
            near = free & (np.einsum("ni,nij,nj->n", off, inverse, off) <= p.merge_distance_squared)
            near[i] = True
            free &= ~near
            w = weights[near]
            total = float(w.sum())
            mean = w @ means[near] / total
            off = means[near] - mean
            spread = np.einsum("n,nij->ij", w, covariances[near] + off[:, :, None] * off[:, None, :]) / total
            merged.append((total, mean, spread))
        merged.sort(key=lambda component: -component[0])
        merged = merged[: p.max_components]
        return Components(
            weights=np.array([component[0] for component in merged]),
            means=np.array([component[1] for component in merged]).reshape(-1, size),
            covariances=np.array([component[2] for component in merged]).reshape(-1, size, size),
        )

    def clusters(self) -> Sequence[Cluster]:
        return self.components.clusters()

    def remove(self, cluster: Cluster) -> None:
        own = self.components
        away = np.hypot(own.means[:, 0] - cluster.north_m, own.means[:, 1] - cluster.east_m)
        near = away <= max(3.0 * cluster.width_m, 1e-9)
        weights = own.weights.copy()
        weights[near] *= max(0.0, 1.0 - 1.0 / max(float(weights[near].sum()), 1e-9))
        self.components = replace(own, weights=weights).of(weights >= self.parameters.least_weight)

    def points(self) -> tuple[Array, Array, Array]:
        return self.components.points()
