"""`flightstack fly`: a mission from one command."""

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli_types import SPEEDUP

if TYPE_CHECKING:
    from missions.session import Flight, RunResult

_FAILED, _USAGE, _INTERRUPTED = 1, 2, 130


class _Line:
    """The progress line on a terminal; nothing in a pipe."""

    def __init__(self) -> None:
        self._shown = False
        self._last_wall_s = -math.inf

    def __call__(self, flight: "Flight") -> None:
        from autopilot_bridge.clock.pacing import wall_time_s
        from missions.telemetry import Position

        now_s = wall_time_s()
        if now_s - self._last_wall_s < 0.1 or flight.clock is None:
            return
        self._last_wall_s = now_s
        time_s = flight.clock.time_us * 1e-6
        factor = time_s / max(now_s - flight.started_wall_s, 1e-3)
        heard = [vehicle for vehicle in flight.vehicles if vehicle.notes.system_id]
        mode, height, progress = "waiting", "", 0.0
        if heard:
            mode = "/".join(dict.fromkeys(vehicle.mode for vehicle in heard))
            positions = [vehicle.latest(Position) for vehicle in heard]
            height = "/".join(f"{p.height_m:.1f}" for p in positions if p) + " m"
            progress = sum(vehicle.notes.progress for vehicle in heard) / len(heard)
        text = f"{time_s:8.1f} s  x{factor:<6.1f} {mode:<10} {height:>8}  {100.0 * progress:3.0f} %"
        click.echo(f"\r{text:<72}", nl=False, err=True)
        self._shown = True

    def end(self) -> None:
        """Leave the line."""
        if self._shown:
            click.echo("", err=True)


def _arguments(pairs: tuple[str, ...]) -> dict[str, str]:
    from missions.errors import PlanError

    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (name and equals):
            raise PlanError(f"--arg {pair!r} is not NAME=VALUE")
        values[name] = value
    return values


def _ratio(text: str) -> tuple[float, float]:
    """ "3:4", or a single number for so much to one."""
    from missions.options import parse_pair

    x, y = parse_pair(text, "--ratio", ":/,")
    if not any(mark in text for mark in ":/,"):
        y = 1.0
    for frequency in (x, y):
        if frequency <= 0.0:
            raise click.UsageError(f"--ratio {text}: frequency {frequency:g} is not above 0; try --ratio 3:4")
    return x, y


def _options(given: dict[str, Any]) -> Any:
    from missions.options import FlightOptions, Via, parse_pair

    width_m, height_m = parse_pair(given["size"], "--size", "x,")
    if given["amplitude_x"] is not None:
        width_m = 2.0 * given["amplitude_x"]
    if given["amplitude_y"] is not None:
        height_m = 2.0 * given["amplitude_y"]
    ratio = None if given["ratio"] is None else _ratio(given["ratio"])
    phase_x_deg = phase_y_deg = None
    if given["phase"] is not None:
        phase_x_deg, phase_y_deg = parse_pair(given["phase"], "--phase", ",")
        if "," not in given["phase"]:
            phase_y_deg = 0.0  # one number is the difference of the two phases
    return FlightOptions(
        pattern=given["pattern"],
        width_m=width_m,
        height_m=height_m,
        ratio=ratio,
        phase_x_rad=None if phase_x_deg is None else math.radians(phase_x_deg),
        phase_y_rad=None if phase_y_deg is None else math.radians(phase_y_deg),
        spacing_m=given["spacing"],
        heading_rad=math.radians(given["heading"]),
        altitude_m=given["altitude"],
        speed_m_s=given["speed"],
        period_s=given["period"],
        periods=given["periods"],
        search_time_s=given["search_time"],
        via=Via(given["via"]),
        acceptance_m=given["acceptance"],
        rate_hz=given["rate"],
        vehicles=given["vehicles"] or max(1, len(given["connect"])),
        separation_m=given["separation"],
        arguments=_arguments(given["arg"]),
    )


_EMBEDDED_ONLY: Final = ("autopilot", "model", "home", "seed", "wind", "turbulence", "speedup")


@click.command(context_settings={"show_default": True})
@click.argument("mission")
@click.option("--pattern", default="L3", help="Lissajous pattern: L1 (circle), L2, L3, L4.")
@click.option("--size", default="100", help="Size of the pattern, m: SIDE or WIDTHxHEIGHT (east x north).")
@click.option("--amplitude-x", type=float, help="Half the width, m (east), in place of --size.")
@click.option("--amplitude-y", type=float, help="Half the height, m (north).")
@click.option("--ratio", help="Frequencies X:Y of a Lissajous pattern of your own, e.g. 3:4 or 1.4.")
@click.option("--phase", help="Phases of x and y, degrees: X,Y or their difference.")
@click.option("--spacing", type=float, default=10.0, help="Track spacing of sweeps and squares, m.")
@click.option("--heading", type=float, default=0.0, help="First leg of sweeps and sectors, degrees.")
@click.option("--altitude", type=float, default=10.0, help="Above home, m.")
@click.option("--speed", type=float, default=5.0, help="Ground speed, m/s.")
@click.option("--period", type=float, help="Seconds once round a Lissajous pattern, in place of --speed.")
@click.option("--periods", type=float, default=1.0, help="Times round.")
@click.option("--search-time", type=float, help="Repeat the pattern for so many seconds.")
@click.option(
    "--via", type=click.Choice(["waypoints", "setpoints"]), default="waypoints", help="How it is flown."
)
@click.option("--acceptance", type=float, default=2.0, help="Waypoint acceptance radius, m.")
@click.option("--rate", type=float, default=25.0, help="Setpoints per second.")
@click.option("--vehicles", type=click.IntRange(1, 250), help="Team size. [default: 1, or one per --connect]")
@click.option("--separation", type=float, default=4.0, help="Between the altitudes of a team, m.")
@click.option(
    "--connect", multiple=True, metavar="URL", help="A vehicle elsewhere: udpin:0.0.0.0:14550, serial:..."
)
@click.option(
    "--autopilot", type=click.Choice(["px4", "ardupilot"]), default="px4", help="Of the embedded SITL."
)
@click.option("--model", default="iris", help="Vehicle of the embedded SITL: a name, or a path.")
@click.option("--home", help="lat,lon,alt[,heading] of the embedded SITL. [default: the firmware's own]")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="One seed makes one flight.")
@click.option("--wind", default="0", metavar="SPEED[@FROM]", help="m/s, and degrees it comes from.")
@click.option("--turbulence", type=click.Choice(["none", "light", "moderate", "severe"]), default="none")
@click.option("--speedup", type=SPEEDUP, help="At most this fast. [default: no limit]")
@click.option(
    "--params", metavar="FILE", help="Autopilot parameters to set (NAME VALUE lines, .parm, .params)."
)
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/MISSION-N]")
@click.option(
    "--on-failure", type=click.Choice(["return", "land", "hold"]), default="return", help="Or on Ctrl-C."
)
@click.option(
    "--onboard", is_flag=True, help="Speak as the vehicle's companion computer (191), not as a GCS."
)
@click.option("--no-picture", is_flag=True, help="Don't draw track.png.")
@click.option("--arg", multiple=True, metavar="NAME=VALUE", help="For a mission of your own.")
def fly(**given: Any) -> int:
    """Fly MISSION: lissajous, sector, parallel-sweep, expanding-square, or a Python file of your own.

    Your own file has `async def fly(vehicle, options)`.
    The run folder gets flight.tlog, summary.json and track.png.
    """
    from missions.errors import PlanError

    if given["connect"]:
        _refuse_embedded_options(click.get_current_context())
    try:
        return _fly(given)
    except PlanError as error:
        raise click.UsageError(str(error)) from error


def _refuse_embedded_options(context: click.Context) -> None:
    """A vehicle elsewhere has its own wind: an option that would do nothing is not passed over in silence."""
    given = [
        f"--{name}"
        for name in _EMBEDDED_ONLY
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
    ]
    if given:
        raise click.UsageError(
            f"{', '.join(given)}: of the embedded SITL only, has no effect with --connect; leave it out"
        )


def _fly(given: dict[str, Any]) -> int:
    from missions.library import find_mission
    from missions.options import parameters_from_file, parse_wind

    mission = find_mission(given["mission"])
    options = _options(given)
    wind_speed_m_s, wind_from_deg = parse_wind(given["wind"])
    parameters = {} if given["params"] is None else parameters_from_file(given["params"])
    if given["out"] is not None and given["out"].is_dir() and any(given["out"].iterdir()):
        raise click.UsageError(
            f"{given['out']} is not empty, and nothing is overwritten; choose another --out"
        )

    terminal = sys.stderr.isatty()
    if terminal and not given["connect"]:
        click.echo("starting (the first start compiles the flight code, half a minute or so)", err=True)
    from autopilot_bridge.errors import AddressError, BridgeError
    from missions.connection import GROUND_STATION, ONBOARD_COMPUTER
    from missions.session import RunRequest
    from missions.session import fly as fly_mission
    from missions.vehicle.adapter import Mode

    line = _Line()
    try:
        result = fly_mission(
            mission,
            RunRequest(
                options=options,
                connect=given["connect"],
                autopilot=given["autopilot"],
                model=given["model"],
                seed=given["seed"],
                speedup=given["speedup"],
                wind_speed_m_s=wind_speed_m_s,
                wind_from_deg=wind_from_deg,
                turbulence=given["turbulence"],
                home=given["home"],
                parameters=parameters,
                out=given["out"],
                picture=not given["no_picture"],
                identity=ONBOARD_COMPUTER if given["onboard"] else GROUND_STATION,
                on_failure=Mode(given["on_failure"]),
                command=" ".join(["flightstack", *sys.argv[1:]]),
            ),
            line if terminal else None,
        )
    except (AddressError, BridgeError) as error:
        raise click.UsageError(str(error)) from error
    finally:
        line.end()
    return _tell(result)


def _tell(result: "RunResult") -> int:
    summary = result.summary
    if result.outcome == "interrupted":
        click.echo(f"flightstack: interrupted; the log is in {result.folder}", err=True)
        return _INTERRUPTED
    if result.outcome == "failed":
        click.echo(f"flightstack: mission {summary['mission']} failed: {result.reason}", err=True)
        click.echo(f"failed: see {result.folder}")
        return _FAILED
    click.echo(
        f"{result.outcome}: {summary['mission']} with {summary['autopilot']}, "
        f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.1f} s, "
        f"{summary['speedup']:.0f} times real time"
    )
    if summary["path_rms_error_m"] is not None:
        reference = summary["vehicles"][0]["error_reference"]
        click.echo(
            f"path error {summary['path_rms_error_m']:.2f} m RMS, "
            f"{summary['path_max_error_m']:.2f} m at most ({reference})"
        )
    for block in summary["vehicles"]:
        if "waypoints" in block:
            w = block["waypoints"]
            click.echo(f"waypoints passed within {w['acceptance_m']:g} m: {w['passed']} of {w['count']}")
    click.echo(f"run: {result.folder}")
    return 0
