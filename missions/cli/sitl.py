"""`flightstack sitl`: simulated vehicles for external clients."""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from autopilot_bridge.errors import BridgeError, TlogError
from missions.cli.fly_command import chosen_names
from missions.cli.options import SLOWEST, FiniteRange, in_options, report
from missions.cli.params import STRICT_HELP, known_to_all
from missions.cli.signing import key_option, signed_how, vehicle_signing, warn_if_unsigned
from missions.cli.status_line import StatusLine, announce_compiling
from missions.cli.storage import Losses, VehicleCards, storage_option
from missions.cli.video import start_video, video_options
from missions.cli.world import FIRMWARE_HELP, WORLD_HELP, equipped, firmware_of, world_of
from missions.process.ending import EndRequests

if TYPE_CHECKING:
    from autopilot_bridge.sitl import Port, Sitl
    from flightsim.world_spec import WorldSpec

_LOG_RATE_HZ = 4
_FAILED = 1


def _ports(links: tuple[str, ...], gcs_links: tuple[str, ...]) -> "list[Port]":
    """Links from the options; empty: the default links of the flavour are opened."""
    from autopilot_bridge.links import parse_address
    from autopilot_bridge.sitl import Port

    chosen = [Port(parse_address(link), "onboard") for link in links]
    chosen += [Port(parse_address(link), "gcs") for link in gcs_links]
    return chosen


def _loss_times(autopilot: str, speedup: float) -> dict[str, float]:
    """Timeout parameters, stretched so that clients, which run in wall time, have as long to answer as at
    speedup 1.

    PX4's own SITL stretches these when it runs faster (docs/firmware/px4.md, section 2); ArduPilot's does
    not.
    """
    if autopilot != "px4" or speedup <= 1.0:
        return {}
    return {
        "COM_DL_LOSS_T": min(round(10.0 * speedup), 300),
        "COM_RC_LOSS_T": min(speedup, 35.0),
        "COM_OF_LOSS_T": min(speedup, 60.0),
        "COM_OBC_LOSS_T": min(5.0 * speedup, 60.0),
    }


def _for_clients(
    spec: "WorldSpec", speedup: float, parameters: Mapping[str, float], unix_epoch_us: int
) -> "WorldSpec":
    """The world with calendar time, timeouts for clients in wall time, and the parameters of a file.

    Its magnetic field is made here, so that an unusable map is refused before the vehicles are.
    """
    from flightsim.payload import MagneticSpec, magnetic_field_of

    field = spec.magnetic_field
    if isinstance(field, MagneticSpec):
        field, _ = magnetic_field_of(
            field, home=spec.place, seed=spec.seed, decimal_year=spec.air.decimal_year
        )
    vehicles = tuple(
        replace(
            vehicle,
            parameters={**_loss_times(vehicle.autopilot, speedup), **vehicle.parameters, **parameters},
        )
        for vehicle in spec.vehicles
    )
    return replace(spec, vehicles=vehicles, magnetic_field=field, unix_epoch_us=unix_epoch_us)


def _request_streams() -> bytes:
    """Request for all of ArduPilot's streams from every vehicle, at the rate that MAVProxy requests."""
    from autopilot_bridge.mavlink import FrameEncoder, dialect
    from autopilot_bridge.mavlink.components import GROUND_STATION

    request = dialect.MAVLink_request_data_stream_message(0, 0, dialect.MAV_DATA_STREAM_ALL, _LOG_RATE_HZ, 1)
    return FrameEncoder(*GROUND_STATION).encode(request)


@contextlib.contextmanager
def _recording(simulated: "Sitl", path: str, losses: Losses) -> Iterator[None]:
    """Write a new log of the vehicles' messages until the context ends or the file can no longer be written.

    Raises:
        TlogError: the file exists or can't be made.
    """
    from autopilot_bridge.firmware.simulator import simulator_defaults
    from autopilot_bridge.tlog import TlogWriter

    recorder = TlogWriter(path)
    for spec, listener in zip(
        simulated.spec.vehicles, simulated.record(recorder, losses.log_ended), strict=True
    ):
        if simulator_defaults(spec.autopilot).streams_on_request:
            listener.send(_request_streams())
    try:
        yield
    finally:
        try:
            recorder.close()
        except TlogError as error:
            losses.log_ended(str(error))


@click.command()
@click.option("--world", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help=WORLD_HELP)
@click.option("--autopilot", type=click.Choice(["px4", "ardupilot"]), default="px4", show_default=True)
@click.option("--firmware", metavar="NAME[=BUILD]", help=FIRMWARE_HELP)
@click.option(
    "--model",
    multiple=True,
    metavar="NAME|PATH",
    help="One of our models, or a path; for all, or one for each (repeat, or A,B,C). [default: iris]",
)
@click.option(
    "--launch",
    type=click.Choice(["runway", "catapult", "hand"]),
    help="Launch of aircraft. [default: as described with the model]",
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
@click.option(
    "--home", help="Place of the home: lat,lon,alt[,heading]; default: where the firmware's own SITL stands."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option(
    "--wind",
    default="0",
    show_default=True,
    help="Speed in m/s at 10 m above ground, with @DEG where it comes from.",
)
@click.option(
    "--wind-profile",
    type=click.Choice(["log", "power", "uniform"]),
    default="log",
    show_default=True,
    help="Wind over height: logarithmic over open ground, power law of 1/7, or the same everywhere.",
)
@click.option(
    "--turbulence",
    type=click.Choice(["none", "light", "moderate", "severe"]),
    default="none",
    show_default=True,
)
@click.option(
    "--gps",
    type=click.Choice(["differential", "standalone"]),
    default="differential",
    show_default=True,
    help="Receiver: decimetres with corrections, or metres that wander without.",
)
@click.option("--camera", is_flag=True, help="Every vehicle carries a camera on a gimbal.")
@click.option(
    "--target",
    "targets",
    multiple=True,
    metavar="NORTH,EAST[,SPEED,HEADING]",
    help="Target on the ground for cameras: m from home, m/s and degrees. Repeat for more.",
)
@click.option(
    "--map",
    "map_file",
    metavar="FILE",
    help="Magnetic map (.npz, as `fly occupancy` publishes it); every vehicle carries a survey magnetometer.",
)
@click.option(
    "--map-target",
    metavar="NORTH,EAST",
    help="Place of a target's magnetic signature, m from the map's home.",
)
@key_option()
@click.option(
    "--unsigned",
    type=click.Choice(["none", "serial", "local", "all"]),
    default="serial",
    show_default=True,
    help="Links that take unsigned frames while there is a key: none, serial ones, this machine's too, all.",
)
@click.option(
    "--signing-store",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="File that keeps keys that clients set, and times, over restarts.",
)
@video_options
@storage_option
@click.option("--params", type=click.Path(dir_okay=False), help="Parameter file (.params or .parm).")
@click.option("--strict-params", is_flag=True, help=STRICT_HELP)
@click.option("--log", metavar="FILE", help="New .tlog for what the vehicles say, and the truth.")
@click.option(
    "--firmware-logs",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    metavar="FOLDER",
    help="Folder for the logs of a real firmware (.ulg, .bin) and what it prints.",
)
@click.option("--no-wait", is_flag=True, help="ArduPilot: don't wait for a client on the first port.")
@click.option(
    "--duration", type=FiniteRange(min=0.0, max=1e9), help="Stop after so many seconds of vehicle time."
)
def sitl(
    count: int,
    speedup: float,
    links: tuple[str, ...],
    gcs_links: tuple[str, ...],
    camera: bool,
    targets: tuple[str, ...],
    map_file: str | None,
    map_target: str | None,
    video: str | None,
    video_rate: float,
    pictures: Path | None,
    signing_key: Path | None,
    unsigned: str,
    signing_store: Path | None,
    storage: str | None,
    params: str | None,
    strict_params: bool,
    log: str | None,
    firmware_logs: Path | None,
    no_wait: bool,
    duration: float | None,
    **_world: Any,
) -> int:
    """Simulated vehicles (SITL) for external clients: QGroundControl, MAVSDK, MAVProxy, DroneKit, mavutil.

    Opens the ports that clients of the firmware use by default, prints them, and runs until Ctrl-C.

    Exit codes: 0 stopped, 1 a vehicle failed, or the log, a picture or the signing keys could not be
    written, 2 usage, 130 interrupted while it started.
    """
    if 0.0 < speedup < SLOWEST:
        raise click.UsageError(f"--speedup {speedup:g} is slower than {SLOWEST:g}; 0 is as fast as possible")
    from autopilot_bridge.clock.pacing import unix_time_us, wall_time_s
    from autopilot_bridge.firmware.simulator import simulator_defaults
    from autopilot_bridge.firmware_process import firmware_backend
    from autopilot_bridge.parameter_files import left_out
    from autopilot_bridge.sitl import PaceReport, Sitl, SitlServer, compile_flight_code, emulated
    from missions.base.given_text import parameters_from_file
    from missions.base.mission import WorldDefaults

    context = click.get_current_context()
    chosen = chosen_names(context)
    losses = Losses()
    with EndRequests() as ending, contextlib.ExitStack() as at_end:
        try:
            ports = _ports(links, gcs_links)
            signing = vehicle_signing(signing_key, unsigned, signing_store, on_failure=losses.keys_not_stored)
            firmware = firmware_of(context.params)
            spec = world_of(
                context.params, chosen, count=count if "count" in chosen else None, defaults=WorldDefaults()
            )
            parameters: dict[str, float] = {}
            if params is not None:
                strict = strict_params or firmware is not None  # a real one names what it does not have
                parameters, names = known_to_all(parameters_from_file(params), spec, strict=strict)
                if names:
                    report(f"--params: {left_out(names)}")
            spec = _for_clients(
                equipped(spec, camera, targets, map_file, map_target), speedup, parameters, unix_time_us()
            )
            count = len(spec.vehicles)
            memory = VehicleCards(storage, count)
            at_end.callback(memory.close)
            click.echo("starting", err=True)
            at_end.enter_context(announce_compiling(partial(click.echo, err=True)))
            backend = emulated if firmware is None else firmware_backend(firmware, logs_to=firmware_logs)
            simulated = Sitl(spec, signing=signing, cards=memory.cards, backend=backend)
            if firmware is None:
                compile_flight_code(spec.vehicles)
            server = SitlServer(
                simulated, speedup=speedup or None, monotonic=wall_time_s, on_failure=losses.vehicle_failed
            )
            pictured = start_video(simulated, video, video_rate, pictures, losses.picture_lost)
            if pictured is not None:
                at_end.callback(pictured.close)
            if count > 1 and ports:
                opened = server.open([()] * count, shared=ports)
            else:
                opened = server.open([ports] if ports else None)
            at_end.callback(simulated.close)
            ending.remember()
            if log is not None:  # created last, when no other check can still fail
                at_end.enter_context(_recording(simulated, log, losses))
        except (ValueError, OSError, BridgeError) as error:
            raise click.UsageError(in_options(error)) from error
        for vehicle, port, address in opened:
            system_id = vehicle.specification.system_id
            kind = f"{vehicle.specification.autopilot} {vehicle.specification.model}"
            how = signed_how(signing, port.address)
            click.echo(f"vehicle {system_id} ({kind}): {address} {port.role}{how}")
        for named in dict.fromkeys(port.address for _, port, _ in opened):
            warn_if_unsigned(named, signing)
        for uri in () if pictured is None else pictured.uris:
            click.echo(f"video: {uri}")
        click.echo("ready, Ctrl-C ends it")

        line = StatusLine()

        def show(pace: PaceReport) -> None:
            line.show(f"{pace.time_us * 1e-6:10.1f} s  x{pace.speedup:<6.2f}")

        if simulator_defaults(spec.vehicles[0].autopilot).waits_for_client and not ports and not no_wait:
            click.echo(f"waiting for a client on {opened[0][2]}", err=True)
            server.wait_for_client(lambda: ending.requested)
        server.run(
            lambda: ending.requested,
            report=show if line.terminal else None,
            until_us=None if duration is None else round(duration * 1e6),
        )
    lost = f", {server.slipped_s:.1f} s behind real time" if server.slipped_s > 0.05 else ""
    click.echo(f"stopped at {simulated.time_us * 1e-6:.1f} s of vehicle time{lost}")
    return _FAILED if losses.any else 0
