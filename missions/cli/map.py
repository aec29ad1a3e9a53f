"""`flightstack map`: magnetic maps from and for other programs' files."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from estimators.errors import EstimatorError, LogError
from missions.cli.options import FiniteRange, in_options

if TYPE_CHECKING:
    from flightsim.foundation.magnetic_map_file import MapContents


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
def make(**given: Any) -> int:
    """Make a map from SOURCE: GeoTIFF, netCDF, grids of Surfer and Esri, or line data (.csv, .csv.xz, .xyz).

    The map is for fly --map, and for the parameter map_file of estimators. Line data need columns with names:
    longitude, latitude, and the field.
    """
    from estimators.logs.new_file import new_file
    from estimators.survey.map_import import MapImport, imported_map
    from estimators.survey.map_values import Values
    from flightsim.foundation.magnetic_map_file import map_file_bytes

    try:
        made = imported_map(
            given["source"],
            MapImport(
                home=_home(given["home"]),
                height_m=given["height"],
                spacing_m=given["spacing"],
                values=Values(given["values"]),
                decimal_year=given["year"],
                crs=given["crs"],
                column=given["column"],
                line_spacing_m=given["line_spacing"],
                error_nt=given["error"],
                no_data=given["no_data"],
            ),
        )
        with new_file(given["out"]) as part:
            part.write_bytes(map_file_bytes(made))
    except (EstimatorError, LogError) as error:
        raise click.UsageError(in_options(error)) from error
    _print(given["out"], made)
    return 0


@magnetic_map.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
def info(file: Path) -> int:
    """Print what a map covers."""
    from flightsim.foundation.magnetic_map_file import MagneticMapError, read_map_file

    try:
        _print(file, read_map_file(file))
    except MagneticMapError as error:
        raise click.UsageError(str(error)) from error
    return 0


@magnetic_map.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    help="GeoTIFF (.tif) or netCDF file (.nc) that is written.",
)
def export(file: Path, out: Path) -> int:
    """Write a map as GeoTIFF or netCDF in degrees of WGS84, for QGIS, GDAL, rasterio and xarray.

    Points without data are NaN. Home, height, error and line spacing are metadata of the file.
    """
    from estimators.survey.map_export import exported_map
    from flightsim.foundation.magnetic_map_file import MagneticMapError, read_map_file

    try:
        exported_map(read_map_file(file), out)
    except (EstimatorError, LogError, MagneticMapError) as error:
        raise click.UsageError(in_options(error)) from error
    click.echo(f"{out}: the map of {file} in degrees of WGS84 (EPSG:4326)")
    return 0


def _home(text: str | None) -> Any:
    from flightsim.foundation.geodesy import GeodeticPosition

    if text is None:
        return None
    accepted = "accepted is LAT,LON,ALT in degrees and metres, such as 47.4,8.55,400"
    try:
        lat_deg, lon_deg, alt_m = map(float, text.split(","))
    except ValueError:
        raise click.UsageError(f"--home {text!r} is not three numbers; {accepted}") from None
    try:
        return GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
    except ValueError as error:
        raise click.UsageError(f"--home {text!r}: {error}; {accepted}") from None


def _print(path: Path, contents: "MapContents") -> None:
    import numpy as np

    total = contents.total_field_nt
    finite = np.isfinite(total)
    home = contents.home
    north, east = contents.north_m, contents.east_m
    click.echo(f"{path}: {north.size} x {east.size} points, data at {100.0 * finite.mean():.1f} %")
    click.echo(
        f"home {home.lat_deg:.6f},{home.lon_deg:.6f},{home.alt_m:g}; valid {contents.height_m:g} m above it"
    )
    click.echo(
        f"north {north[0]:.0f} to {north[-1]:.0f} m, east {east[0]:.0f} to {east[-1]:.0f} m, "
        f"{north[1] - north[0]:g} x {east[1] - east[0]:g} m"
    )
    error = "not stated" if contents.error_nt is None else f"{contents.error_nt:g} nT"
    spacing = "not stated" if contents.line_spacing_m is None else f"{contents.line_spacing_m:g} m"
    click.echo(
        f"total field {total[finite].min():.0f} to {total[finite].max():.0f} nT, standard deviation "
        f"{total[finite].std():.1f} nT; error {error}; line spacing {spacing}"
    )
