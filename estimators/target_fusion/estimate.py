"""The target fusion's estimate of a target."""

import math
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetEstimate:
    """The position of a target.

    Attributes:
        time_us: vehicle time of the newest detection in it.
        subject: 0, a target.
        target: number of its tag; 255: no tag.
        vehicle: system id of the drone whose detection came last.
        lat_deg, lon_deg: its position.
        alt_m: assumed altitude of its ground, which is that of home, above mean sea level.
        north_m, east_m: position from the pattern's centre.
        north_variance_m2, north_east_covariance_m2, east_variance_m2: covariance of that position.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        "target",
        "vehicle",
        "lat_deg",
        "lon_deg",
        "north_m",
        "east_m",
        "north_sigma_m",
        "east_sigma_m",
        "north_east_correlation",
    )

    time_us: int
    subject: int = 0
    target: int
    vehicle: int
    lat_deg: float
    lon_deg: float
    alt_m: float
    north_m: float
    east_m: float
    north_variance_m2: float
    north_east_covariance_m2: float
    east_variance_m2: float

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        north_m, east_m = math.sqrt(self.north_variance_m2), math.sqrt(self.east_variance_m2)
        return (
            float(self.target),
            float(self.vehicle),
            self.lat_deg,
            self.lon_deg,
            self.north_m,
            self.east_m,
            north_m,
            east_m,
            self.north_east_covariance_m2 / (north_m * east_m),
        )
