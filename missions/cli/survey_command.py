"""The command-line options of a magnetic survey."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import PLACE, SIDES, FiniteRange, degrees

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec


def _values(given: Given) -> Mapping[str, Any]:
    from missions.survey.options import CALIBRATION_ALTITUDE_M

    high = given["altitude"] is None and given["calibrate"]
    return {"level": not given["no_levelling"]} | ({"altitude_m": CALIBRATION_ALTITUDE_M} if high else {})


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.survey.world import survey_world

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
            type=SIDES,
            metavar="SIDE|WIDTHxHEIGHT",
            default="2000",
            help="Of the area, m: SIDE or WIDTHxHEIGHT (across the lines x along them).",
        ),
        option("--area", type=PLACE, help="Centre of the area, m. [default: the map's home]"),
        option("--direction", type=degrees, default=0.0, help="Of the lines, degrees from north."),
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
    made=("missions.survey.options", "SurveyOptions"),
    values=_values,
    world=_world,
)
