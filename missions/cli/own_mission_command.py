"""The command line of a user's own mission file: the contents of its `options`."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from missions.cli.mission_command import Given, MissionCommand, option


def _arguments(pairs: tuple[str, ...]) -> dict[str, str]:
    from missions.errors import PlanError

    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (name and equals):
            raise PlanError(f"--arg {pair!r} is not NAME=VALUE")
        values[name] = value
    return values


def _build(given: Given, common: Mapping[str, Any]) -> Any:
    from missions.options import FlightOptions

    return FlightOptions(
        **common,
        arguments=_arguments(given["arg"]),
        altitude_m=given["altitude"],
        speed_m_s=given["speed"],
        rate_hz=given["rate"],
        separation_m=given["separation"],
    )


COMMAND: Final = MissionCommand(
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
    ),
    build=_build,
    fields=MappingProxyType({"rate": ("rate_hz",)}),
)
