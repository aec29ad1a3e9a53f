"""One flight from the first heartbeat to the last: vehicles made ready, checked, flown, and left safe."""

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from contextlib import AsyncExitStack, nullcontext
from dataclasses import replace
from typing import Any, Final

from autopilot_bridge.clock import Clock
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.parameter_files import left_out
from missions.base.flight import MissionFlight
from missions.base.mission import Mission
from missions.base.options import MissionOptions
from missions.base.request import RunRequest
from missions.errors import MissionError
from missions.estimation.embedded import FlightEstimators
from missions.flown.records import FlightRecorder
from missions.preflight.before_flight import PlannedFlight, confirmed, look
from missions.preflight.endurance import Endurance, too_long
from missions.preflight.simulation import simulation_proof
from missions.runs.limits_before_flight import adapted, vehicle_options
from missions.runs.vehicle_opening import Stage
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.connection import Connection, Recorder
from missions.vehicle.firmware import Mode
from missions.vehicle.notes import FLIGHT
from missions.vehicle.signing import client_signing, require_key
from missions.vehicle.vehicle import Vehicle

_LOOKED_AT_S: Final = 90.0  # every battery lasts as long as a shorter mission; a model's figure takes 0.1 s
_NAMES_SHOWN: Final = 20  # names of parameters in a remark; the summary has all


class Flight:
    """The state of a run in progress, for displays of progress.

    Attributes:
        vehicles: the vehicles, as soon as they are created.
        recorder: recorder of all sent and received frames.
        mission: the flight of the mission, once the vehicles are ready.
        elsewhere: the vehicles are connected by links, not embedded.
        started_wall_s: wall clock when the run began.
        started_us: vehicle time when the run began: the boot of an embedded vehicle, else the time when the
            vehicle was first received.
    """

    def __init__(self) -> None:
        self.vehicles: list[Vehicle] = []
        self.clock: Clock | None = None
        self.started_wall_s = wall_time_s()
        self.started_us = 0
        self.elsewhere = False
        self.recorder: FlightRecorder | None = None
        self.mission: MissionFlight[Any] | None = None

    @property
    def elapsed_s(self) -> float:
        """Vehicle time since the run began: since the boot of an embedded vehicle, else since its first
        message.
        """
        if self.clock is None:
            return 0.0
        begun_us = self.vehicles[0].link.first_heartbeat_us if self.elsewhere else self.started_us
        return max(0, self.clock.time_us - begun_us) * 1e-6

    def note_how_left(self) -> None:
        """Note how the vehicles are left now."""
        for vehicle in self.vehicles:
            if vehicle.link.identified:
                vehicle.notes.left = vehicle.safe_exit.how_left()

    def require_log(self) -> None:
        """Make sure that all frames received so far are in the log.

        Raises:
            MissionError: the log cannot be written.
        """
        if self.recorder is not None:
            self.recorder.flush()
            if self.recorder.failure:
                raise MissionError(f"{self.recorder.failure}; nothing was flown")


ProgressListener = Callable[[Flight], None]
"""Called each second of vehicle time."""


async def fly_vehicles(
    mission: Mission[Any],
    request: RunRequest,
    stage: Stage,
    recorder: Recorder,
    flight: Flight,
    estimators: FlightEstimators | None,
    on_progress: ProgressListener | None,
) -> None:
    """Connect to the vehicles of a stage, check and confirm them, and fly the mission.

    Args:
        recorder: gets all frames.
        flight: its state, kept up to date.
        estimators: those that run beside the flight.
        on_progress: called each second of vehicle time.

    Raises:
        MissionError: a vehicle is not received, is not ready, or the mission failed; it is left safe.
        PlanError: the vehicles can't fly the mission.
    """
    async with AsyncExitStack() as stack:
        system_ids: Sequence[int | None] = request.system_ids or [None] * len(stage.links)
        for number, (link, clock, system_id) in enumerate(
            zip(stage.links, stage.clocks, system_ids, strict=True)
        ):
            connection = Connection(
                link,
                clock,
                recorder,
                identity=request.identity,
                vehicle_system_id=system_id,
                signing=client_signing(request.signing_key, link_id=number & 0xFF),
            )
            await stack.enter_async_context(connection)
            flight.vehicles.append(Vehicle(connection, system_id))
        flight.clock = clock = stage.clocks[0]
        flight.elsewhere = bool(request.connect)
        if estimators is not None:
            await stack.enter_async_context(estimators.on_board(flight.vehicles, stage.links, clock))
        reporter = asyncio.get_running_loop().create_task(_report(flight, on_progress))
        try:
            await run_concurrently(
                [_prepare(mission, vehicle, request, flight) for vehicle in flight.vehicles]
            )
            flight.require_log()
            await _fly_all(mission, flight, request, stage)
        finally:
            for vehicle in flight.vehicles:
                vehicle.notes.end(vehicle.clock.stamp_us)
            if request.connect:
                flight.started_us = flight.vehicles[0].link.first_heartbeat_us
            reporter.cancel()
            await asyncio.gather(reporter, return_exceptions=True)


async def _prepare(mission: Mission[Any], vehicle: Vehicle, request: RunRequest, flight: Flight) -> None:
    requested_id = request.system_ids[flight.vehicles.index(vehicle)] if request.system_ids else None
    try:
        await vehicle.wait_heartbeat()
    except MissionError as error:
        where = f" on {', '.join(request.connect)}" if request.connect else ""
        which = "" if requested_id is None else f" with system id {requested_id}"
        others = ", ".join(map(str, vehicle.link.connection.autopilots_received))
        received = f" (received: vehicle {others})" if others else ""
        signing = vehicle.link.connection.signing
        if signing is not None and signing.counters.refused_frames:
            received += f" (refused by the signing key: {signing.counters.reasons})"
        hint = "is it on, and sending there?"
        if request.connect and request.signing_key is None and not others:
            hint += " Does it require signatures (`signing_key`)?"
        raise MissionError(f"no vehicle{which} was received{where}{received}: {error}; {hint}") from error
    vehicle.notes.system_id = vehicle.system_id
    vehicle.link.regain_s = request.regain_s if request.connect else 0.0
    vehicle.notes.autopilot = vehicle.autopilot
    vehicle.notes.kind = str(vehicle.kind)
    if request.connect:
        await require_key(request.signing_key, vehicle)
        await _set_parameters(vehicle, request)
    vehicle.sensors.watch(*mission.sensors(request.options))  # its messages while it gets ready count, too
    await vehicle.wait_ready(leave_mode=mission.commands)


async def _set_parameters(vehicle: Vehicle, request: RunRequest) -> None:
    if request.strict_parameters:
        await vehicle.set_parameters(request.parameters)
        return
    vehicle.notes.left_out_parameters = names = await vehicle.parameters.write_known(request.parameters)
    if names:
        request.on_remark(f"vehicle {vehicle.system_id}: {left_out(names, _NAMES_SHOWN)}")


async def _fly_all(mission: Mission[Any], flight: Flight, request: RunRequest, stage: Stage) -> None:
    vehicles = flight.vehicles
    centre = vehicles[0].home if len(vehicles) > 1 else request.options.centre
    options: list[MissionOptions] = []
    for index, vehicle in enumerate(vehicles):
        vehicle.forecast_wind_m_s = request.planning_wind_m_s
        limits, home = await vehicle.limits(), vehicle.home
        own_options = replace(vehicle_options(request.options, index), centre=centre)
        own, own_limits = adapted(mission, own_options, limits, home.alt_m)
        options.append(own)
        vehicle.allow_below_home = own.allow_below_home
        if request.connect:  # before a question is asked and before anything is uploaded
            mission.check_place(own, own_limits, home)
    await run_concurrently([vehicle.sensors.prove() for vehicle in vehicles])
    for vehicle, own in zip(vehicles, options, strict=True):
        for text in await mission.remarks(vehicle, own):
            request.on_remark(f"vehicle {vehicle.system_id}: {text}")
        if mission.commands:
            await _remark_endurance(mission, vehicle, own, request, stage)
    if request.confirm is not None:
        await _confirm(mission, vehicles, options, request)
    made = flight.mission = mission.flight(vehicles, options)
    if not mission.commands:
        await made.fly()
        return
    if not made.together:
        await run_concurrently(
            [
                _fly_one(made.fly_one(index), vehicle, request, watched=True)
                for index, vehicle in enumerate(vehicles)
            ]
        )
        return
    # One flight of all vehicles inside the contexts of each, the last vehicle outermost: whatever ends the
    # flight leaves every vehicle safe.
    flying = made.fly()
    for vehicle in vehicles:
        flying = _fly_one(flying, vehicle, request, watched=not mission.lands_without_sensors)
    await flying


async def _confirm(
    mission: Mission[Any], vehicles: Sequence[Vehicle], options: Sequence[MissionOptions], request: RunRequest
) -> None:
    """Check the vehicles and ask for confirmation, unless all prove to be simulations."""
    proofs = [await simulation_proof(vehicle) for vehicle in vehicles]
    if request.confirm is None or (all(proofs) and not request.confirm_simulations):
        return
    endurance = _given_endurance(request)
    looks = [
        await look(
            vehicle,
            PlannedFlight(
                mission=mission.name,
                kinds=mission.kinds,
                autopilot=mission.world_defaults.autopilot,
                outline=await mission.outline(vehicle, own),
            ),
            proof,
            endurance,
        )
        for vehicle, own, proof in zip(vehicles, options, proofs, strict=True)
    ]
    await confirmed(looks, request.confirm)


def _given_endurance(request: RunRequest) -> Endurance | None:
    """What the user knows of the battery."""
    minutes = request.endurance_min
    return None if minutes is None else Endurance(seconds=60.0 * minutes, source="given")


async def _remark_endurance(
    mission: Mission[Any], vehicle: Vehicle, options: MissionOptions, request: RunRequest, stage: Stage
) -> None:
    """Say before the takeoff that the battery does not last as long as the mission, where it is known."""
    outline = await mission.outline(vehicle, options)
    if outline is None or (outline.duration_s or 0.0) < _LOOKED_AT_S:
        return
    endurance = _given_endurance(request)
    if endurance is None and (seconds := stage.endurance_s(options.index)) is not None:
        endurance = Endurance(seconds=seconds, source="by the model, in hover")
    if text := too_long(outline, endurance):
        vehicle.notes.warn(text)
        request.on_remark(f"vehicle {vehicle.system_id}: {text}")


async def _fly_one(
    flying: Coroutine[Any, Any, None], vehicle: Vehicle, request: RunRequest, *, watched: bool
) -> None:
    """Fly one vehicle to its end, and leave it safe.

    Args:
        watched: whether a sensor that stops ends the flight.
    """
    vehicle.notes.begin(FLIGHT, vehicle.clock.stamp_us)  # until the mission begins its own phase
    # The guard is inside: a sensor that stops ends `flying` only, and the vehicle is still left safe.
    async with vehicle.safe_on_exit(Mode(request.on_failure)):
        async with vehicle.sensors.guard() if watched else nullcontext():
            await flying
        if vehicle.armed and not vehicle.notes.aloft:
            raise MissionError(
                "the mission ended with the vehicle armed; end a mission with return_to_launch() or land()"
            )
        vehicle.notes.progress = 1.0


async def _report(flight: Flight, on_progress: ProgressListener | None) -> None:
    while on_progress is not None and flight.clock is not None:
        on_progress(flight)
        await flight.clock.sleep(1.0)
