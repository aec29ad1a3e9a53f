"""Runs an estimator over logs, with a run folder for each log, or one for the logs of a team."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.errors import EstimatorError
from estimators.interface import Estimator
from estimators.library import estimator_class, parameters_from
from estimators.log_replay import replay
from estimators.logs import Log, LogError, open_log
from estimators.logs.dialect import load_dialect
from estimators.reports.summary import FAILED
from estimators.runner import Runner
from estimators.scene.of_estimators import EstimatorShows
from estimators.scene.shown import Shown
from missions.errors import PlanError
from missions.estimation.options import ReplayOptions
from missions.estimation.report import EstimationResult, ReportRequest, report
from missions.flown.run_folder import RUNS, create_run_folder
from missions.view.of_log import draw_log
from missions.view.viewer import Viewer


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayRequest(ReplayOptions):
    """The settings of a replay.

    Attributes:
        logs: files; for an estimator of a team all of them are one team's.
        estimator: its name, or the path of a user's file.
        settings: parameters as NAME=VALUE.
        dialect: dialect of telemetry logs; None: every message of MAVLink's public definitions.
        out: run folder; with several logs the folder that contains their run folders. None: the next
            `runs/<estimator>-<n>`.
        picture: whether to draw `errors.png`.
        command: the command line, for the summaries.
        view: an open viewer on which each log is drawn with what the estimator shows; None: no viewer.
    """

    logs: Sequence[Path]
    estimator: str
    settings: Sequence[str] = ()
    dialect: str | None = None
    out: Path | None = None
    picture: bool = True
    command: str = ""
    view: Viewer | None = None

    def check_together(self) -> None:
        if not self.logs:
            raise EstimatorError("no log is given; give one or more")
        if self.from_s is not None and self.to_s is not None and self.from_s >= self.to_s:
            raise EstimatorError(f"from {self.from_s:g} s to {self.to_s:g} s is no time; give from before to")


Done = Callable[[str, EstimationResult | str], None]
"""Called after each log with its name and the result, or the reason why it can't be read."""


def replay_logs(
    request: ReplayRequest, on_done: Done | None = None
) -> list[tuple[str, EstimationResult | str]]:
    """Replay logs and write their run folders.

    A log that can't be read does not prevent the replay of the others.

    Raises:
        EstimatorError: the estimator or a parameter does not exist, or the logs are not of one team.
        LogError: the dialect does not exist.
        PlanError: a run folder can't be made.
    """
    found = estimator_class(request.estimator)
    parameters = parameters_from(found, request.settings)
    if request.dialect is not None:
        load_dialect(request.dialect)  # a wrong dialect is an error for every log

    def make() -> Estimator[Any]:
        return found(parameters)

    team = found.TEAM
    groups = [list(request.logs)] if team else [[path] for path in request.logs]
    results: list[tuple[str, EstimationResult | str]] = []
    for paths in groups:
        label = ", ".join(path.name for path in paths)
        result: EstimationResult | str
        try:
            opened = [open_log(path, dialect=request.dialect) for path in paths]
            result = _replay_one(request, opened, make, found.NAME, several=len(groups) > 1)
        except LogError as error:
            result = str(error)
        results.append((label, result))
        if on_done is not None:
            on_done(label, result)
    return results


def _replay_one(
    request: ReplayRequest, logs: list[Log], make: Callable[[], Estimator[Any]], name: str, *, several: bool
) -> EstimationResult:
    begun_s = wall_time_s()
    shows, shown = EstimatorShows(name), list[Shown]()

    def look(runner: Runner) -> None:
        if request.view is not None:
            shown.extend(shows.look_at(runner))

    done = replay(
        logs,
        make,
        system_id=request.system_id,
        from_s=request.from_s,
        to_s=request.to_s,
        boot=request.boot,
        on_estimate=look,
    )
    wall_s = wall_time_s() - begun_s
    if request.view is not None:
        for number, log in enumerate(logs):
            draw_log(log, request.view, log.path.name, () if number else shown)
    failure = done.failure
    if request.system_id is not None and not done.supplies:
        ids = sorted(
            {key.system_id for log in logs for key in log.keys if key.component_id == AUTOPILOT_COMPONENT}
        )
        failure = (
            f"there is no vehicle {request.system_id} in it; there are {', '.join(map(str, ids)) or 'none'}"
        )
    return report(
        ReportRequest(
            folder=_folder(request, logs[0].path, name, several),
            logs=logs,
            fleet=done.fleet,
            settings=tuple(request.settings),
            against=request.against,
            picture=request.picture,
            wall_time_s=wall_s,
            failure=failure,
            command=request.command,
            supplies=done.supplies,
            more={"from_s": request.from_s, "to_s": request.to_s, "boot": request.boot},
        )
    )


def _folder(request: ReplayRequest, log: Path, name: str, several: bool) -> Path:
    """The run folder of one log, with the log's name if there are several."""
    if not several:
        return create_run_folder(request.out, name)
    if request.out is None:
        return create_run_folder(None, f"{name}-{log.stem}", RUNS)
    number, folder = 1, request.out / log.stem
    while folder.exists():  # two logs of the same name
        number += 1
        folder = request.out / f"{log.stem}-{number}"
    return create_run_folder(folder, name)


def check_out(request: ReplayRequest) -> None:
    """Refuse a folder that is not empty, before anything is replayed.

    Raises:
        PlanError: the folder is not empty.
    """
    out = request.out
    if out is None:
        return
    if out.exists() and not out.is_dir():
        raise PlanError(f"{out} is a file; choose a folder with `out`")
    if out.is_dir() and any(out.iterdir()):
        raise PlanError(f"{out} is not empty, and nothing is overwritten; choose another `out`")


def failed(result: EstimationResult | str) -> bool:
    """Whether the result of a log is incomplete."""
    return isinstance(result, str) or result.outcome == FAILED
