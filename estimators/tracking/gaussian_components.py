"""Gaussian components of a belief about many targets: motion, birth, and what the search sees of them.

A component is a weight, a mean (s,) of north and east and, for targets with constant velocity, their rates,
and a covariance (s, s). What the weight is depends on the filter: an expected number of targets, or the
probability that a target exists.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.intensity import Cluster
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.range_bearing import RangeBearingSensor

__all__ = ["Components", "Likelihood", "clutter_per_m2"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Components:
    """Any number of components.

    Attributes:
        weights: (n,).
        means: (n, s).
        covariances: (n, s, s).
    """

    weights: Array
    means: Array
    covariances: Array

    @classmethod
    def none(cls, motion: Motion) -> "Components":
        """No component, of targets with this motion."""
        size = 4 if motion.kind is MotionKind.CONSTANT_VELOCITY else 2
        return cls(weights=np.zeros(0), means=np.zeros((0, size)), covariances=np.zeros((0, size, size)))

    @classmethod
    def joined(cls, parts: "Sequence[Components]") -> "Components":
        """The components of all parts."""
        return cls(
            weights=np.concatenate([part.weights for part in parts]),
            means=np.concatenate([part.means for part in parts]),
            covariances=np.concatenate([part.covariances for part in parts]),
        )

    @classmethod
    def born(cls, weights: Array, places: Array, noise: Array, motion: Motion) -> "Components":
        """New targets at measured places.

        Args:
            weights: (m,).
            places, noise: (m, 2), (m, 2, 2) of the measurements.
            motion: of the targets; with constant velocity, their velocity is unknown.
        """
        size = 4 if motion.kind is MotionKind.CONSTANT_VELOCITY else 2
        means, covariances = np.zeros((len(places), size)), np.zeros((len(places), size, size))
        means[:, :2], covariances[:, :2, :2] = places, noise
        if size == 4:
            covariances[:, 2:, 2:] = motion.speed_sigma_m_s**2 * np.eye(2)
        return cls(weights=weights, means=means, covariances=covariances)

    def __len__(self) -> int:
        return len(self.weights)

    def of(self, chosen: Array | NDArray[np.bool_] | NDArray[np.int64]) -> "Components":
        """Those of a mask, or of indices, in their order."""
        return Components(
            weights=self.weights[chosen], means=self.means[chosen], covariances=self.covariances[chosen]
        )

    def moved(self, dt_s: float, motion: Motion) -> "Components":
        """After a time; the weights fall by the probability to survive."""
        if not len(self) or not dt_s > 0.0:
            return self
        size = self.means.shape[1]
        transition, noise = np.eye(size), np.zeros((size, size))
        noise[:2, :2] = motion.walk_m_sqrt_s**2 * dt_s * np.eye(2)
        if size == 4:
            transition[0, 2] = transition[1, 3] = dt_s
            density = motion.acceleration_m_s2_sqrt_hz**2
            noise += density * np.kron([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]], np.eye(2))
        return Components(
            weights=self.weights * motion.survival_per_s**dt_s,
            means=self.means @ transition.T,
            covariances=transition @ self.covariances @ transition.T + noise,
        )

    def clusters(self) -> list[Cluster]:
        """Each component as a cluster, the largest weight first."""
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

    def points(self) -> tuple[Array, Array, Array]:
        """North, east and weight of five points for each component: its mean, and two on each principal axis
        at sqrt(3) standard deviations, with the weights 1/3 and 1/6 (exact for the second moments).
        """
        if not len(self):
            return np.zeros(0), np.zeros(0), np.zeros(0)
        values, axes = np.linalg.eigh(self.covariances[:, :2, :2])
        offsets = math.sqrt(3.0) * axes * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        centre = self.means[:, None, :2]
        moves = np.swapaxes(offsets, 1, 2)
        points = np.concatenate((centre, centre + moves, centre - moves), axis=1)
        mass = self.weights[:, None] * np.array([1.0 / 3.0, *[1.0 / 6.0] * 4])
        return points[:, :, 0].ravel(), points[:, :, 1].ravel(), mass.ravel()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Likelihood:
    """Measured places against components.

    Attributes:
        density: (n, m) of each measurement, per square metre, if it is of that component; 0 beyond the gate.
        means: (n, m, s) of each component, updated by each measurement.
        covariances: (n, m, s, s).
    """

    density: Array
    means: Array
    covariances: Array

    @classmethod
    def of(cls, components: Components, places: Array, noise: Array, gate_squared: float) -> "Likelihood":
        """Kalman updates of all pairs.

        Args:
            components: n.
            places, noise: (m, 2), (m, 2, 2).
            gate_squared: squared Mahalanobis distance beyond which a likelihood counts as 0.
        """
        means, covariances = components.means, components.covariances
        residual = places[None] - means[:, None, :2]
        inverse = np.linalg.inv(covariances[:, None, :2, :2] + noise[None])
        distance = np.einsum("nmi,nmij,nmj->nm", residual, inverse, residual)
        density = np.exp(-0.5 * distance) * np.sqrt(np.linalg.det(inverse)) / math.tau
        gain = covariances[:, None, :, :2] @ inverse
        return cls(
            density=np.where(distance <= gate_squared, density, 0.0),
            means=means[:, None] + np.einsum("nmij,nmj->nmi", gain, residual),
            covariances=covariances[:, None] - gain @ covariances[:, None, :2, :],
        )


def clutter_per_m2(sensor: RangeBearingSensor, scan: Array) -> Array:
    """Density of false measurements at each measured place, per square metre, (m,).

    Args:
        sensor: what is known about it.
        scan: (m, 2) range and bearing; a density in these is range times that over the area.
    """
    return sensor.clutter_density(scan[:, 0]) / np.maximum(scan[:, 0], 1e-3)
