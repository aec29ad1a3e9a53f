"""The errors of an estimator's run: its outcome, figures for a summary, notes, and a table as text."""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Final

import numpy as np

from estimators.comparison import Comparison, comparisons
from estimators.fleet import Fleet
from estimators.interface import Outcome
from estimators.log_replay import log_supplies, missing_of, vehicles_in
from estimators.logs import Log
from estimators.needs import Supply
from estimators.runner import Runner
from estimators.user_choices import Against

COMPLETED: Final = "completed"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"

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
class Assessment:
    """How the estimators of a run did.

    Attributes:
        outcome: "completed", "failed" or "interrupted".
        reason: why it failed; "" otherwise.
        compared: estimates with their references, by vehicle or target.
        figures: the figures of a summary: outcome, needs, errors, counters, parameters.
    """

    outcome: str
    reason: str
    compared: Sequence[Comparison]
    figures: dict[str, Any]


def assess(
    fleet: Fleet,
    logs: Sequence[Log],
    *,
    against: str = Against.BOTH,
    failure: str = "",
    interrupted: bool = False,
    supplies: Mapping[int, Sequence[Supply]] | None = None,
) -> Assessment:
    """Compare the estimates of a run with their references.

    Args:
        fleet: the estimators, finished.
        logs: logs that the estimators processed; empty: nothing was received.
        against: "autopilot", "truth" or "both".
        failure: why the result is incomplete; "" if it is complete.
        interrupted: the user ended it early.
        supplies: supplies of the needs by system id, when already known; otherwise read from the logs.
    """
    if supplies is None:
        supplies = {
            s: log_supplies(log, s, fleet.needs) for log in logs for s in vehicles_in(log, fleet.needs)
        }
        if not fleet.team and fleet.runners:
            supplies = {s: given for s, given in supplies.items() if s in fleet.runners}
    lacking = {s: missing for s, given in supplies.items() if (missing := missing_of(given))}
    reason = failure or _reason_of(lacking, len(supplies)) or ("" if logs else "nothing was received")
    compared_of = [(runner, comparisons(logs, runner, against)) for runner in fleet.runners.values()]
    compared = [c for _, own in compared_of for c in own]
    if not reason and not any(map(_has_result, fleet.runners.values())):
        reason = "no estimate was made" if supplies else "there is no vehicle's autopilot in it"
    partial = bool(reason) or interrupted
    outcome = FAILED if reason else INTERRUPTED if interrupted else COMPLETED
    blocks = [_block(runner, own, supplies) for runner, own in compared_of]
    figures = {
        "estimator": fleet.name,
        "outcome": outcome,
        "reason": reason,
        "partial": partial,
        "needs": _needs(supplies),
        **(_headline(blocks[0]) if blocks else _NOTHING),
        "vehicles": blocks,
        "parameters": _plain(fleet.parameters),
    }
    return Assessment(outcome=outcome, reason=reason, compared=compared, figures=figures)


def _has_result(runner: Runner) -> bool:
    """Whether a runner made an estimate, or found nothing in the messages that it used."""
    used = runner.outcomes.get(Outcome.USED, 0) if runner.estimator.EVENTS else 0
    return used > 0 or any(len(table) for table in runner.tables.values())


def _reason_of(lacking: Mapping[int, Sequence[str]], vehicles: int) -> str:
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
        subjects_by_reason: dict[str, list[str]] = {}
        for subject in block["subjects"]:
            if subject["not_compared"]:
                subjects_by_reason.setdefault(subject["not_compared"], []).append(subject["subject"])
        found += [
            f"{', '.join(subjects)}: nothing is compared: {reason}"
            for reason, subjects in subjects_by_reason.items()
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


_HEADINGS: Final = ("subject", "reference", "quantity", "samples", "mean", "RMS", "mean squared", "largest")
_UNITS: Final = {
    "deg": ("deg", "deg\u00b2"),
    "m": ("m", "m\u00b2"),
    "m_s": ("m/s", "m\u00b2/s\u00b2"),
    "": ("", ""),
}


def table_lines(runs: Sequence[tuple[str, Sequence[Comparison]]]) -> list[str]:
    """A table of the errors of several runs, as lines.

    Args:
        runs: name of each run, and its estimates with their references.
    """
    rows: list[tuple[str, ...]] = []
    for label, comparisons_of_run in runs:
        for compared in comparisons_of_run:
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
