"""One run from beginning to end: a world or links, the mission on it, and the run folder.

This module opens the world or the links, starts the event loop, and reads the wall clock.
"""

import asyncio
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from autopilot_bridge.clock import unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import BridgeError
from estimators.errors import LogError
from estimators.logs import open_log
from missions.base.mission import Mission
from missions.base.report import Report
from missions.base.request import RunRequest
from missions.errors import MissionError, PlanError, TakenOver
from missions.estimation.embedded import FlightEstimators
from missions.estimation.in_flight import estimators_of, refused_in_plan
from missions.flown.records import FlightRecorder
from missions.flown.run_folder import (
    LOG_NAME,
    PICTURE_NAME,
    replace_summary,
    vehicle_summary,
    whole,
    write_summary,
)
from missions.how_left import HowLeft
from missions.library import find_mission
from missions.process.ending import EndingSignals, signal_of
from missions.runs.claimed_folder import ClaimedFolder, claim_folder
from missions.runs.flight import Flight, ProgressListener, fly_vehicles
from missions.runs.limits_before_flight import check_request, check_stage
from missions.runs.results import (
    COMPLETED,
    FAILED,
    INTERRUPTED,
    debrief,
    draw,
    missed_check,
    summary_of,
    time_stamp_faults,
    title,
)
from missions.runs.run import Run
from missions.runs.scene import FlightScene
from missions.runs.vehicle_opening import VehicleOpener
from missions.view.of_log import draw_log
from missions.view.viewer import Viewer, ViewError

__all__ = ["COMPLETED", "FAILED", "INTERRUPTED", "Flight", "RunRequest", "RunResult", "afly", "fly"]


@dataclass(frozen=True, kw_only=True)
class RunResult(Run):
    """The result of a run, and its data as of a `Run`.

    Attributes:
        report: what the mission reports.
        signal: the signal that interrupted it; 0: none.
        left: how each vehicle that was received was left.
    """

    report: Report = field(default_factory=Report)
    signal: int = 0
    left: tuple[HowLeft, ...] = ()


def fly(
    mission: Mission[Any] | str,
    request: RunRequest | None = None,
    on_progress: ProgressListener | None = None,
    *,
    opener: VehicleOpener | None = None,
) -> RunResult:
    """Fly a mission and write its run folder. Blocks until the run is finished.

    A mission that fails or is interrupted (Ctrl-C; in the main thread also SIGTERM and SIGHUP) leaves its
    vehicles safe, and still returns a result and writes a complete log. In a thread that has a running event
    loop (a notebook) the flight has a thread of its own; coroutines use `afly`.

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
        work = partial(_fly_interruptible, flown, request or RunRequest(), on_progress, ending, opener)
        return ending.in_thread(work) if _loop_is_running() else work()


async def afly(
    mission: Mission[Any] | str,
    request: RunRequest | None = None,
    on_progress: ProgressListener | None = None,
    *,
    opener: VehicleOpener | None = None,
) -> RunResult:
    """`fly` for coroutines: the flight has a thread of its own, and the caller's event loop goes on.

    `on_progress` is called in that thread. Cancelling the coroutine interrupts the flight as Ctrl-C does, and
    ends when the vehicles are left safe and the log is complete.

    Args:
        mission, request, on_progress, opener: as of `fly`.

    Raises:
        CancelledError: the coroutine was cancelled.
        PlanError, MissionError, BridgeError: as of `fly`.
    """
    opener = VehicleOpener() if opener is None else opener
    flown = find_mission(mission) if isinstance(mission, str) else mission
    ending = EndingSignals()
    work = partial(_fly_interruptible, flown, request or RunRequest(), on_progress, ending, opener)
    return await ending.beside(work)


def _loop_is_running() -> bool:
    """Whether this thread runs an event loop, so that it can't run another."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


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
    flight, view = Flight(), request.view
    outcome, reason, by_signal = COMPLETED, "", 0
    try:
        recorder = FlightRecorder(claimed.log, epoch_us=stage.epoch_us, unix_time_us=unix_time_us)
        flight.recorder = recorder
        inner = recorder if estimators is None else estimators.around(recorder, folder / LOG_NAME)
        fleet = None if estimators is None else estimators.fleet
        scene = FlightScene(inner, flight, fleet, folder / LOG_NAME, view)
        stage.on_truth(scene.record_truth)
        try:
            ending.run(
                fly_vehicles(mission, request, stage, scene, flight, estimators, on_progress), stage.loop
            )
        except KeyboardInterrupt as interrupt:
            outcome, reason, by_signal = INTERRUPTED, INTERRUPTED, signal_of(interrupt)
        except (MissionError, PlanError, BridgeError) as error:
            outcome, reason = FAILED, "; ".join((str(error), *getattr(error, "__notes__", ())))
            if isinstance(error, TakenOver) and len(flight.vehicles) > 1:
                reason = f"vehicle {error.take_over.system_id}: {reason}"
        finally:
            flight.note_how_left()
            recorder.close()
            scene.close()
    finally:
        stage.close()
        stage.loop.close()
    sim_time_s = max(0, stage.time_us() - flight.started_us) * 1e-6
    wall_s = wall_time_s() - flight.started_wall_s
    debriefing = debrief(request, recorder.records(), flight, stage, completed=outcome == COMPLETED)
    made = flight.mission
    report = Report(figures=mission.unflown) if made is None else made.report(debriefing)
    blocks = [vehicle_summary(n, s) for n, s in debriefing.flights]
    if outcome == COMPLETED:
        reason = report.verdict or missed_check(request, blocks)
        reason = "; ".join(filter(None, (reason, *(time_stamp_faults(flight) if reason else ()))))
        if recorder.failure:
            reason = "; ".join(filter(None, (reason, f"{recorder.failure}; it was flown on without a log")))
        outcome = FAILED if reason else COMPLETED
    summary = summary_of(mission, request, debriefing, report, blocks, outcome, reason, sim_time_s, wall_s)
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
                draw(folder / PICTURE_NAME, title(mission, report, summary), report, debriefing)
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
    if view is not None and not view.live:
        outcome, reason = _drawn(view, folder, outcome, reason)
    return RunResult(
        outcome=outcome,
        reason=reason,
        folder=folder,
        summary=summary,
        report=report,
        signal=by_signal,
        left=tuple(notes.left for notes, _ in debriefing.flights if notes.left is not None),
    )


def _drawn(view: Viewer, folder: Path, outcome: str, reason: str) -> tuple[str, str]:
    """Draw the flight on a viewer of recorded flights; returns outcome and reason of the run."""
    try:
        draw_log(open_log(folder / LOG_NAME), view, folder.name)
    except (ViewError, LogError, OSError) as error:
        return FAILED, "; ".join(filter(None, (reason, f"the flight was not drawn: {error}")))
    return outcome, reason


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
