"""The PHD filter with Gaussian components (Vo and Ma 2006, "The Gaussian mixture probability hypothesis
density filter"), with measurements converted to places and births driven by the measurements.

The probability of detection of a component is that at its mean; a component that is wide against the scale
of the sensor is therefore only approximated.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.intensity import BirthIntensity, Cluster
from estimators.tracking.motion import Motion, MotionKind
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
        weights: (n,).
        means: (n, s): north, east and, for targets with constant velocity, their rates.
        covariances: (n, s, s).
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
        self._states = 4 if self.motion.kind is MotionKind.CONSTANT_VELOCITY else 2
        self.weights: Array = np.zeros(0)
        self.means: Array = np.zeros((0, self._states))
        self.covariances: Array = np.zeros((0, self._states, self._states))

    @property
    def expected_targets(self) -> float:
        return float(self.weights.sum())

    def predict(self, dt_s: float) -> None:
        if not len(self.weights) or not dt_s > 0.0:
            return
        motion, size = self.motion, self._states
        self.weights = self.weights * motion.survival_per_s**dt_s
        transition, noise = np.eye(size), np.zeros((size, size))
        noise[:2, :2] = motion.walk_m_sqrt_s**2 * dt_s * np.eye(2)
        if size == 4:
            transition[0, 2] = transition[1, 3] = dt_s
            density = motion.acceleration_m_s2_sqrt_hz**2
            noise += density * np.kron([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]], np.eye(2))
        self.means = self.means @ transition.T
        self.covariances = transition @ self.covariances @ transition.T + noise

    def update(self, scan: Array, viewpoint: Viewpoint, birth: BirthIntensity) -> None:
        scan = np.asarray(scan, dtype=np.float64).reshape(-1, 2)
        weights, means, covariances = self.weights, self.means, self.covariances
        detected = self.sensor.probability(means[:, 0], means[:, 1], viewpoint)
        parts = [(weights * (1.0 - detected), means, covariances)]
        if len(scan):
            places = self.sensor.places(scan, viewpoint)
            noise = self.sensor.covariances(scan, viewpoint)
            clutter = self.sensor.clutter_density(scan[:, 0])
            # a density in range and bearing is range times that over the area
            per_area = clutter / np.maximum(scan[:, 0], 1e-3)
            born = self.sensor.probability(places[:, 0], places[:, 1], viewpoint) * birth(
                places[:, 0], places[:, 1]
            )
            for j in range(len(scan)):
                parts.append(self._explained(detected, places[j], noise[j], per_area[j], float(born[j])))
        self.weights, self.means, self.covariances = (
            np.concatenate(columns) for columns in zip(*parts, strict=True)
        )
        self._reduce()

    def _explained(
        self, detected: Array, place: Array, noise: Array, clutter_per_m2: float, born_per_m2: float
    ) -> tuple[Array, Array, Array]:
        """The components that explain one measurement, updated by it, and the one born from it."""
        weights, means, covariances = self.weights, self.means, self.covariances
        residual = place - means[:, :2]
        spread = covariances[:, :2, :2] + noise
        inverse = np.linalg.inv(spread)
        distance = np.einsum("ni,nij,nj->n", residual, inverse, residual)
        near = distance <= self.parameters.gate_squared
        residual, inverse, distance = residual[near], inverse[near], distance[near]
        density = np.exp(-0.5 * distance) * np.sqrt(np.linalg.det(inverse)) / math.tau
        explained = detected[near] * weights[near] * density
        total = clutter_per_m2 + born_per_m2 + float(explained.sum())
        gain = covariances[near][:, :, :2] @ inverse
        updated = means[near] + np.einsum("nij,nj->ni", gain, residual)
        reduced = covariances[near] - gain @ covariances[near][:, :2, :]
        size = self._states
        mean, covariance = np.zeros(size), np.zeros((size, size))
        mean[:2], covariance[:2, :2] = place, noise
        if size == 4:
            covariance[2:, 2:] = self.motion.speed_sigma_m_s**2 * np.eye(2)
        return (
            np.append(explained, born_per_m2) / total,
            np.vstack((updated, mean)),
            np.concatenate((reduced, covariance[None])),
        )

    def _reduce(self) -> None:
        """Drop, merge and limit the components (Vo and Ma 2006, table II)."""
        p = self.parameters
        kept = np.flatnonzero(self.weights >= p.least_weight)
        kept = kept[np.argsort(-self.weights[kept], kind="stable")]
        weights, means, covariances = self.weights[kept], self.means[kept], self.covariances[kept]
        inverse = np.linalg.inv(covariances + 1e-12 * np.eye(self._states))
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
        self.weights = np.array([component[0] for component in merged])
        self.means = np.array([component[1] for component in merged]).reshape(-1, self._states)
        self.covariances = np.array([component[2] for component in merged]).reshape(
            -1, self._states, self._states
        )

    def clusters(self) -> Sequence[Cluster]:
        order = np.argsort(-self.weights, kind="stable")
        return [
            Cluster(
                north_m=float(self.means[i, 0]),
                east_m=float(self.means[i, 1]),
                mass=float(self.weights[i]),
                width_m=math.sqrt(0.5 * float(np.trace(self.covariances[i, :2, :2]))),
                covariance_m2=(
                    float(self.covariances[i, 0, 0]),
                    float(self.covariances[i, 0, 1]),
                    float(self.covariances[i, 1, 1]),
                ),
            )
            for i in order.tolist()
        ]

    def remove(self, cluster: Cluster) -> None:
        away = np.hypot(self.means[:, 0] - cluster.north_m, self.means[:, 1] - cluster.east_m)
        own = away <= max(3.0 * cluster.width_m, 1e-9)
        self.weights[own] *= max(0.0, 1.0 - 1.0 / max(float(self.weights[own].sum()), 1e-9))
        kept = self.weights >= self.parameters.least_weight
        self.weights, self.means, self.covariances = (
            self.weights[kept],
            self.means[kept],
            self.covariances[kept],
        )

    def points(self) -> tuple[Array, Array, Array]:
        """Five points for each component: its mean, and two on each principal axis at sqrt(3) standard
        deviations, with the weights 1/3 and 1/6 (exact for the second moments).
        """
        if not len(self.weights):
            return np.zeros(0), np.zeros(0), np.zeros(0)
        values, axes = np.linalg.eigh(self.covariances[:, :2, :2])
        offsets = math.sqrt(3.0) * axes * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        centre = self.means[:, None, :2]
        moves = np.swapaxes(offsets, 1, 2)
        points = np.concatenate((centre, centre + moves, centre - moves), axis=1)
        mass = self.weights[:, None] * np.array([1.0 / 3.0, *[1.0 / 6.0] * 4])
        return points[:, :, 0].ravel(), points[:, :, 1].ravel(), mass.ravel()
