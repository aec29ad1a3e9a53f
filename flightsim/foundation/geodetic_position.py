"""A place on the Earth, apart from the geodesy that computes with it, so that options load without NumPy."""

import math
from dataclasses import dataclass

NorthEast = tuple[float, float]
"""North and east of an origin, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GeodeticPosition:
    """A point on or above the WGS84 ellipsoid: degrees, degrees, metres above mean sea level."""

    lat_deg: float
    lon_deg: float
    alt_m: float

    def __post_init__(self) -> None:
        if not -90.0 <= self.lat_deg <= 90.0:
            raise ValueError(f"latitude {self.lat_deg} deg is not in -90..90")
        if not -180.0 <= self.lon_deg <= 180.0:
            raise ValueError(f"longitude {self.lon_deg} deg is not in -180..180")
        if not math.isfinite(self.alt_m):
            raise ValueError(f"altitude {self.alt_m} m is not finite")
