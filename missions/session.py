"""One run from beginning to end: a world or a link, the mission on it, and the run folder.

This is the shell around the missions: it opens things, starts the event loop, and looks at the wall clock.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from contextlib import AsyncExitStack, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from autopilot_bridge.clock import Clock, LoopClock, TelemetryClock, run, unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import BridgeError
from autopilot_bridge.tlog import TlogWriter
from missions.connection import GROUND_STATION, Connection
from missions.errors import MissionError, PlanError
from missions.library import Mission, PatternMission
from missions.notes import FlightNotes
from missions.options import FlightOptions
from missions.planning.limits import DEFAULT_LIMITS, WIDEST_LIMITS, VehicleLimits
from missions.records import FlightRecorder, FlightRecords
from missions.run import (
    EPOCH_UNIX_US,
    LOG_NAME,
    PICTURE_NAME,
    RUNS,
    create_run_folder,
    team_figures,
    vehicle_summary,
    versions,
    write_summary,
)
from missions.scenario import NeedsScenario, Scenario, Setting
from missions.vehicle.adapter import Mode
from missions.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from autopilot_bridge.links import Link
    from missions.score import FlightScore

_LIMITING_PARAMETERS: Final = ("MPC_XY_VEL_MAX", "MPC_ACC_HOR", "WPNAV_SPEED", "WPNAV_ACCEL")

COMPLETED: Final = "completed"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """Everything about a run but the mission itself.

    Attributes:
        options: what the mission is to do.
        connect: connection strings, one per vehicle; empty: an embedded SITL.
        autopilot, model, seed, speedup, wind_speed_m_s, wind_from_deg, turbulence, home: of the embedded
            SITL.
        parameters: autopilot parameters to set before the flight.
        out: run folder; None: the next `runs/<mission>-<n>`.
        picture: whether to draw `track.png`.
        identity: MAVLink system and component id of the mission.
        on_failure: what the vehicle is told when the mission fails or is interrupted.
        command: the command line, for the summary.
    """

    options: FlightOptions = field(default_factory=FlightOptions)
    connect: Sequence[str] = ()
    autopilot: str = "px4"
    model: str = "iris"
    seed: int = 0
    speedup: float | None = None
    wind_speed_m_s: float = 0.0
    wind_from_deg: float = 0.0
    turbulence: str = "none"
    home: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    out: Path | None = None
    picture: bool = True
    identity: tuple[int, int] = GROUND_STATION
    on_failure: Mode = Mode.RETURN
    command: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """How a run went.

    Attributes:
        outcome: "completed", "failed" or "interrupted".
        reason: why it failed; "" otherwise.
        folder: the run folder.
        summary: what `summary.json` holds.
    """

    outcome: str
    reason: str
    folder: Path
    summary: Mapping[str, Any]


class Flight:
    """A run while it goes on, for whoever shows progress.

    Attributes:
        vehicles: as soon as they are made.
        started_wall_s: wall clock when the run began.
        started_us: vehicle time when the run began: boot of an embedded one, else when it was first heard.
    """

    def __init__(self) -> None:
        self.vehicles: list[Vehicle] = []
        self.clock: Clock | None = None
        self.started_wall_s = wall_time_s()
        self.started_us = 0


ProgressListener = Callable[[Flight], None]
"""Called each second of vehicle time."""


def fly(mission: Mission, request: RunRequest, on_progress: ProgressListener | None = None) -> RunResult:
    """Fly a mission and write its run folder. Blocks until all is done.

    A mission that fails or is interrupted (Ctrl-C) leaves its vehicles safe, and still gives a result and a
    whole log.

    Raises:
        PlanError: what was asked for can't be flown; nothing was started.
        BridgeError: a link can't be opened.
    """
    mission.check(request.options, limits_before_flight(request))
    if request.connect and len(request.connect) != request.options.vehicles:
        raise PlanError(
            f"{len(request.connect)} connections for {request.options.vehicles} vehicles; "
            "give --connect once for each vehicle"
        )
    made = _missing_folders(request.out or RUNS)
    folder = create_run_folder(request.out, mission.name)
    try:
        session = _open_remote(request) if request.connect else _open_embedded(mission, request, folder)
    except BaseException:
        if request.out is None:
            made.insert(0, folder)
        with suppress(OSError):
            for empty in made:
                empty.rmdir()
        raise
    flight = Flight()
    outcome, reason = COMPLETED, ""
    try:
        with TlogWriter(folder / LOG_NAME) as log:
            recorder = FlightRecorder(log, epoch_us=session.epoch_us, unix_time_us=unix_time_us)
            session.on_truth(recorder.record_truth)
            try:
                run(_fly(mission, request, session, recorder, flight, on_progress), session.loop)
            except KeyboardInterrupt:
                outcome, reason = INTERRUPTED, "interrupted"
            except (MissionError, PlanError, BridgeError) as error:
                outcome, reason = FAILED, str(error)
    finally:
        session.close()
        session.loop.close()
    sim_time_s = max(0, session.time_us() - flight.started_us) * 1e-6
    wall_s = wall_time_s() - flight.started_wall_s
    summary = _summary(mission, request, recorder.records, flight, outcome, reason, sim_time_s, wall_s)
    scores = summary.pop("_scores")
    write_summary(folder, summary)
    if request.picture and scores:
        from missions.picture import draw_run

        draw_run(folder / PICTURE_NAME, _title(mission, request, summary), scores)
    return RunResult(outcome=outcome, reason=reason, folder=folder, summary=summary)


def _missing_folders(folder: Path) -> list[Path]:
    """Those of a folder and the folders it is in that are not there yet, innermost first."""
    try:
        return [path for path in (folder, *folder.parents) if not path.exists()]
    except OSError:  # not to be looked at: making it will say why
        return []


def limits_before_flight(request: RunRequest) -> VehicleLimits:
    """What can be refused before a vehicle was heard: by the embedded SITL's parameters, or wide for
    others.
    """
    known = DEFAULT_LIMITS.get(request.autopilot)
    if request.connect or known is None:
        return WIDEST_LIMITS
    given = request.parameters
    for name in _LIMITING_PARAMETERS:
        if not given.get(name, 1.0) > 0.0:
            raise PlanError(f"parameter {name} = {given[name]:g} is not possible; it must be more than 0")
    if request.autopilot == "px4":
        return replace(
            known,
            speed_m_s=given.get("MPC_XY_VEL_MAX", known.speed_m_s),
            acceleration_m_s2=given.get("MPC_ACC_HOR", known.acceleration_m_s2),
        )
    return replace(
        known,
        speed_m_s=0.01 * given.get("WPNAV_SPEED", 100.0 * known.speed_m_s),
        acceleration_m_s2=0.01 * given.get("WPNAV_ACCEL", 100.0 * known.acceleration_m_s2),
    )


@dataclass(slots=True, kw_only=True)
class _Session:
    """What a flight runs on."""

    loop: asyncio.AbstractEventLoop
    links: list["Link"]
    clocks: list[Clock]
    epoch_us: int | None
    time_us: Callable[[], int]
    on_truth: Callable[[Callable[[int, bytes], None]], None]
    close: Callable[[], None]


def _open_embedded(mission: Mission, request: RunRequest, folder: Path) -> _Session:
    from missions.embedded import EmbeddedConfiguration, open_embedded

    scenario = Scenario()
    if isinstance(mission, NeedsScenario):
        scenario = mission.scenario(request.options, Setting(seed=request.seed, folder=folder))
    try:
        sitl = open_embedded(
            EmbeddedConfiguration(
                vehicles=request.options.vehicles,
                model=request.model,
                flavour=request.autopilot,
                seed=request.seed,
                speedup=request.speedup,
                wind_speed_m_s=request.wind_speed_m_s,
                wind_from_deg=request.wind_from_deg,
                turbulence=request.turbulence,
                parameters=request.parameters,
                home=request.home,
                scenario=scenario,
            )
        )
    except ValueError as error:
        raise PlanError(str(error)) from error
    return _Session(
        loop=sitl.loop,
        links=list(sitl.links),
        clocks=[LoopClock() for _ in sitl.links],
        epoch_us=EPOCH_UNIX_US,
        time_us=lambda: sitl.time_us,
        on_truth=sitl.on_truth,
        close=sitl.close,
    )


def _open_remote(request: RunRequest) -> _Session:
    from autopilot_bridge.links import ReplayLog, open_link, parse_address

    addresses = [parse_address(text) for text in request.connect]
    for address in addresses:
        if isinstance(address, ReplayLog):
            raise PlanError(f"--connect {address}: a log can't be flown; give the link of a vehicle")
    links: list[Link] = []
    try:
        links.extend(open_link(address) for address in addresses)
    except BaseException:
        for link in links:
            link.close()
        raise
    clocks = [TelemetryClock() for _ in links]

    def close() -> None:
        for link in links:
            link.close()

    return _Session(
        loop=asyncio.new_event_loop(),
        links=links,
        clocks=list(clocks),
        epoch_us=None,
        time_us=lambda: max(clock.time_us for clock in clocks),
        on_truth=lambda _listener: None,
        close=close,
    )


async def _fly(
    mission: Mission,
    request: RunRequest,
    session: _Session,
    recorder: FlightRecorder,
    flight: Flight,
    on_progress: ProgressListener | None,
) -> None:
    async with AsyncExitStack() as stack:
        for link, clock in zip(session.links, session.clocks, strict=True):
            connection = Connection(link, clock, recorder, identity=request.identity)
            await stack.enter_async_context(connection)
            flight.vehicles.append(Vehicle(connection))
        flight.clock = session.clocks[0]
        reporter = asyncio.get_running_loop().create_task(_report(flight, on_progress))
        try:
            await _all([_prepare(vehicle, request, flight) for vehicle in flight.vehicles])
            centre = flight.vehicles[0].home if len(flight.vehicles) > 1 else request.options.centre
            await _all(
                [
                    _fly_one(mission, vehicle, replace(request.options, index=k, centre=centre), request)
                    for k, vehicle in enumerate(flight.vehicles)
                ]
            )
        finally:
            for vehicle in flight.vehicles:
                vehicle.notes.end(vehicle.clock.time_us)
            reporter.cancel()
            await asyncio.gather(reporter, return_exceptions=True)


async def _prepare(vehicle: Vehicle, request: RunRequest, flight: Flight) -> None:
    try:
        await vehicle.wait_heartbeat()
    except MissionError as error:
        where = f" on {', '.join(request.connect)}" if request.connect else ""
        raise MissionError(f"no vehicle was heard{where}: {error}; is it on, and sending there?") from error
    vehicle.notes.system_id = vehicle.system_id
    vehicle.notes.autopilot = vehicle.autopilot
    if request.connect:
        if vehicle is flight.vehicles[0]:
            flight.started_us = vehicle.clock.time_us
        await vehicle.set_parameters(request.parameters)
    await vehicle.wait_ready()


async def _fly_one(mission: Mission, vehicle: Vehicle, options: FlightOptions, request: RunRequest) -> None:
    vehicle.notes.begin("flight", vehicle.clock.time_us)  # until the mission names a phase of its own
    async with vehicle.safe_on_exit(request.on_failure):
        await mission.fly(vehicle, options)
        if vehicle.armed:
            raise MissionError(
                f"the mission ended with the vehicle armed; it was told to {request.on_failure}. "
                "End a mission with return_to_launch() or land()"
            )
        vehicle.notes.progress = 1.0


async def _all(coroutines: Sequence[Any]) -> None:
    """Run together; the first failure ends the others, and is the one that is told."""
    try:
        async with asyncio.TaskGroup() as group:
            for coroutine in coroutines:
                group.create_task(coroutine)
    except* (MissionError, PlanError, BridgeError) as errors:
        first: BaseException = errors
        while isinstance(first, BaseExceptionGroup):
            first = first.exceptions[0]
        raise first from None


async def _report(flight: Flight, on_progress: ProgressListener | None) -> None:
    while on_progress is not None and flight.clock is not None:
        on_progress(flight)
        await flight.clock.sleep(1.0)


def _summary(
    mission: Mission,
    request: RunRequest,
    records: FlightRecords,
    flight: Flight,
    outcome: str,
    reason: str,
    sim_time_s: float,
    wall_time: float,
) -> dict[str, Any]:
    from missions.score import score

    notes = [vehicle.notes for vehicle in flight.vehicles if vehicle.notes.system_id]
    scores: list[tuple[FlightNotes, FlightScore]] = [(n, score(records, n)) for n in notes]
    blocks = [vehicle_summary(n, s) for n, s in scores]
    options = {
        key: str(value) if key in ("centre", "via") else value
        for key, value in asdict(replace(request.options, arguments={}, centre=None)).items()
        if value is not None
    }
    remote = bool(request.connect)
    summary: dict[str, Any] = {
        "mission": mission.name,
        "vehicle": "remote" if remote else request.model,
        "autopilot": notes[0].autopilot if notes else request.autopilot,
        "seed": None if remote else request.seed,
        "outcome": outcome,
        "reason": reason,
        "sim_time_s": round(sim_time_s, 6),
        "wall_time_s": round(wall_time, 3),
        "speedup": round(sim_time_s / max(wall_time, 1e-9), 2),
        **team_figures(blocks),
        "vehicles": blocks,
        "message_counts": records.message_counts,
        "versions": versions(),
        "options": options | {"arguments": dict(request.options.arguments)},
        "parameters": dict(request.parameters),
        "connect": list(request.connect),
        "command": request.command,
        "_scores": scores,
    }
    if not remote:
        summary["wind"] = {
            "speed_m_s": request.wind_speed_m_s,
            "from_deg": request.wind_from_deg,
            "turbulence": request.turbulence,
        }
    return summary


def _title(mission: Mission, request: RunRequest, summary: Mapping[str, Any]) -> str:
    options = request.options
    parts = [mission.name]
    if mission.name == "lissajous":
        parts.append(options.pattern if options.ratio is None else "{:g}:{:g}".format(*options.ratio))
    if isinstance(mission, PatternMission):
        parts += [f"{options.width_m:g} m x {options.height_m:g} m", f"via {options.via}"]
    parts.append(summary["autopilot"])
    rms = summary["path_rms_error_m"]
    figures = f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.0f} s"
    if rms is not None:
        figures += f", path error {rms:.2f} m RMS, {summary['path_max_error_m']:.2f} m at most"
    return (
        ", ".join(parts)
        + "\n"
        + figures
        + ("" if summary["outcome"] == COMPLETED else f" ({summary['outcome']})")
    )
