"""Local NED frames as the firmwares project the Earth: those of their local positions and local setpoints.

Neither is that of WGS84 (`LocalFrame`). PX4 projects on a sphere: at Zurich 1 km to the east is 997 m.
ArduPilot takes a degree of latitude for as long as one of longitude at the equator: at Canberra 1 km to the
north is 1003.4 m.
"""

import math
from abc import abstractmethod
from typing import Final

import numpy as np

from flightsim.foundation.geodesy import MEAN_RADIUS_M, LocalFrame
from flightsim.foundation.geodetic_position import GeodeticPosition, NorthEast
from flightsim.foundation.vectors import Angle, wrap_180

_ARDUPILOT_M_PER_DEG: Final = 0.011131884502145034e7


class FirmwareFrame(LocalFrame):
    """Base of the frames that are no linear function of latitude and longitude."""

    @abstractmethod
    def project(self, lat_deg: float, lon_deg: float) -> NorthEast:
        """North and east of a place."""

    @abstractmethod
    def reproject(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude in degrees; the inverse of `project`."""

    def ned_from_geodetic(self, lat_deg: Angle, lon_deg: Angle, alt_m: Angle) -> tuple[Angle, Angle, Angle]:
        """As of the base."""
        if isinstance(lat_deg, float | int):
            north_m, east_m = self.project(lat_deg, lon_deg)
        else:
            north_m, east_m = np.vectorize(self.project, otypes=[float, float])(lat_deg, lon_deg)
        return north_m, east_m, self.origin.alt_m - alt_m

    def geodetic_from_ned(self, north_m: Angle, east_m: Angle, down_m: Angle) -> tuple[Angle, Angle, Angle]:
        """As of the base."""
        if isinstance(north_m, float | int):
            lat_deg, lon_deg = self.reproject(north_m, east_m)
        else:
            lat_deg, lon_deg = np.vectorize(self.reproject, otypes=[float, float])(north_m, east_m)
        return lat_deg, lon_deg, self.origin.alt_m - down_m


class Px4Frame(FirmwareFrame):
    """Azimuthal equidistant projection of a sphere (Snyder, "Map Projections: A Working Manual", chapter 25).

    Source: PX4 1.16, src/lib/geo/geo.cpp, MapProjection.
    """

    def __init__(self, origin: GeodeticPosition) -> None:
        super().__init__(origin)
        lat = math.radians(origin.lat_deg)
        self._sin, self._cos = math.sin(lat), math.cos(lat)

    @property
    def metres_per_degree(self) -> tuple[float, float]:
        """As of the base."""
        return math.radians(MEAN_RADIUS_M), math.radians(MEAN_RADIUS_M) * self._cos

    def project(self, lat_deg: float, lon_deg: float) -> NorthEast:
        """As of the base."""
        lat, dlon = math.radians(lat_deg), math.radians(wrap_180(lon_deg - self.origin.lon_deg))
        sin_lat, cos_lat, cos_dlon = math.sin(lat), math.cos(lat), math.cos(dlon)
        north = self._cos * sin_lat - self._sin * cos_lat * cos_dlon
        east = cos_lat * math.sin(dlon)
        sin_arc = math.hypot(north, east)
        arc = math.atan2(sin_arc, self._sin * sin_lat + self._cos * cos_lat * cos_dlon)
        scale = MEAN_RADIUS_M * (arc / sin_arc if sin_arc > 0.0 else 1.0)
        return scale * north, scale * east

    def reproject(self, north_m: float, east_m: float) -> tuple[float, float]:
        """As of the base."""
        north, east = north_m / MEAN_RADIUS_M, east_m / MEAN_RADIUS_M
        arc = math.hypot(north, east)
        scale = math.sin(arc) / arc if arc > 0.0 else 1.0
        up, north, east = math.cos(arc), scale * north, scale * east
        lat = math.asin(min(1.0, max(-1.0, up * self._sin + north * self._cos)))
        lon = math.atan2(east, up * self._cos - north * self._sin)
        return math.degrees(lat), wrap_180(self.origin.lon_deg + math.degrees(lon))


class ArduPilotFrame(FirmwareFrame):
    """Degrees of one length, those of longitude with the cosine of the mean latitude.

    Source: ArduPilot 4.6, libraries/AP_Common/Location.cpp, get_distance_NE and offset_latlng.
    """

    @property
    def metres_per_degree(self) -> tuple[float, float]:
        """As of the base."""
        return _ARDUPILOT_M_PER_DEG, self._per_deg_lon(self.origin.lat_deg)

    def project(self, lat_deg: float, lon_deg: float) -> NorthEast:
        """As of the base."""
        east_deg = wrap_180(lon_deg - self.origin.lon_deg)
        return (lat_deg - self.origin.lat_deg) * _ARDUPILOT_M_PER_DEG, east_deg * self._per_deg_lon(lat_deg)

    def reproject(self, north_m: float, east_m: float) -> tuple[float, float]:
        """As of the base."""
        lat_deg = self.origin.lat_deg + north_m / _ARDUPILOT_M_PER_DEG
        return lat_deg, wrap_180(self.origin.lon_deg + east_m / self._per_deg_lon(lat_deg))

    def _per_deg_lon(self, lat_deg: float) -> float:
        mean_lat = math.radians(0.5 * (self.origin.lat_deg + lat_deg))
        return _ARDUPILOT_M_PER_DEG * max(0.01, math.cos(mean_lat))
