"""The Earth as WGS84 has it (NGA.STND.0036): ellipsoid, gravity, rotation, and local NED frames.

`LocalFrame` linearises around its origin with the local radii of curvature: against the true tangent plane
(`pymap3d`) it is off by 1 mm at 100 m, 0.1 m at 1 km, 10 m at 10 km. Autopilots have other frames
(`firmware_frames`).
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from flightsim.foundation.geodetic_position import GeodeticPosition as GeodeticPosition
from flightsim.foundation.vectors import Angle, wrap_180

WGS84_A_M: Final = 6378137.0
WGS84_E2: Final = 6.69437999014e-3
EARTH_RATE_RAD_S: Final = 7.292115e-5
"""Table 3.1."""
MEAN_RADIUS_M: Final = 6_371_000.0
"""Of a sphere, where a part in 300 does not matter."""

# normal gravity (equations 4-1 and 4-3)
_EQUATOR_M_S2: Final = 9.7803253359
_SOMIGLIANA_K: Final = 0.00193185265241
_SOMIGLIANA_E2: Final = 0.00669437999013  # of the first edition: another digit would change flights
_FLATTENING: Final = 0.00335281066475
_CENTRIFUGAL_RATIO: Final = 0.00344978650684


def curvature_radii_m(lat_deg: float) -> tuple[float, float]:
    """Radii of curvature of the ellipsoid, m (section 4): in the meridian, in the prime vertical."""
    sin_lat = math.sin(math.radians(lat_deg))
    w2 = 1.0 - WGS84_E2 * sin_lat * sin_lat
    normal_m = WGS84_A_M / math.sqrt(w2)
    return normal_m * (1.0 - WGS84_E2) / w2, normal_m


def normal_gravity_m_s2(lat_deg: float, alt_m: float) -> float:
    """Gravity on and above the ellipsoid, m/s^2 (equations 4-1 and 4-3 to second order)."""
    sin2 = math.sin(math.radians(lat_deg)) ** 2
    surface = _EQUATOR_M_S2 * (1.0 + _SOMIGLIANA_K * sin2) / math.sqrt(1.0 - _SOMIGLIANA_E2 * sin2)
    h = alt_m / WGS84_A_M
    return surface * (
        1.0 - 2.0 * (1.0 + _FLATTENING + _CENTRIFUGAL_RATIO - 2.0 * _FLATTENING * sin2) * h + 3.0 * h * h
    )


def earth_rate_ned_rad_s(lat_deg: float) -> tuple[float, float, float]:
    """Rotation of the Earth against inertial space in NED, rad/s."""
    lat = math.radians(lat_deg)
    return EARTH_RATE_RAD_S * math.cos(lat), 0.0, -EARTH_RATE_RAD_S * math.sin(lat)


def longitude_near(lon_deg: Angle, middle_deg: float = 0.0) -> Angle:
    """A longitude, or an array of them, within 180 degrees of a middle one.

    One that is within stays exactly as it is; `wrap_180` rounds.
    """
    return lon_deg - 360.0 * np.round((lon_deg - middle_deg) / 360.0)


class LocalFrame:
    """Local NED tangent frame with its origin at a geodetic position."""

    def __init__(self, origin: GeodeticPosition) -> None:
        self.origin = origin
        cos_lat = math.cos(math.radians(origin.lat_deg))
        meridian_m, normal_m = curvature_radii_m(origin.lat_deg)
        self._m_per_deg_lat = math.radians(meridian_m + origin.alt_m)
        self._m_per_deg_lon = math.radians((normal_m + origin.alt_m) * cos_lat)

    @property
    def metres_per_degree(self) -> tuple[float, float]:
        """Metres per degree of latitude and of longitude at the origin."""
        return self._m_per_deg_lat, self._m_per_deg_lon

    @property
    def stretch(self) -> tuple[float, float]:
        """Metres of this frame in a metre over ground, to the north and to the east of the origin."""
        north_m, east_m = self.metres_per_degree
        return north_m / self._m_per_deg_lat, east_m / self._m_per_deg_lon

    def ned_from_geodetic(self, lat_deg: Angle, lon_deg: Angle, alt_m: Angle) -> tuple[Angle, Angle, Angle]:
        """(north, east, down) in metres of a geodetic point, or of an array of them (n,) each.

        East is the short way round: nothing else subtracts longitudes, so that no place loses it at 180
        degrees. Places are interpolated and averaged after this conversion, not before.
        """
        dlon = wrap_180(lon_deg - self.origin.lon_deg)
        return (
            (lat_deg - self.origin.lat_deg) * self._m_per_deg_lat,
            dlon * self._m_per_deg_lon,
            self.origin.alt_m - alt_m,
        )

    def geodetic_from_ned(self, north_m: Angle, east_m: Angle, down_m: Angle) -> tuple[Angle, Angle, Angle]:
        """(latitude deg, longitude deg, altitude m) of a local point, or of an array of them (n,) each."""
        return (
            self.origin.lat_deg + north_m / self._m_per_deg_lat,
            wrap_180(self.origin.lon_deg + east_m / self._m_per_deg_lon),
            self.origin.alt_m - down_m,
        )


FrameAt = Callable[[GeodeticPosition], LocalFrame]
"""A kind of local frame: makes the one with its origin at a position."""
