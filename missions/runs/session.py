"""One run from beginning to end: a world or links, the mission on it, and the run folder.

This module opens the world or the links, starts the event loop, and reads the wall clock.
"""

import asyncio
from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextlib import AsyncExitStack, nullcontext
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.clock import Clock, unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import BridgeError
from autopilot_bridge.parameter_files import left_out
from missions.base.flight import MissionFlight
from missions.base.mission import Mission
from missions.base.options import MissionOptions
from missions.base.report import Debriefing, Report
from missions.base.request import RunRequest
from missions.errors import MissionError, PlanError, TakenOver
from missions.estimation.embedded import FlightEstimators
from missions.estimation.in_flight import estimators_of, refused_in_plan
from missions.flown.records import FlightRecorder, FlightRecords
from missions.flown.run_folder import (
    LOG_NAME,
    PICTURE_NAME,
    replace_summary,
    team_figures,
    vehicle_summary,
    versions,
    whole,
    wind_words,
    write_summary,
)
from missions.flown.score import score
from missions.how_left import HowLeft
from missions.library import find_mission
from missions.preflight.before_flight import PlannedFlight, confirmed, look
from missions.preflight.endurance import Endurance, too_long
from missions.preflight.simulation import simulation_proof
from missions.process.ending import EndingSignals, signal_of
from missions.runs.claimed_folder import ClaimedFolder, claim_folder
from missions.runs.limits_before_flight import adapted, check_request, check_stage, vehicle_options
from missions.runs.vehicle_opening import Stage, VehicleOpener
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.connection import Connection, Recorder
from missions.vehicle.notes import FLIGHT
from missions.vehicle.signing import client_signing, require_key
from missions.vehicle.vehicle import Vehicle

__all__ = ["COMPLETED", "FAILED", "INTERRUPTED", "Flight", "RunRequest", "RunResult", "fly"]

COMPLETED: Final = "completed"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"

_LOOKED_AT_S: Final = 90.0  # every battery lasts as long as a shorter mission; a model's figure takes 0.1 s
_NAMES_SHOWN: Final = 20  # names of parameters in a remark; the summary has all


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """The result of a run.

    Attributes:
        outcome: "completed", "failed" or "interrupted".
        reason: why it failed; "" otherwise.
        folder: the run folder.
        summary: contents of `summary.json`.
        report: what the mission reports.
        signal: the signal that interrupted it; 0: none.
        left: how each vehicle that was received was left.
    """

    outcome: str
    reason: str
    folder: Path
    summary: Mapping[str, Any]
    report: Report = field(default_factory=Report)
    signal: int = 0
    left: tuple[HowLeft, ...] = ()


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
                vehicle.notes.left = vehicle.how_left()

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


def fly(
    mission: Mission[Any] | str,
    request: RunRequest | None = None,
    on_progress: ProgressListener | None = None,
    *,
    opener: VehicleOpener | None = None,
) -> RunResult:
    """Fly a mission and write its run folder. Blocks until the run is finished.

    A mission that fails or is interrupted (Ctrl-C; in the main thread also SIGTERM and SIGHUP) leaves its
    vehicles safe, and still returns a result and writes a complete log.

    Args:
        mission: a mission, its name, or the path of a user's own or of a mission file.
        request: settings of the run; None: the defaults.
        on_progress: called each second of vehicle time.
        opener: opens the vehicles; None: the embedded world or the links of the request.

    Raises:
        KeyboardInterrupt: the run was interrupted before it began, or while its results were written.
        PlanError: the request can't be flown; nothing was started.
        MissionError: a file of the embedded world cannot be written; nothing was started.
        BridgeError: a link can't be opened.
    """
    opener = VehicleOpener() if opener is None else opener
    flown = find_mission(mission) if isinstance(mission, str) else mission
    with EndingSignals() as ending:
        return _fly_interruptible(flown, request or RunRequest(), on_progress, ending, opener)


def _fly_interruptible(
    mission: Mission[Any],
    request: RunRequest,
    on_progress: ProgressListener | None,
    ending: EndingSignals,
    opener: VehicleOpener,
) -> RunResult:
    check_request(mission, request, opener)
    if request.connect and len(request.connect) != request.options.vehicles:
        raise PlanError(
            f"{len(request.connect)} connections for {request.options.vehicles} vehicles; "
            "give `connect` once for each vehicle"
        )
    estimators = estimators_of(request, mission.estimator_settings(request.options))
    claimed = claim_folder(request.out, mission.name)
    folder = claimed.path
    stage = None
    try:
        stage = opener.open_vehicles(request) if request.connect else opener.open_world(request, claimed)
        if stage.published_map is not None:
            request = replace(request, options=mission.with_map(request.options, stage.published_map))
        if estimators is not None:
            own = _estimator_files(mission, request, estimators, claimed)
            with refused_in_plan():
                estimators.know({**mission.estimator_settings(request.options), **own})
        request.on_open()
        check_stage(mission, request, stage, opener)
    except BaseException:
        if stage is not None:
            stage.close()
            stage.loop.close()
        claimed.give_back()
        raise
    flight = Flight()
    outcome, reason, by_signal = COMPLETED, "", 0
    try:
        recorder = FlightRecorder(claimed.log, epoch_us=stage.epoch_us, unix_time_us=unix_time_us)
        flight.recorder = recorder
        tap = recorder if estimators is None else estimators.around(recorder, folder / LOG_NAME)
        stage.on_truth(tap.record_truth)
        try:
            ending.run(_fly(mission, request, stage, tap, flight, estimators, on_progress), stage.loop)
        except KeyboardInterrupt as interrupt:
            outcome, reason, by_signal = INTERRUPTED, INTERRUPTED, signal_of(interrupt)
        except (MissionError, PlanError, BridgeError) as error:
            outcome, reason = FAILED, "; ".join((str(error), *getattr(error, "__notes__", ())))
            if isinstance(error, TakenOver) and len(flight.vehicles) > 1:
                reason = f"vehicle {error.take_over.system_id}: {reason}"
        finally:
            flight.note_how_left()
            recorder.close()
    finally:
        stage.close()
        stage.loop.close()
    sim_time_s = max(0, stage.time_us() - flight.started_us) * 1e-6
    wall_s = wall_time_s() - flight.started_wall_s
    debriefing = _debrief(request, recorder.records(), flight, stage, completed=outcome == COMPLETED)
    made = flight.mission
    report = Report(figures=mission.unflown) if made is None else made.report(debriefing)
    blocks = [vehicle_summary(n, s) for n, s in debriefing.flights]
    if outcome == COMPLETED:
        reason = report.verdict or _missed_check(request, blocks)
        reason = "; ".join(filter(None, (reason, *(_time_stamp_faults(flight) if reason else ()))))
        if recorder.failure:
            reason = "; ".join(filter(None, (reason, f"{recorder.failure}; it was flown on without a log")))
        outcome = FAILED if reason else COMPLETED
    summary = _summary(mission, request, debriefing, report, blocks, outcome, reason, sim_time_s, wall_s)
    if estimators is not None:
        summary["estimator"] = estimators.report(folder, picture=request.picture, wall_time_s=wall_s).summary
    written = False
    try:
        write_summary(folder, summary)
        written = True
        for name, contents in report.files.items():
            with whole(folder / name):
                (folder / name).write_bytes(contents)
        if request.picture and debriefing.flights:
            with whole(folder / PICTURE_NAME):
                _draw(folder / PICTURE_NAME, title(mission, report, summary), report, debriefing)
            drawn = {**stage.pictures(), **report.pictures()}
            for name, data in drawn.items():
                with whole(folder / name), (folder / name).open("xb") as file:
                    file.write(data)
    except (OSError, MissionError) as error:
        missed = str(error)
        if isinstance(error, OSError):
            missed = f"can't write all of {folder}: {error.strerror or error}; check the disk"
        outcome, reason = FAILED, "; ".join(filter(None, (reason, missed)))
        summary |= {"outcome": outcome, "reason": reason}
        if written:
            replace_summary(folder, summary)
    return RunResult(
        outcome=outcome,
        reason=reason,
        folder=folder,
        summary=summary,
        report=report,
        signal=by_signal,
        left=tuple(notes.left for notes, _ in debriefing.flights if notes.left is not None),
    )


def _estimator_files(
    mission: Mission[Any], request: RunRequest, estimators: FlightEstimators, claimed: ClaimedFolder
) -> dict[str, str]:
    """Write the files that the estimator reads; returns their paths by parameter.

    Raises:
        MissionError: a file can't be written.
    """
    paths = {}
    for parameter, (name, contents) in mission.estimator_files(request.options).items():
        if not estimators.accepts(parameter):
            continue
        path = claimed.path / name
        claimed.published.append(path)
        try:
            path.write_bytes(contents)
        except OSError as error:
            raise MissionError(f"can't write {path}: {error.strerror or error}; check the disk") from error
        paths[parameter] = str(path)
    return paths


async def _fly(
    mission: Mission[Any],
    request: RunRequest,
    stage: Stage,
    recorder: Recorder,
    flight: Flight,
    estimators: FlightEstimators | None,
    on_progress: ProgressListener | None,
) -> None:
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
    return None if request.endurance_s is None else Endurance(seconds=request.endurance_s, source="given")


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
    async with vehicle.safe_on_exit(request.on_failure):
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


def _debrief(
    request: RunRequest, records: FlightRecords, flight: Flight, stage: Stage, *, completed: bool
) -> Debriefing:
    notes = [vehicle.notes for vehicle in flight.vehicles if vehicle.notes.system_id]
    targets_ne_m = None if request.world is None else request.world.magnetic_targets_ne_m
    return Debriefing(
        records=records,
        flights=[(n, score(records, n)) for n in notes],
        options=request.options if flight.mission is None else flight.mission.options[0],
        completed=completed,
        max_error_m=request.max_error_m,
        target_ne_m=targets_ne_m[0] if targets_ne_m else None,
        targets_ne_m=targets_ne_m,
        pictures_of=stage.pictures_of,
    )


def _draw(path: Path, text: str, report: Report, debriefing: Debriefing) -> None:
    """Draw `track.png`."""
    if report.draw is not None:
        report.draw(path, text)
        return
    from missions.flown.picture import draw_run  # Matplotlib

    draw_run(path, text, list(debriefing.flights))


def _time_stamp_faults(flight: Flight) -> list[str]:
    """What was wrong with the time stamps that a flight is judged by, one text for each vehicle."""
    faults = ((v.notes.system_id, v.link.time_stamp_faults()) for v in flight.vehicles)
    return [
        f"{text} (system {system_id}), and the flight is judged by them" for system_id, text in faults if text
    ]


def _missed_check(request: RunRequest, blocks: list[dict[str, Any]]) -> str:
    """The check that a completed flight has failed, as text; "" if none."""
    most_m = request.max_error_m
    for block in blocks:
        error_m = block["path_max_error_m"]
        if most_m is None:
            break
        if error_m is None:
            return f"vehicle {block['system_id']} flew no path whose error `max_error_m` could limit"
        if error_m > most_m:
            return (
                f"the path error of vehicle {block['system_id']} was {error_m:.2f} m at most, more than "
                f"`max_error_m` {most_m:g} m"
            )
    return ""


def _summary(
    mission: Mission[Any],
    request: RunRequest,
    debriefing: Debriefing,
    report: Report,
    blocks: list[dict[str, Any]],
    outcome: str,
    reason: str,
    sim_time_s: float,
    wall_time: float,
) -> dict[str, Any]:
    notes = [n for n, _ in debriefing.flights]
    options = {
        key: str(value) if isinstance(value, StrEnum) else value
        for key, value in asdict(replace(debriefing.options, arguments={}, centre=None, given=None)).items()
        if value is not None
    }
    left_out_names = list(
        dict.fromkeys((*request.left_out_parameters, *(p for n in notes for p in n.left_out_parameters)))
    )
    world = None if request.connect else request.embedded_world
    vehicles = () if world is None else world.vehicles
    summary: dict[str, Any] = {
        "mission": mission.name,
        "vehicle": "remote"
        if world is None
        else ",".join(dict.fromkeys(str(spec.model) for spec in vehicles)),
        "autopilot": notes[0].autopilot if notes else vehicles[0].autopilot if vehicles else None,
        "firmware": None if request.firmware is None or world is None else str(request.firmware),
        "seed": None if world is None else world.seed,
        "outcome": outcome,
        "reason": reason,
        "sim_time_s": round(sim_time_s, 6),
        "wall_time_s": round(wall_time, 3),
        "speedup": round(sim_time_s / max(wall_time, 1e-9), 2),
        **team_figures(blocks),
        "vehicles": blocks,
        "message_counts": debriefing.records.message_counts,
        "versions": versions(),
        "options": options | {"arguments": dict(request.options.arguments)},
        "parameters": {n: value for n, value in request.parameters.items() if n not in left_out_names},
        "parameters_left_out": left_out_names,
        "connect": list(request.connect),
        "command": request.command,
    }
    summary["planned_wind_m_s"] = request.planning_wind_m_s
    if world is not None:
        summary["wind"] = {
            "speed_m_s": world.air.wind_speed_m_s,
            "from_deg": world.air.wind_from_deg,
            "profile": world.air.profile.law.value,
            "turbulence": world.air.turbulence.value,
        }
        summary["gps"] = ",".join(dict.fromkeys(spec.gps for spec in vehicles))
    return summary | {name: value for name, value in report.figures.items() if name not in summary}


def title(mission: Mission[Any], report: Report, summary: Mapping[str, Any]) -> str:
    """Title of the picture of a run: mission, result, and wind if known."""
    parts = [report.title or mission.name, summary["autopilot"]]
    rms = summary["path_rms_error_m"]
    figures = f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.0f} s"
    if rms is not None:
        figures += f", path error {rms:.2f} m RMS, {summary['path_max_error_m']:.2f} m at most"
    if summary["outcome"] != COMPLETED:
        figures += f" ({summary['outcome']})"
    lines = [", ".join(parts), figures]
    if "wind" in summary:
        lines.append(wind_words(summary["wind"]))
    return "\n".join(lines)
