"""What `flightstack map` does."""

from pathlib import Path
from typing import Any

import click
import numpy as np

from estimators.errors import EstimatorError, LogError
from estimators.logs.new_file import new_file
from estimators.survey.map_export import exported_map
from estimators.survey.map_import import imported_map
from estimators.survey.map_import_options import MapImport
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.magnetic_map_file import (
    MagneticMapError,
    MapContents,
    map_file_bytes,
    read_map_file,
)
from missions.cli.declared_options import specified
from missions.cli.options import in_options


def make(**given: Any) -> int:
    """`flightstack map make`."""
    try:
        made = imported_map(given["source"], specified(MapImport, home=_home(given["home"])))
        with new_file(given["out"]) as part:
            part.write_bytes(map_file_bytes(made))
    except (EstimatorError, LogError) as error:
        raise click.UsageError(in_options(error)) from error
    _print(given["out"], made)
    return 0


def info(file: Path) -> int:
    """`flightstack map info`."""
    try:
        _print(file, read_map_file(file))
    except MagneticMapError as error:
        raise click.UsageError(str(error)) from error
    return 0


def export(file: Path, out: Path) -> int:
    """`flightstack map export`."""
    try:
        exported_map(read_map_file(file), out)
    except (EstimatorError, LogError, MagneticMapError) as error:
        raise click.UsageError(in_options(error)) from error
    click.echo(f"{out}: the map of {file} in degrees of WGS84 (EPSG:4326)")
    return 0


def _home(text: str | None) -> Any:
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


def _print(path: Path, contents: MapContents) -> None:
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
