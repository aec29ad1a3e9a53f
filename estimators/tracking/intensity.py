"""The intensity of a random finite set of targets (PHD): its role, and the clusters in it.

The integral of the intensity over a region is the expected number of targets there. `SmcPhd` represents it by
particles, `GaussianPhd` by Gaussian components.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.motion import Motion
from estimators.tracking.range_bearing import Viewpoint

__all__ = ["BirthIntensity", "Cluster", "TargetIntensity"]

Array = NDArray[np.float64]

BirthIntensity = Callable[[Array, Array], Array]
"""North and east of places (n,) -> intensity of targets that were never detected, per square metre (n,)."""


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
    """A belief about any number of targets. Places are north and east in metres.

    Attributes:
        motion: of the targets; may be set.
    """

    motion: Motion

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
