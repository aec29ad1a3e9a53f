"""Where the world's origin is: a point on the ground, and the way a vehicle points when it stands there."""

import math
from dataclasses import dataclass
from typing import Self

from flightsim.foundation.geodesy import curvature_radii_m, longitude_near


@dataclass(frozen=True, slots=True, kw_only=True)
class Home:
    """A point on the ground, WGS84. The ground is level at its altitude.

    Attributes:
        lat_deg, lon_deg: geodetic latitude and longitude.
        alt_m: altitude of the ground above mean sea level.
        heading_deg: true heading, clockwise from north.
    """

    lat_deg: float = 47.397742
    lon_deg: float = 8.545594
    alt_m: float = 488.0
    heading_deg: float = 0.0

    def __post_init__(self) -> None:
        if not -89.9 <= self.lat_deg <= 89.9:
            raise ValueError(f"home latitude {self.lat_deg} deg is not in -89.9..89.9")
        if not -180.0 <= self.lon_deg <= 180.0:
            raise ValueError(f"home longitude {self.lon_deg} deg is not in -180..180")
        if not -500.0 <= self.alt_m <= 9000.0:
            raise ValueError(f"home altitude {self.alt_m} m is not in -500..9000 m")
        if not -360.0 <= self.heading_deg <= 360.0:
            raise ValueError(f"home heading {self.heading_deg} deg is not in -360..360")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Home from "lat,lon,alt[,heading]", as ArduPilot's SITL writes it; an empty altitude is the default.

        Raises:
            ValueError: the text has another form, or a number is out of range.
        """
        try:
            lat, lon, alt, *heading = text.split(",")
            numbers = [
                float(lat),
                float(lon),
                float(alt) if alt.strip() else cls().alt_m,
                *map(float, heading),
            ]
        except ValueError:
            numbers = []
        if len(numbers) not in (3, 4):
            raise ValueError(
                f"home {text!r} is not 'lat,lon,alt[,heading]', for example 47.3977,8.5456,489,0"
            )
        heading_deg = numbers[3] if len(numbers) == 4 else 0.0
        return cls(lat_deg=numbers[0], lon_deg=numbers[1], alt_m=numbers[2], heading_deg=heading_deg)

    def offset(self, north_m: float, east_m: float) -> tuple[float, float]:
        """(latitude deg, longitude deg) of a point on the ground near home.

        Uses the ellipsoid's radii of curvature at home.
        """
        meridian_m, normal_m = curvature_radii_m(self.lat_deg)
        parallel_m = (normal_m + self.alt_m) * math.cos(math.radians(self.lat_deg))
        return (
            self.lat_deg + math.degrees(north_m / (meridian_m + self.alt_m)),
            float(longitude_near(self.lon_deg + math.degrees(east_m / parallel_m))),
        )
