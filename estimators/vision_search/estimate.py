"""The estimate of the vision search."""

import math
from dataclasses import dataclass
from typing import ClassVar

__all__ = ["AreaEstimate"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaEstimate:
    """The belief about the target's place in short.

    Attributes:
        time_us: vehicle time; for several vehicles, the time common to them.
        north_m, east_m: mean of the place.
        north_variance_m2, north_east_covariance_m2, east_variance_m2: its covariance.
        mode_north_m, mode_east_m: the most probable place.
        entropy_nats: differential entropy of the place.
        probability_of_detection: that the frames up to the first detection would have detected the target.
        detections: number of frames with a detection that were used.
        frames: number of frames that were used.
        subject: 0, a target.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("north_m", "east_m", "north_sigma_m", "east_sigma_m", "north_east_correlation"),
        *("mode_north_m", "mode_east_m", "entropy_nats", "probability_of_detection", "detections", "frames"),
    )

    time_us: int
    north_m: float
    east_m: float
    north_variance_m2: float
    north_east_covariance_m2: float
    east_variance_m2: float
    mode_north_m: float
    mode_east_m: float
    entropy_nats: float
    probability_of_detection: float
    detections: int
    frames: int
    subject: int = 0

    @property
    def sigma_m(self) -> float:
        """Standard deviation along the longest axis of the ellipse."""
        half = 0.5 * (self.north_variance_m2 - self.east_variance_m2)
        mean = 0.5 * (self.north_variance_m2 + self.east_variance_m2)
        return math.sqrt(mean + math.hypot(half, self.north_east_covariance_m2))

    def distance_squared(self, north_m: float, east_m: float) -> float:
        """Squared Mahalanobis distance of a place from the mean; 5.99 is the edge of the 95 % ellipse."""
        n, e = north_m - self.north_m, east_m - self.east_m
        nn, ne, ee = self.north_variance_m2, self.north_east_covariance_m2, self.east_variance_m2
        return (n * n * ee - 2.0 * n * e * ne + e * e * nn) / (nn * ee - ne * ne)

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        north_m, east_m = math.sqrt(self.north_variance_m2), math.sqrt(self.east_variance_m2)
        return (
            self.north_m,
            self.east_m,
            north_m,
            east_m,
            self.north_east_covariance_m2 / (north_m * east_m),
            self.mode_north_m,
            self.mode_east_m,
            self.entropy_nats,
            self.probability_of_detection,
            float(self.detections),
            float(self.frames),
        )
