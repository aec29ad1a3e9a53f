"""The run folder of an estimator: summary, estimates as columns and as text, and picture of its errors."""

import csv
import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.comparison import Comparison, comparisons
from estimators.fleet import Fleet
from estimators.log_replay import log_supplies, missing_of, vehicles_in
from estimators.logs import Log, LogError, open_log
from estimators.needs import Supply
from estimators.runner import EstimateTable, Runner
from missions.runs.run_folder import replace_summary, versions, whole, write_summary

__all__ = [
    "COMPLETED",
    "FAILED",
    "INTERRUPTED",
    "EstimationResult",
    "ReportRequest",
    "notes_of",
    "report",
    "table_lines",
    "warnings_of",
    "write_estimates",
]

COMPLETED: Final = "completed"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"

PICTURE_NAME: Final = "errors.png"
ESTIMATES_NAME: Final = "estimates"
_CSV_DIGITS: Final = 9
_NOTHING: Final[Mapping[str, Any]] = {
    "system_id": None,
    "samples": 0,
    "counters": {},
    "left_out": {},
    "airborne_s": 0.0,
    "reference": None,
    "not_compared": None,
}


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
        supplies, lacking: by system id, when already known; otherwise read from the log.
        more: additional entries of the summary.
    """

    folder: Path
    logs: Sequence[Log] | Path
    fleet: Fleet
    settings: Sequence[str] = ()
    against: str = "both"
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
        summary_file: whether to write `summary.json`; a flight includes it in its own summary file.
    """
    fleet = request.fleet
    logs, reason = _opened(request.logs)
    supplies = request.supplies
    if supplies is None:
        supplies = {
            s: log_supplies(log, s, fleet.needs) for log in logs for s in vehicles_in(log, fleet.needs)
        }
        if not fleet.team and fleet.runners:
            supplies = {s: given for s, given in supplies.items() if s in fleet.runners}
    lacking = {s: missing for s, given in supplies.items() if (missing := missing_of(given))}
    reason = request.failure or _told(lacking, len(supplies)) or reason
    compared_of = [(runner, comparisons(logs, runner, request.against)) for runner in fleet.runners.values()]
    compared = [c for _, own in compared_of for c in own]
    estimates = sum(len(table) for runner in fleet.runners.values() for table in runner.tables.values())
    if not reason and not estimates:
        reason = "no estimate was made" if supplies else "there is no vehicle's autopilot in it"
    partial = bool(reason) or request.interrupted
    outcome = FAILED if reason else INTERRUPTED if request.interrupted else COMPLETED
    blocks = [_block(runner, own, supplies) for runner, own in compared_of]
    summary: dict[str, Any] = {
        "estimator": fleet.name,
        "outcome": outcome,
        "reason": reason,
        "partial": partial,
        "needs": _needs(supplies),
        **(_headline(blocks[0]) if blocks else _NOTHING),
        "vehicles": blocks,
        "parameters": _plain(fleet.parameters),
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
        if request.picture and compared:
            from missions.estimation.picture import draw_errors

            draw_errors(request.folder / PICTURE_NAME, _title(fleet.name, logs, summary), compared)
    except OSError as error:
        outcome, reason = FAILED, f"can't write all of {request.folder}: {error.strerror}; check the disk"
        summary |= {"outcome": outcome, "reason": reason, "partial": True}
        if summary_file:
            replace_summary(request.folder, summary)
    return EstimationResult(
        outcome=outcome, reason=reason, folder=request.folder, summary=summary, compared=compared
    )


def _opened(logs: Sequence[Log] | Path) -> tuple[Sequence[Log], str]:
    if not isinstance(logs, Path):
        return logs, ""
    try:
        return [open_log(logs)], ""
    except LogError:
        return [], "nothing was received"


def _told(lacking: Mapping[int, Sequence[str]], vehicles: int) -> str:
    """The missing inputs in one sentence."""
    parts = [
        text if vehicles == 1 else f"vehicle {system}: {text}"
        for system, texts in lacking.items()
        for text in texts
    ]
    return "; ".join(parts)


def _needs(supplies: Mapping[int, Sequence[Supply]]) -> list[dict[str, Any]]:
    """Each need of each vehicle, and the message that supplies it."""
    return [
        {
            "vehicle": system,
            "purpose": supply.need.purpose,
            "messages": list(supply.need.messages),
            "needed_hz": supply.need.rate_hz,
            "served_by": supply.message or None,
            "rate_hz": round(supply.rate_hz, 3),
            "optional": supply.need.optional,
            "met": supply.met,
            "text": supply.text,
        }
        for system, given in supplies.items()
        for supply in given
    ]


def _block(
    runner: Runner, compared: Sequence[Comparison], supplies: Mapping[int, Sequence[Supply]]
) -> dict[str, Any]:
    """Figures of one runner: of a vehicle, or of a team."""
    block: dict[str, Any] = {
        "system_id": runner.system_id,
        "samples": sum(len(table) for table in runner.tables.values()),
        "boots": runner.boot + 1,
        "counters": {outcome.value: n for outcome, n in sorted(runner.outcomes.items(), key=_by_value)},
        "left_out": dict(sorted(runner.left_out.items())),
        "partial": any(missing_of(given) for s, given in supplies.items() if runner.system_id in (None, s)),
        "remarks": {key: _plain(value) for key, value in runner.remarks.items()},
        "subjects": [_subject(c) for c in compared],
    }
    return block


def warnings_of(summary: Mapping[str, Any]) -> list[str]:
    """Warnings of the estimators in a summary."""
    found = []
    for block in summary["vehicles"]:
        if "warning" in block["remarks"]:
            which = "" if block["system_id"] is None else f"vehicle {block['system_id']}: "
            found.append(which + block["remarks"]["warning"])
    return found


def notes_of(summary: Mapping[str, Any]) -> list[str]:
    """Notes for the reader: the corrections that the estimators applied, and reasons why something was not
    compared.
    """
    found = []
    for block in summary["vehicles"]:
        which = "" if block["system_id"] is None else f"vehicle {block['system_id']}: "
        if "note" in block["remarks"]:
            found.append(which + block["remarks"]["note"])
        found += [
            f"{subject['subject']}: nothing is compared: {subject['not_compared']}"
            for subject in block["subjects"]
            if subject["not_compared"]
        ]
    return found


def _by_value(item: tuple[Any, int]) -> str:
    return str(item[0].value)


def _subject(compared: Comparison) -> dict[str, Any]:
    main = compared.reference
    return {
        "subject": compared.label,
        "estimates": len(compared.time_us),
        "airborne_s": round(compared.airborne_s, 3),
        "airborne_from": compared.airborne_from,
        "reference": main,
        "not_compared": compared.not_compared or None,
        **({} if main is None else _figures(compared, main)),
        "against": {
            name: {"sources": list(compared.sources[name]), **_figures(compared, name)}
            for name in compared.figures
        },
    }


def _figures(compared: Comparison, reference: str) -> dict[str, float]:
    found = {key: value for item in compared.figures[reference] for key, value in item.as_summary().items()}
    return {key: float(f"{value:.9g}") for key, value in found.items()}


def _headline(block: Mapping[str, Any]) -> dict[str, Any]:
    """The entries at the top of the summary: those of the first vehicle or the first target."""
    first = (
        block["subjects"][0]
        if block["subjects"]
        else {"airborne_s": 0.0, "reference": None, "not_compared": None}
    )
    own = {key: block[key] for key in ("system_id", "samples", "counters", "left_out", "boots", "remarks")}
    return own | {key: value for key, value in first.items() if key not in ("subject", "estimates")}


def _plain(value: Any) -> Any:
    """A value converted for JSON."""
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: _plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (np.floating, np.integer)):
        return value.item()
    return value if isinstance(value, (bool, int, float, str, type(None))) else str(value)


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


_HEADINGS: Final = ("subject", "reference", "quantity", "samples", "mean", "RMS", "mean squared", "largest")
_UNITS: Final = {
    "deg": ("deg", "deg\u00b2"),
    "m": ("m", "m\u00b2"),
    "m_s": ("m/s", "m\u00b2/s\u00b2"),
    "": ("", ""),
}


def table_lines(results: Sequence[tuple[str, EstimationResult]]) -> list[str]:
    """A table of the errors of several runs, as lines.

    Args:
        results: name and result of each run.
    """
    rows: list[tuple[str, ...]] = []
    for label, result in results:
        for compared in result.compared:
            for reference, figures in compared.figures.items():
                for f in figures:
                    unit, square = _UNITS[f.unit]
                    quantity = f.quantity + (" speed" if f.unit == "m_s" else "")
                    rows.append(
                        (label, compared.label, reference, quantity, str(f.samples), f"{f.mean:.3f} {unit}",
                         f"{f.rms:.3f} {unit}", f"{f.mse:.3f} {square}", f"{f.max:.3f} {unit}")
                    )  # fmt: skip
    if not rows:
        return []
    lines = [("log", *_HEADINGS), *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    left = 4  # columns of text; the others contain numbers
    return [
        "  ".join(
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    ]
