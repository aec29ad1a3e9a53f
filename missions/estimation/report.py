"""The run folder of an estimator: summary, estimates as columns and as text, and picture of its errors."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.comparison import Comparison
from estimators.fleet import Fleet
from estimators.logs import Log, LogError, open_log
from estimators.needs import Supply
from estimators.reports.summary import COMPLETED, FAILED, assess
from estimators.runner import EstimateTable
from estimators.user_choices import Against
from missions.flown.run_folder import replace_summary, versions, whole, write_summary

PICTURE_NAME: Final = "errors.png"
ESTIMATES_NAME: Final = "estimates"
_CSV_DIGITS: Final = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportRequest:
    """The inputs of a report.

    Attributes:
        folder: the run folder.
        logs: logs that the estimators processed, open, or the path of the run's own log.
        fleet: the estimators, finished.
        settings: parameters as the user gave them.
        against: "autopilot", "truth" or "both".
        picture: whether to draw `errors.png`.
        wall_time_s: wall time of the run.
        failure: why the result is incomplete; "" if it is complete.
        interrupted: the user ended it early.
        command: the command line.
        supplies: by system id, when already known; otherwise read from the log.
        more: additional entries of the summary.
    """

    folder: Path
    logs: Sequence[Log] | Path
    fleet: Fleet
    settings: Sequence[str] = ()
    against: str = Against.BOTH
    picture: bool = True
    wall_time_s: float = 0.0
    failure: str = ""
    interrupted: bool = False
    command: str = ""
    supplies: Mapping[int, Sequence[Supply]] | None = None
    more: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimationResult:
    """The result of an estimator's run.

    Attributes:
        outcome: "completed", "failed" or "interrupted".
        reason: why it failed; "" otherwise.
        folder: the run folder.
        summary: contents of `summary.json`.
        compared: estimates with their references, by vehicle or target.
    """

    outcome: str
    reason: str
    folder: Path
    summary: Mapping[str, Any]
    compared: Sequence[Comparison]


def report(request: ReportRequest, *, summary_file: bool = True) -> EstimationResult:
    """Write the results of a run: all estimates, marked as partial if the run is incomplete.

    Args:
        request: the run.
        summary_file: whether to write `summary.json` and the estimator's own files; a flight includes the
            summary in its own, and has files of its mission.
    """
    fleet, logs = request.fleet, _opened(request.logs)
    assessment = assess(
        fleet,
        logs,
        against=request.against,
        failure=request.failure,
        interrupted=request.interrupted,
        supplies=request.supplies,
    )
    outcome, reason, compared = assessment.outcome, assessment.reason, assessment.compared
    summary: dict[str, Any] = {
        **assessment.figures,
        "settings": list(request.settings),
        "logs": [str(log.path) for log in logs],
        "wall_time_s": round(request.wall_time_s, 3),
        "versions": versions(),
        "command": request.command,
        **request.more,
    }
    try:
        if summary_file:
            write_summary(request.folder, summary)
        write_estimates(request.folder, fleet)
        if summary_file:
            write_files(request.folder, fleet)
        if request.picture and compared:
            from estimators.reports.picture import draw_errors

            draw_errors(request.folder / PICTURE_NAME, _title(fleet.name, logs, summary), compared)
    except OSError as error:
        outcome, reason = FAILED, f"can't write all of {request.folder}: {error.strerror}; check the disk"
        summary |= {"outcome": outcome, "reason": reason, "partial": True}
        if summary_file:
            replace_summary(request.folder, summary)
    return EstimationResult(
        outcome=outcome, reason=reason, folder=request.folder, summary=summary, compared=compared
    )


def _opened(logs: Sequence[Log] | Path) -> Sequence[Log]:
    """The logs; none when the run's own log holds no message."""
    if not isinstance(logs, Path):
        return logs
    try:
        return [open_log(logs)]
    except LogError:
        return []


def write_estimates(folder: Path, fleet: Fleet) -> list[Path]:
    """Write every table of estimates as .npz and as .csv; returns the files.

    Their name is `estimates`; with several vehicles or kinds of estimates these are added to it.
    """
    tables = [(runner, table) for runner in fleet.runners.values() for table in runner.tables.values()]
    kinds = {table.name for _, table in tables}
    written = []
    for runner, table in tables:
        parts = [ESTIMATES_NAME]
        if len(fleet.runners) > 1:
            parts.append(str(runner.system_id))
        if len(kinds) > 1:
            parts.append(table.name)
        written += _write_table(folder, "-".join(parts), table)
    return written


def write_files(folder: Path, fleet: Fleet) -> None:
    """Write the estimators' own files; with several vehicles, their names begin with the system id."""
    for runner in fleet.runners.values():
        for name, contents in runner.files.items():
            path = folder / (name if len(fleet.runners) == 1 else f"{runner.system_id}-{name}")
            with whole(path):
                path.write_bytes(contents)


def _write_table(folder: Path, name: str, table: EstimateTable) -> list[Path]:
    time_us, boot, subject, values = table.time_us, table.boot, table.subject, table.values
    columns = {"time_us": time_us, "boot": boot, "subject": subject}
    numbers: dict[str, NDArray[np.int64]] = {"target_index": table.target_index} if table.of_sets else {}
    columns |= numbers
    columns |= dict(zip(table.columns, values.T, strict=True))
    arrays = folder / f"{name}.npz"
    with whole(arrays), arrays.open("xb") as file:
        np.savez_compressed(file, **columns)  # type: ignore[arg-type]  # the names are columns, not options
    text = folder / f"{name}.csv"
    with whole(text), text.open("x", encoding="utf-8", newline="") as lines:
        writer = csv.writer(lines)
        writer.writerow(["time_s", "boot", "subject", *numbers, *table.columns])
        keys = np.column_stack((boot, subject, *numbers.values())).tolist()
        for time, key, row in zip(time_us.tolist(), keys, values.tolist(), strict=True):
            writer.writerow([f"{time * 1e-6:.6f}", *key, *(f"{v:.{_CSV_DIGITS}g}" for v in row)])
    return [arrays, text]


def _title(name: str, logs: Sequence[Log], summary: Mapping[str, Any]) -> str:
    of = ", ".join(log.path.name for log in logs)
    partial = "" if summary["outcome"] == COMPLETED else f" ({summary['outcome']})"
    return f"{name}: {of}{partial}"
