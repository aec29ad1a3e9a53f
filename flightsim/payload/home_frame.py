"""Where a vehicle is in the world's own frame: local NED, metres, origin on the ground at home."""

import math

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.geodesy import curvature_radii_m
from flightsim.foundation.vectors import wrap_180
from flightsim.home import Home

Array = NDArray[np.float64]


class HomeFrame:
    """Local NED at home, linear in latitude and longitude with the radii of curvature there.

    The inverse of `Home.offset`, and the frame missions use, so that both sides mean the same place. (Against
    the true tangent plane it is off by 10 m at 10 km.) Targets and magnetic maps live in it; the ground is
    the plane down = 0.
    """

    def __init__(self, home: Home) -> None:
        self.home = home
        meridian_m, normal_m = curvature_radii_m(home.lat_deg)
        self._m_per_rad_lat = meridian_m + home.alt_m
        self._m_per_rad_lon = (normal_m + home.alt_m) * math.cos(math.radians(home.lat_deg))

    def north_east_m(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """(north, east) in metres of a place, WGS84."""
        dlon_deg = wrap_180(lon_deg - self.home.lon_deg)
        return (
            math.radians(lat_deg - self.home.lat_deg) * self._m_per_rad_lat,
            math.radians(dlon_deg) * self._m_per_rad_lon,
        )

    def position_ned_m(self, truth: Array) -> tuple[float, float, float]:
        """(north, east, down) in metres of the vehicle with this truth vector."""
        north_m, east_m = self.north_east_m(
            math.degrees(float(truth[t.LAT_RAD])), math.degrees(float(truth[t.LON_RAD]))
        )
        return north_m, east_m, self.home.alt_m - float(truth[t.ALT_M])
