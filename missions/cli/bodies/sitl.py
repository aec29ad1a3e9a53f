"""What `flightstack sitl` does."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from autopilot_bridge.clock.pacing import unix_time_us, wall_time_s
from autopilot_bridge.errors import BridgeError, TlogError
from autopilot_bridge.firmware.simulator import simulator_defaults
from autopilot_bridge.firmware_process import firmware_backend
from autopilot_bridge.links import parse_address
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, Packet, dialect
from autopilot_bridge.mavlink.components import GROUND_STATION
from autopilot_bridge.parameter_files import left_out
from autopilot_bridge.sitl import PaceReport, PacketLog, Port, Sitl, SitlServer, compile_flight_code, emulated
from autopilot_bridge.tlog import TlogWriter
from autopilot_bridge.video import VideoParameters
from flightsim.payload import MagneticSpec, magnetic_field_of
from flightsim.world_spec import WorldSpec
from missions.base.given_text import parameters_from_file
from missions.base.mission import WorldDefaults
from missions.base.run_options import ServedWorldOptions
from missions.cli.bodies.params import known_to_all
from missions.cli.bodies.sitl_signing import signed_how, vehicle_signing, warn_if_unsigned
from missions.cli.bodies.status_line import StatusLine, announce_compiling
from missions.cli.bodies.storage import Losses, VehicleCards
from missions.cli.bodies.video import start_video
from missions.cli.bodies.world import equipped, firmware_of, world_of
from missions.cli.declared_options import chosen_names, specified
from missions.cli.exit_codes import FAILED
from missions.cli.options import in_options, report
from missions.errors import PlanError
from missions.process.ending import EndRequests
from missions.view.feed import SceneFeed
from missions.view.opening import open_viewer
from missions.view.target import parse_view
from missions.view.viewer import Viewer, ViewError

_LOG_RATE_HZ = 4


def _ports(links: tuple[str, ...], gcs_links: tuple[str, ...]) -> list[Port]:
    """Links from the options; empty: the default links of the flavour are opened."""
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
    spec: WorldSpec, speedup: float, parameters: Mapping[str, float], unix_epoch_us: int, instance: int
) -> WorldSpec:
    """The world with calendar time, timeouts for clients in wall time, the parameters of a file, and the
    system ids of the instances.

    Its magnetic field is made here, so that an unusable map is refused before the vehicles are.
    """
    field = spec.magnetic_field
    if isinstance(field, MagneticSpec):
        field, _ = magnetic_field_of(
            field, home=spec.place, seed=spec.seed, decimal_year=spec.air.decimal_year
        )
    vehicles = tuple(
        replace(
            vehicle,
            system_id=vehicle.system_id
            + (instance if simulator_defaults(vehicle.autopilot).system_id_of_instance else 0),
            parameters={**_loss_times(vehicle.autopilot, speedup), **vehicle.parameters, **parameters},
        )
        for vehicle in spec.vehicles
    )
    return replace(spec, vehicles=vehicles, magnetic_field=field, unix_epoch_us=unix_epoch_us)


def _request_streams() -> bytes:
    """Request for all of ArduPilot's streams from every vehicle, at the rate that MAVProxy requests."""
    request = dialect.MAVLink_request_data_stream_message(0, 0, dialect.MAV_DATA_STREAM_ALL, _LOG_RATE_HZ, 1)
    return FrameEncoder(*GROUND_STATION).encode(request)


@contextlib.contextmanager
def _recording(simulated: Sitl, path: str, losses: Losses) -> Iterator[None]:
    """Write a new log of the vehicles' messages until the context ends or the file can no longer be written.

    Raises:
        TlogError: the file exists or can't be made.
    """
    recorder = TlogWriter(path)
    _listen(simulated, recorder, losses)
    try:
        yield
    finally:
        try:
            recorder.close()
        except TlogError as error:
            losses.log_ended(str(error))


def _listen(simulated: Sitl, log: PacketLog, losses: Losses) -> None:
    """Let a log or a feed receive the messages of all vehicles."""
    listeners = simulated.record(log, losses.log_ended)
    for spec, listener in zip(simulated.spec.vehicles, listeners, strict=True):
        if simulator_defaults(spec.autopilot).streams_on_request:
            listener.send(_request_streams())


class _FedFrames:
    """Passes the frames of vehicles to a viewer's feed."""

    def __init__(self, feed: SceneFeed) -> None:
        self._feed = feed
        self._parser = FrameParser()

    def write(self, time_us: int, packet: bytes) -> None:
        """Take frames that were sent together."""
        for frames in Packet.by_sender(self._parser.feed(packet)):
            self._feed.packet(frames, time_us)


def _live_viewer(text: str) -> Viewer:
    """The viewer that `--view` names.

    Raises:
        PlanError: it names none, or a file.
        ViewError: it can't be opened.
    """
    target = parse_view(text)
    if target.path is not None:
        raise PlanError(
            f"`view` {text}: SITL has no end to draw; give web, window or foxglove, or a `log` to view"
        )
    viewer = open_viewer(target)
    click.echo(f"view: {viewer.where}", err=True)
    return viewer


@contextlib.contextmanager
def _shown(simulated: Sitl, view: Viewer | None, losses: Losses) -> Iterator[None]:
    """Show the vehicles in a viewer until the context ends."""
    if view is None:
        yield
        return
    feed = SceneFeed(view, "sitl")
    _listen(simulated, _FedFrames(feed), losses)
    try:
        yield
    finally:
        feed.close()
        if feed.failure:
            report(f"the viewer shows nothing from some time on: {feed.failure}")


@contextlib.contextmanager
def _ready(path: Path, lines: Sequence[str]) -> Iterator[None]:
    """A file with the lines of the links, whole as soon as it is there; it is removed at the end.

    Raises:
        UsageError: it can't be written.
    """
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise click.UsageError(f"--ready-file {path}: {error.strerror}") from error
    try:
        yield
    finally:
        path.unlink(missing_ok=True)


def sitl(
    links: tuple[str, ...],
    gcs_links: tuple[str, ...],
    camera: bool,
    targets: tuple[str, ...],
    map_file: str | None,
    map_target: str | None,
    video: str | None,
    pictures: Path | None,
    signing_key: Path | None,
    signing_store: Path | None,
    storage: str | None,
    params: str | None,
    strict_params: bool,
    log: str | None,
    view: str | None,
    firmware_logs: Path | None,
    no_wait: bool,
    ready_file: Path | None,
    world: Path | None,
    **_declared: Any,
) -> int:
    """`flightstack sitl`."""
    context = click.get_current_context()
    chosen = chosen_names(context)
    losses = Losses()
    with EndRequests() as ending, contextlib.ExitStack() as at_end:
        try:
            options = specified(ServedWorldOptions)
            viewer = None if view is None else _live_viewer(view)
            if viewer is not None:
                at_end.callback(viewer.close)
            ports = _ports(links, gcs_links)
            signing = vehicle_signing(
                signing_key, options.unsigned, signing_store, on_failure=losses.keys_not_stored
            )
            firmware = firmware_of(context.params)
            spec = world_of(
                options, chosen, file=world, firmware=firmware, count=options.count, defaults=WorldDefaults()
            )
            parameters: dict[str, float] = {}
            if params is not None:
                strict = strict_params or firmware is not None  # a real one names what it does not have
                parameters, names = known_to_all(parameters_from_file(params), spec, strict=strict)
                if names:
                    report(f"--params: {left_out(names)}")
            spec = _for_clients(
                equipped(spec, camera, targets, map_file, map_target),
                options.speedup,
                parameters,
                unix_time_us(),
                options.instance,
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
                simulated,
                speedup=options.speedup or None,
                monotonic=wall_time_s,
                on_failure=losses.vehicle_failed,
            )
            pictured = start_video(
                simulated, video, specified(VideoParameters).rate_hz, pictures, losses.picture_lost
            )
            if pictured is not None:
                at_end.callback(pictured.close)
            if count > 1 and ports:
                opened = server.open([()] * count, shared=ports)
            else:
                opened = server.open([ports] if ports else None, instance=options.instance)
            at_end.callback(simulated.close)
            ending.remember()
            if log is not None:  # created last, when no other check can still fail
                at_end.enter_context(_recording(simulated, log, losses))
            at_end.enter_context(_shown(simulated, viewer, losses))
        except ViewError as error:
            raise click.ClickException(in_options(error)) from error
        except (ValueError, OSError, BridgeError) as error:
            raise click.UsageError(in_options(error)) from error
        lines = []
        for vehicle, port, address in opened:
            system_id = vehicle.specification.system_id
            kind = f"{vehicle.specification.autopilot} {vehicle.specification.model}"
            how = signed_how(signing, port.address)
            lines.append(f"vehicle {system_id} ({kind}): {address} {port.role}{how}")
        for line_of_link in lines:
            click.echo(line_of_link)
        for named in dict.fromkeys(port.address for _, port, _ in opened):
            warn_if_unsigned(named, signing)
        for uri in () if pictured is None else pictured.uris:
            click.echo(f"video: {uri}")
        click.echo("ready, Ctrl-C ends it")
        if ready_file is not None:
            at_end.enter_context(_ready(ready_file, lines))
        line = StatusLine()

        def show(pace: PaceReport) -> None:
            line.show(f"{pace.time_us * 1e-6:10.1f} s  x{pace.speedup:<6.2f}")

        if simulator_defaults(spec.vehicles[0].autopilot).waits_for_client and not ports and not no_wait:
            click.echo(f"waiting for a client on {opened[0][2]}", err=True)
            server.wait_for_client(lambda: ending.requested)
        server.run(
            lambda: ending.requested,
            report=show if line.terminal else None,
            until_us=None if options.duration_s is None else round(options.duration_s * 1e6),
        )
    lost = f", {server.slipped_s:.1f} s behind real time" if server.slipped_s > 0.05 else ""
    click.echo(f"stopped at {simulated.time_us * 1e-6:.1f} s of vehicle time{lost}")
    return FAILED if losses.any else 0
