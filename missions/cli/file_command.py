"""The command lines of files: a user's own mission in Python, and a ground station's mission file."""

from typing import Final

import click

from missions.cli.mission_command import MissionCommand, option


def arguments_of(pairs: tuple[str, ...]) -> dict[str, str]:
    """Values by name of repeated `--arg NAME=VALUE`.

    Raises:
        PlanError: one is not of this form.
    """
    from missions.errors import PlanError

    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (name and equals):
            raise PlanError(f"--arg {pair!r} is not NAME=VALUE")
        values[name] = value
    return values


_ALLOW_BELOW_HOME: Final = option(
    "--allow-below-home",
    is_flag=True,
    help="Heights below home may be commanded: where the ground is lower. [default: refused]",
    show_default=False,
)

OWN: Final = MissionCommand(
    help=(
        "Fly a mission of your own: a Python file with `async def fly(vehicle, options)`.\n\n"
        "It finds these in its `options` (altitude_m, speed_m_s, rate_hz, ...), and what --arg NAME=VALUE "
        "gives in `options.arguments`; what of it it goes by is its own affair."
    ),
    options=(
        option("--arg", multiple=True, metavar="NAME=VALUE", help="One of your own; repeat."),
        option("--altitude", type=float, default=10.0, help="Above home, m. Aircraft: 100."),
        option(
            "--speed", type=float, default=5.0, help="Ground speed, m/s; of an aircraft, airspeed: its own."
        ),
        option("--rate", type=float, default=25.0, help="Setpoints per second."),
        option(
            "--separation", type=float, default=4.0, help="Between the altitudes of a team, m. Aircraft: 20."
        ),
        _ALLOW_BELOW_HOME,
    ),
    made=("missions.base.options", "FlightOptions"),
    values=lambda given: {"arguments": arguments_of(given["arg"])},
)


FILE: Final = MissionCommand(
    help=(
        "Fly a mission file: QGroundControl's .plan, or QGC WPL 110 (.waypoints, .txt) of Mission Planner "
        "and MAVProxy.\n\n"
        "Fence and rally points of a .plan are uploaded too. The embedded SITL stands where the file's home "
        "is, and has the autopilot and the class of vehicle that the file names, unless --home, --autopilot "
        "and --model say otherwise."
    ),
    options=(
        option(
            "--then",
            type=click.Choice(["return", "land"]),
            help="After a mission that does not land by itself. [default: return; required for aircraft]",
        ),
        option("--time-limit", type=float, help="End the mission after so many seconds, with --then."),
        _ALLOW_BELOW_HOME,
    ),
    made=("missions.plan_files.options", "FileOptions"),
)
