"""From survey lines to a map: readings along flown lines, interpolated onto a regular grid."""

import numpy as np
from matplotlib.tri import LinearTriInterpolator, Triangulation
from numpy.typing import NDArray

from flightsim.foundation.main_field import MainField
from flightsim.home import Home
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.magnetic_map import MagneticMap, MagneticMapError

Array = NDArray[np.float64]


def map_from_survey(
    lat_deg: Array,
    lon_deg: Array,
    anomaly_nt: Array,
    *,
    home: Home,
    height_m: float,
    spacing_m: float = 100.0,
    max_gap_m: float = 2000.0,
    decimal_year: float = 2026.0,
) -> MagneticMap:
    """Grid an aeromagnetic survey, linearly over the triangles of its points (Delaunay).

    Args:
        lat_deg, lon_deg: (n,) places of the readings, WGS84.
        anomaly_nt: (n,) readings less the main field of their time; the present main field is added.
        home: origin of the map's frame.
        height_m: above home, taken as the height of all readings.
        spacing_m: of the grid.
        max_gap_m: triangles with a longer side are gaps in the survey: no data.
        decimal_year: date of the main field (WMM-2025).

    Raises:
        MagneticMapError: too few points, or no area between them.
    """
    frame = HomeFrame(home)
    places = np.array(
        [frame.north_east_m(lat, lon) for lat, lon in zip(lat_deg.tolist(), lon_deg.tolist(), strict=True)]
    ).reshape(-1, 2)
    # Points that repeat a place make no triangle; the first reading stands.
    _, first = np.unique(np.round(places, 2), axis=0, return_index=True)
    places, readings_nt = places[np.sort(first)], np.asarray(anomaly_nt, dtype=np.float64)[np.sort(first)]
    if len(places) < 3:
        raise MagneticMapError(f"a survey of {len(places)} places makes no map; 3 or more do")
    low = np.ceil(places.min(axis=0) / spacing_m) * spacing_m
    count = np.floor((places.max(axis=0) - low) / spacing_m).astype(int) + 1
    if count.min() < 2:
        raise MagneticMapError(f"the survey is narrower than two grid lines of spacing_m = {spacing_m}")
    north_m = low[0] + spacing_m * np.arange(count[0])
    east_m = low[1] + spacing_m * np.arange(count[1])
    try:
        triangles = Triangulation(places[:, 1], places[:, 0])
    except (RuntimeError, ValueError) as error:
        raise MagneticMapError(f"the survey's points make no triangles: {error}") from None
    corners = places[triangles.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    triangles.set_mask(sides.max(axis=1) > max_gap_m)
    anomaly = LinearTriInterpolator(triangles, readings_nt)(*np.meshgrid(east_m, north_m)).filled(np.nan)
    main_nt = MainField(home, decimal_year).total_at_nt(north_m[:, None], east_m[None, :], height_m)
    return MagneticMap(
        north_m=north_m, east_m=east_m, total_field_nt=main_nt + anomaly, height_m=height_m, home=home
    )
