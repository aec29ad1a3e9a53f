"""How a file becomes a magnetic map."""

from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.geodetic_position import GeodeticPosition
from flightsim.foundation.options import Options, option


class Values(StrEnum):
    """What the values of a file are."""

    TOTAL = "total"
    ANOMALY_WMM = "anomaly-wmm"
    ANOMALY_IGRF = "anomaly-igrf"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapImport(Options):
    """How a file becomes a map.

    Attributes:
        home: origin of the map's frame; None: the middle of the data, at sea level.
        height_m: height above home at which the map is valid.
        spacing_m: distance of its grid lines.
        values: whether the file has total field, or an anomaly that a main field is to be added to.
        decimal_year: date of the main field.
        crs: coordinate reference system of the places ("EPSG:32723"), also in place of the one that the file
            declares; None: that one, and WGS84 for tables and netCDF grids in degrees without one.
        column: name of the value's column or variable, number or description of its band; None: the only
            one that can be it.
        line_spacing_m: distance of the survey's lines; needed for line data.
        error_nt: standard deviation that the survey states.
        no_data: value that stands for no data, where the file does not mark it as such.
    """

    home: GeodeticPosition | None = None
    values: Values = option(
        Values.TOTAL, help="Total field, or an anomaly that the main field of a model is added to."
    )
    decimal_year: float = option(2026.0, name="year", metavar="YEAR", help="Year of that main field.")
    height_m: float = option(100.0, help="Height above home at which the map is valid.")
    spacing_m: float = option(100.0, above=0.0, help="Distance of the map's grid lines.")
    line_spacing_m: float | None = option(
        None, above=0.0, help="Distance of the survey's lines; needed for line data."
    )
    error_nt: float | None = option(None, above=0.0, help="Standard deviation that the survey states.")
    no_data: float | None = option(
        None, metavar="VALUE", varies="what the file marks as such", help="Value that stands for no data."
    )
    crs: str | None = option(
        None,
        metavar="CRS",
        varies="the file's; WGS84 for tables, and for netCDF in degrees without one",
        help="Coordinate reference system of the places, such as EPSG:32723, in place of the file's.",
    )
    column: str | None = option(
        None,
        metavar="NAME",
        varies="the one with a usual name, such as total_field_nt, or the only one",
        help="Column or variable of the field; number or description of a GeoTIFF's band.",
    )
