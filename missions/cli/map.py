"""`flightstack map`: magnetic maps from and for other programs' files."""

from pathlib import Path
from typing import Final

import click

from estimators.survey.map_import_options import MapImport
from missions.cli.declared_options import declared_options
from missions.cli.later import body_in

_BODIES: Final = "missions.cli.bodies.map"


@click.group()
def magnetic_map() -> None:
    """Make magnetic maps from GeoTIFF, netCDF and line data, look into them, and export them."""


@magnetic_map.command(params=[*declared_options(MapImport)])
@click.argument("source", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    help="Map (.npz) that is written.",
)
@click.option("--home", metavar="LAT,LON,ALT", help="Origin of the map. [default: middle of the data, 0 m]")
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
