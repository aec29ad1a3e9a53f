"""The intensity of a random finite set of targets (PHD): its role, the clusters in it, and how targets move.

The integral of the intensity over a region is the expected number of targets there. `SmcPhd` represents it by
particles, `GaussianPhd` by Gaussian components.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.checks import named, require_not_negative

__all__ = ["BirthIntensity", "Cluster", "Motion", "MotionKind", "TargetIntensity"]

Array = NDArray[np.float64]

BirthIntensity = Callable[[Array, Array], Array]
"""North and east of places (n,) -> intensity of targets that were never detected, per square metre (n,)."""


class MotionKind(StrEnum):
    """How targets move."""

    STATIC = "static"
    RANDOM_WALK = "random-walk"
    CONSTANT_VELOCITY = "constant-velocity"


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Motion and survival of targets.

    Attributes:
        kind: static, random walk, or constant velocity with white noise in the acceleration.
        walk_m_sqrt_s: growth of the standard deviation of a place, per axis, metres after one second. For
            static targets a small value keeps particles apart that resampling has copied.
        acceleration_m_s2_sqrt_hz: spectral density of the acceleration's noise (constant velocity).
        speed_sigma_m_s: standard deviation of a new target's velocity per axis (constant velocity).
        survival_per_s: probability to survive a second; below 1, targets may disappear.
    """

    kind: MotionKind = MotionKind.STATIC
    walk_m_sqrt_s: float = 0.03
    acceleration_m_s2_sqrt_hz: float = 0.1
    speed_sigma_m_s: float = 1.0
    survival_per_s: float = 1.0

    def __post_init__(self) -> None:
        require_not_negative(**named(self, "walk_m_sqrt_s", "acceleration_m_s2_sqrt_hz", "speed_sigma_m_s"))
        if not 0.0 < self.survival_per_s <= 1.0:
            raise ValueError(f"survival_per_s {self.survival_per_s:g} is not in 0..1, or is 0")

    @property
    def moves(self) -> bool:
        """Whether the model is of targets that move."""
        return self.kind is not MotionKind.STATIC


@dataclass(frozen=True, slots=True, kw_only=True)
class Cluster:
    """A part of the intensity that belongs together: about one target when its mass is about 1.

    Attributes:
        north_m, east_m: centre of mass.
        mass: expected number of targets.
        width_m: standard deviation per axis, root of the mean of both variances.
        covariance_m2: north variance, covariance, east variance.
    """

    north_m: float
    east_m: float
    mass: float
    width_m: float
    covariance_m2: tuple[float, float, float]


class TargetIntensity(Protocol):
    """A belief about any number of targets. Places are north and east in metres."""

    @property
    def expected_targets(self) -> float:
        """The integral of the intensity."""
        ...

    def predict(self, dt_s: float) -> None:
        """Move the targets by a time."""
        ...

    def update(self, scan: Array, viewpoint: Viewpoint, birth: BirthIntensity) -> None:
        """Fuse a scan.

        Args:
            scan: (m, 2) range and bearing from the nose; m may be 0.
            viewpoint: of the scan.
            birth: intensity of targets that were never detected before this scan.
        """
        ...

    def clusters(self) -> Sequence[Cluster]:
        """The clusters, the largest mass first; small ones are left out."""
        ...

    def remove(self, cluster: Cluster) -> None:
        """Take one target out of a cluster. Mass above 1 stays: it belongs to other targets at the same
        place, and without it the expected number would be too small.
        """
        ...

    def points(self) -> tuple[Array, Array, Array]:
        """North, east and mass (n,) of points that represent the intensity."""
        ...
