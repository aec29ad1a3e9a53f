"""`flightstack sitl`: vehicles for other people's clients."""

import math
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from autopilot_bridge.errors import BridgeError, TlogError
from missions.cli_signing import key_option, signed_how, vehicle_signing, warn_if_unsigned
from missions.cli_storage import VehicleCards, storage_option
from missions.cli_types import SLOWEST, FiniteRange
from missions.cli_video import start_video, video_options
from missions.scenario import Scenario, SurveyScenario, TargetMotion, TargetScenario

if TYPE_CHECKING:
    from autopilot_bridge.sitl import Port

_LOG_RATE_HZ = 4
_FAILED = 1
_LOGGER = 255, 190  # MAV_COMP_ID_MISSIONPLANNER of a ground station


def _ports(links: tuple[str, ...], gcs_links: tuple[str, ...]) -> "list[Port]":
    """Links from the options; none: the flavour's own are to be opened."""
    from autopilot_bridge.links import parse_address
    from autopilot_bridge.sitl import Port

    chosen = [Port(parse_address(link), "onboard") for link in links]
    chosen += [Port(parse_address(link), "gcs") for link in gcs_links]
    return chosen


def _loss_times(autopilot: str, speedup: float) -> dict[str, float]:
    """Parameters that give clients, who live in wall time, as long to answer as at speedup 1.

    PX4's own SITL stretches these when it runs faster (reference page, section 2); ArduPilot's does not.
    """
    if autopilot != "px4" or speedup <= 1.0:
        return {}
    return {
        "COM_DL_LOSS_T": min(round(10.0 * speedup), 300),
        "COM_RC_LOSS_T": min(speedup, 35.0),
        "COM_OF_LOSS_T": min(speedup, 60.0),
        "COM_OBC_LOSS_T": min(5.0 * speedup, 60.0),
    }


def _request_streams() -> bytes:
    """All of ArduPilot's streams, to every vehicle, at the rate that MAVProxy asks for."""
    from autopilot_bridge.mavlink import FrameEncoder, dialect

    request = dialect.MAVLink_request_data_stream_message(0, 0, dialect.MAV_DATA_STREAM_ALL, _LOG_RATE_HZ, 1)
    return FrameEncoder(*_LOGGER).encode(request)


def _scenario(
    camera: bool, targets: tuple[str, ...], map_file: str | None, map_target: str | None
) -> Scenario:
    """Targets and payload from the options.

    Raises:
        ValueError: a target that can't be, or one that nobody could find.
    """
    if targets and not camera:
        raise ValueError("--target is seen by cameras only; add --camera")
    if map_target is not None and map_file is None:
        raise ValueError("--map-target needs a --map to be in")
    survey = None
    if map_file is not None:
        place = None if map_target is None else _numbers(map_target, "--map-target", (2,))
        survey = SurveyScenario(
            map_path=Path(map_file), target_ne_m=None if place is None else (place[0], place[1])
        )
    return Scenario(
        targets=tuple(_target(text, tag) for tag, text in enumerate(targets)), camera=camera, survey=survey
    )


def _target(text: str, tag: int) -> TargetScenario:
    numbers = _numbers(text, "--target", (2, 4))
    speed_m_s, heading_deg = numbers[2:] or (0.0, 0.0)
    return TargetScenario(
        north_m=numbers[0],
        east_m=numbers[1],
        motion=TargetMotion.STRAIGHT if speed_m_s else TargetMotion.STATIC,
        speed_m_s=speed_m_s,
        course_rad=math.radians(heading_deg),
        tag=tag,
    )


def _numbers(text: str, option: str, counts: tuple[int, ...]) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not all(math.isfinite(number) for number in numbers):
        accepted = " or ".join(str(count) for count in counts)
        raise ValueError(f"{option} {text!r} is not {accepted} numbers with commas, for example 500,300")
    return numbers


@click.command()
@click.option("--autopilot", type=click.Choice(["px4", "ardupilot"]), default="px4", show_default=True)
@click.option(
    "--model",
    multiple=True,
    metavar="NAME|PATH",
    help="One of our models, or a path; for all, or one for each (repeat, or A,B,C). [default: iris]",
)
@click.option(
    "--launch",
    type=click.Choice(["runway", "catapult", "hand"]),
    help="How aircraft get into the air. [default: as described with the model]",
)
@click.option("--count", type=click.IntRange(1, 250), default=1, show_default=True, help="Vehicles.")
@click.option(
    "--speedup",
    type=FiniteRange(min=0.0, max=1e6),
    default=1.0,
    show_default=True,
    help="Simulated seconds per wall second; 0: as fast as possible.",
)
@click.option(
    "--link",
    "links",
    multiple=True,
    help="Link with onboard streams instead of the usual ports; with --count, all vehicles share it.",
)
@click.option("--gcs-link", "gcs_links", multiple=True, help="Link with ground-station streams.")
@click.option("--home", help="lat,lon,alt[,heading]; default: where the firmware's own SITL stands.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--wind", default="0", show_default=True, help="Speed in m/s, with @DEG where it comes from.")
@click.option(
    "--turbulence",
    type=click.Choice(["none", "light", "moderate", "severe"]),
    default="none",
    show_default=True,
)
@click.option("--camera", is_flag=True, help="Every vehicle carries a camera on a gimbal.")
@click.option(
    "--target",
    "targets",
    multiple=True,
    metavar="NORTH,EAST[,SPEED,HEADING]",
    help="A target on the ground for cameras: m from home, m/s and degrees. Repeat for more.",
)
@click.option(
    "--map",
    "map_file",
    metavar="FILE",
    help="Magnetic map (.npz, as `fly occupancy` publishes it); every vehicle carries a survey magnetometer.",
)
@click.option(
    "--map-target", metavar="NORTH,EAST", help="A target's magnetic signature there, m from the map's home."
)
@key_option
@click.option(
    "--unsigned",
    type=click.Choice(["none", "serial", "local", "all"]),
    default="serial",
    show_default=True,
    help="Which links take unsigned frames while there is a key: none, serial ones, this machine's too, all.",
)
@click.option(
    "--signing-store",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Keep keys that clients set, and times, over restarts.",
)
@video_options
@storage_option
@click.option("--params", type=click.Path(dir_okay=False), help="Parameter file (.params or .parm).")
@click.option("--log", metavar="FILE", help="New .tlog for what the vehicles say, and the truth.")
@click.option("--no-wait", is_flag=True, help="ArduPilot: don't wait for a client on the first port.")
@click.option(
    "--duration", type=FiniteRange(min=0.0, max=1e9), help="Stop after so many seconds of vehicle time."
)
def sitl(
    autopilot: str,
    model: tuple[str, ...],
    launch: str | None,
    count: int,
    speedup: float,
    links: tuple[str, ...],
    gcs_links: tuple[str, ...],
    home: str | None,
    seed: int,
    wind: str,
    turbulence: str,
    camera: bool,
    targets: tuple[str, ...],
    map_file: str | None,
    map_target: str | None,
    video: str | None,
    pictures: Path | None,
    signing_key: Path | None,
    unsigned: str,
    signing_store: Path | None,
    storage: str | None,
    params: str | None,
    log: str | None,
    no_wait: bool,
    duration: float | None,
) -> int:
    """SITL for other people's clients: QGroundControl, MAVSDK, MAVProxy, DroneKit, mavutil.

    Opens the ports where clients of the firmware look for it, says which, and runs until Ctrl-C.

    Exit codes: 0 stopped, 1 the log could not be written to its end, 2 usage.
    """
    if 0.0 < speedup < SLOWEST:
        raise click.UsageError(f"--speedup {speedup:g} is slower than {SLOWEST:g}; 0 is as fast as possible")
    from autopilot_bridge.clock.pacing import wall_time_s
    from autopilot_bridge.sitl import (
        PaceReport,
        PacketLog,
        Sitl,
        SitlConfiguration,
        SitlServer,
        compile_flight_code,
        parse_home,
        team,
    )
    from autopilot_bridge.sitl.configuration import HOMES
    from flightsim.environment import Environment
    from missions.embedded.scenario import equipped
    from missions.options import parameters_from_file, parse_wind

    stop: list[int] = []
    models = [name for text in model for name in text.split(",") if name] or ["iris"]
    count = len(models) if count == 1 else count

    def on_signal(number: int, frame: FrameType | None) -> None:
        stop.append(number)

    no_log: list[str] = []

    def log_ended(why: str) -> None:
        no_log.append(why)
        click.echo(f"flightstack: {why}; the log ends here, the vehicles fly on", err=True)

    try:
        ports = _ports(links, gcs_links)
        signing = vehicle_signing(signing_key, unsigned, signing_store)
        wind_speed_m_s, wind_from_deg = parse_wind(wind)
        place = None if home is None else parse_home(home)
        heading_deg = HOMES[autopilot].heading_deg if place is None else place.heading_deg
        configuration = SitlConfiguration(
            vehicles=team(
                count,
                model=models[0] if len(models) == 1 else models,
                flavour=autopilot,
                launch=launch,
                heading_deg=heading_deg,
                parameters={
                    **_loss_times(autopilot, speedup),
                    **({} if params is None else parameters_from_file(params)),
                },
            ),
            home=place,
            environment=Environment.from_wind(
                speed_m_s=wind_speed_m_s, from_deg=wind_from_deg, turbulence=turbulence
            ),
            seed=seed,
        )
        memory = VehicleCards(storage, count)
        click.get_current_context().call_on_close(memory.close)
        equipment = equipped(configuration, _scenario(camera, targets, map_file, map_target))
        click.echo("starting (the first start compiles the flight code, half a minute or so)", err=True)
        world = Sitl(
            equipment,
            signing=signing,
            cards=memory.cards,
        )
        compile_flight_code(world.configuration.vehicles)
        server = SitlServer(world, speedup=speedup or None, monotonic=wall_time_s)
        pictured = start_video(world, video, pictures)
        recorder = None if log is None else PacketLog(log)
        if count > 1 and ports:
            opened = server.open([()] * count, shared=ports)
        else:
            opened = server.open([ports] if ports else None)
        if recorder is not None:
            for listener in world.record(recorder, log_ended):
                if autopilot == "ardupilot":  # which sends what it is asked for only
                    listener.send(_request_streams())
    except (ValueError, OSError, BridgeError) as error:
        raise click.UsageError(str(error)) from error
    before = {number: signal.signal(number, on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
    for vehicle, port, address in opened:
        system_id = vehicle.specification.system_id
        kind = f"{autopilot} {vehicle.specification.model}"
        click.echo(f"vehicle {system_id} ({kind}): {address} {port.role}{signed_how(signing, port.address)}")
    for named in dict.fromkeys(port.address for _, port, _ in opened):
        warn_if_unsigned(named, signing)
    for uri in () if pictured is None else pictured.uris:
        click.echo(f"video: {uri}")
    click.echo("ready, Ctrl-C ends it")
    sys.stdout.flush()
    waits = autopilot == "ardupilot" and not ports and not no_wait

    def report(pace: PaceReport) -> None:
        click.echo(f"\r{pace.time_us * 1e-6:10.1f} s  x{pace.speedup:<6.2f}", nl=False, err=True)

    try:
        if waits:
            click.echo(f"waiting for a client on {opened[0][2]}", err=True)
            server.wait_for_client(lambda: bool(stop))
        server.run(
            lambda: bool(stop),
            report=report if sys.stderr.isatty() else None,
            until_us=None if duration is None else round(duration * 1e6),
        )
    finally:
        world.close()
        if pictured is not None:
            pictured.close()
        if recorder is not None:
            try:
                recorder.close()
            except TlogError as error:
                if not no_log:
                    log_ended(str(error))
        for number, handler in before.items():
            signal.signal(number, handler)
    lost = f", {server.slipped_s:.1f} s behind real time" if server.slipped_s > 0.05 else ""
    click.echo(f"stopped at {world.time_us * 1e-6:.1f} s of vehicle time{lost}")
    return _FAILED if no_log else 0
