"""`flightstack map`: magnetic maps from and for other programs' files."""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in
from missions.cli.options import FiniteRange

_BODIES: Final = "missions.cli.bodies.map"


@click.group()
def magnetic_map() -> None:
    """Make magnetic maps from GeoTIFF, netCDF and line data, look into them, and export them."""


@magnetic_map.command(context_settings={"show_default": True})
@click.argument("source", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    help="Map (.npz) that is written.",
)
@click.option(
    "--values",
    type=click.Choice(["total", "anomaly-wmm", "anomaly-igrf"]),
    default="total",
    help="Total field, or an anomaly that the main field of a model is added to.",
)
@click.option("--year", type=float, default=2026.0, help="Year of that main field.")
@click.option("--home", metavar="LAT,LON,ALT", help="Origin of the map. [default: middle of the data, 0 m]")
@click.option("--height", type=FiniteRange(), default=100.0, help="Above home, what the map is valid at, m.")
@click.option("--spacing", type=float, default=100.0, help="Distance of the map's grid lines, m.")
@click.option("--line-spacing", type=float, help="Distance of the survey's lines, m; needed for line data.")
@click.option("--error", type=float, help="Standard deviation that the survey states, nT.")
@click.option(
    "--no-data",
    type=float,
    metavar="VALUE",
    help="Value that stands for no data. [default: what the file marks as such]",
)
@click.option(
    "--crs",
    help="Coordinate reference system of the places, such as EPSG:32723, in place of the file's. [default: "
    "the file's; WGS84 for tables, and for netCDF in degrees without one]",
)
@click.option(
    "--column",
    metavar="NAME",
    help="Column or variable of the field; number or description of a GeoTIFF's band. [default: the one with "
    "a usual name, such as total_field_nt, or the only one]",
)
@body_in(_BODIES)
def make() -> None:
    """Make a map from SOURCE: GeoTIFF, netCDF, grids of Surfer and Esri, or line data (.csv, .csv.xz, .xyz).

    The map is for fly --map, and for the parameter map_file of estimators. Line data need columns with names:
    longitude, latitude, and the field.
    """


@magnetic_map.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@body_in(_BODIES)
def info() -> None:
    """Print what a map covers."""


@magnetic_map.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    help="GeoTIFF (.tif) or netCDF file (.nc) that is written.",
)
@body_in(_BODIES)
def export() -> None:
    """Write a map as GeoTIFF or netCDF in degrees of WGS84, for QGIS, GDAL, rasterio and xarray.

    Points without data are NaN. Home, height, error and line spacing are metadata of the file.
    """
