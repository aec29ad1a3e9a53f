"""The command-line options of a magnetic survey."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import FiniteRange, radians_of

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec


def _build(given: Given, common: Mapping[str, Any]) -> Any:
    from missions.options import parse_pair
    from missions.survey.options import SurveyOptions

    width_m, height_m = parse_pair(given["size"], "--size", "x,")
    area = given["area"]
    if area is not None and "," not in area:
        raise click.UsageError(
            f"--area {area!r} is not a place; give NORTH,EAST in metres, for example 300,-150"
        )
    return SurveyOptions(
        **common,
        altitude_m=_altitude_m(given),
        width_m=width_m,
        height_m=height_m,
        area_ne_m=(0.0, 0.0) if area is None else parse_pair(area, "--area", ","),
        direction_rad=radians_of("--direction", given["direction"]),
        spacing_m=given["spacing"],
        tie_spacing_m=given["tie_spacing"],
        speed_m_s=given["speed"],
        map_file=given["map"],
        map_error_nt=given["map_error"],
        terrain_file=given["terrain"],
        climb=given["climb"],
        calibrate=given["calibrate"],
        compensation_file=given["compensation"],
        grid_m=given["grid"],
        level=not given["no_levelling"],
    )


def _altitude_m(given: Given) -> float:
    from missions.survey.options import ALTITUDE_M, CALIBRATION_ALTITUDE_M

    if given["altitude"] is not None:
        return float(given["altitude"])
    return CALIBRATION_ALTITUDE_M if given["calibrate"] else ALTITUDE_M


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.embedded import survey_world

    return survey_world(
        world,
        options,
        targets=given["targets"],
        vehicle_field=given["uncompensated"] or given["calibrate"] or given["compensation"] is not None,
        exact_map=given["exact_map"],
        daily_nt=given["daily_variation"],
    )


COMMAND: Final = MissionCommand(
    help=(
        "Measure the magnetic field along parallel lines and tie lines with an aircraft.\n\n"
        "Afterwards the lines are levelled, compared with the published map and gridded: line_data.csv and "
        ".xyz, lines.csv, anomalies.csv, survey_map.npz. With --calibrate it flies rolls, pitches and yaws "
        "on four headings instead, and writes the compensation of the aircraft. Places are metres from the "
        "map's home."
    ),
    options=(
        option(
            "--size",
            default="2000",
            help="Of the area, m: SIDE or WIDTHxHEIGHT (across the lines x along them).",
        ),
        option("--area", metavar="NORTH,EAST", help="Centre of the area, m. [default: the map's home]"),
        option("--direction", type=float, default=0.0, help="Of the lines, degrees from north."),
        option("--spacing", type=float, default=200.0, help="Between the lines, m."),
        option(
            "--tie-spacing",
            type=float,
            help="Between the tie lines, m; 0: none. [default: five line spacings]",
        ),
        option(
            "--altitude",
            type=float,
            help="Above home, or above the ground of --terrain, m. [default: 80; 800 with --calibrate]",
        ),
        option("--speed", type=float, help="Airspeed, m/s. [default: the aircraft's own]"),
        option(
            "--terrain",
            metavar="FILE",
            help="Heights of the ground to drape the flight over: CSV north_m,east_m,ground_m, or .npz.",
        ),
        option("--climb", type=float, default=0.06, help="Steepest slope of the drape."),
        option(
            "--map",
            metavar="FILE",
            help="Published magnetic map (.npz) to compare with. [default: the embedded world makes one from "
            "--seed; none with --connect]",
        ),
        option(
            "--map-error",
            type=float,
            help="Of the published map, one sigma, nT. [default: as the map states it, else 1]",
        ),
        option("--calibrate", is_flag=True, help="Fly a compensation, and write compensation.json."),
        option(
            "--compensation",
            metavar="FILE",
            help="Coefficients of the aircraft, from the folder of a flight with --calibrate.",
        ),
        option("--grid", type=float, help="Grid lines of the map, m. [default: a quarter of the spacing]"),
        option("--no-levelling", is_flag=True, help="Leave the lines at their own levels."),
        option(
            "--targets",
            scope=Scope.EMBEDDED,
            type=click.IntRange(0, 100),
            default=0,
            help="Dipoles in the embedded world's area, drawn from --seed.",
        ),
        option(
            "--uncompensated",
            is_flag=True,
            scope=Scope.EMBEDDED,
            help="The embedded magnetometer feels its whole aircraft. [default: with --calibrate and "
            "--compensation]",
        ),
        option(
            "--daily-variation",
            type=FiniteRange(min=0.0, max=1000.0),
            scope=Scope.EMBEDDED,
            metavar="NT",
            help="Dip of the embedded world's field at noon, nT, with pulsations. [default: none]",
        ),
        option(
            "--exact-map",
            is_flag=True,
            scope=Scope.EMBEDDED,
            help="The embedded world's field is the map's, without the error of a survey.",
        ),
    ),
    build=_build,
    world=_world,
    fields=MappingProxyType(
        {
            "size": ("width_m", "height_m"),
            "area": ("area_ne_m",),
            "direction": ("direction_rad",),
            "tie_spacing": ("tie_spacing_m",),
            "map": ("map_file",),
            "map_error": ("map_error_nt",),
            "terrain": ("terrain_file",),
            "compensation": ("compensation_file",),
            "grid": ("grid_m",),
            "no_levelling": ("level",),
            "uncompensated": ("vehicle_field",),
            "daily_variation": ("daily_nt",),
        }
    ),
)
