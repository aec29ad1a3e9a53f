"""The summary of a study: `summary.json` and the lines of `table.txt`."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from missions.studies.engine import Engine
from missions.studies.results import Results
from missions.studies.rows import TrialOutcome
from missions.studies.statistics import (
    FEW,
    Difference,
    Figures,
    Rate,
    figures_of,
    paired_difference,
    paired_rates,
    rate_of,
)
from missions.studies.study import Study

__all__ = [
    "aligned",
    "cells_of",
    "differences_of",
    "failures_of",
    "interval_text",
    "metrics_of",
    "name_of",
    "study_table",
    "summary_of",
    "table_of",
]

SUCCESS: Final = "success"
_MOST_COLUMNS: Final = 8
_MOST_NAMED: Final = 6


def metrics_of(results: Results) -> list[str]:
    """The quantities that are summarised: those that the study names, or all numbers that vary."""
    numeric = results.numeric_fields()
    if results.metrics is not None:
        return [
            name for name in numeric if name in results.metrics or name.partition(".")[0] in results.metrics
        ]
    return numeric


def name_of(cell: Mapping[str, Any]) -> str:
    """A cell in one text: its parameters."""
    return ", ".join(
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}" for name, value in cell.items()
    )


def cells_of(results: Results) -> list[dict[str, Any]]:
    """The figures of each cell: trials, success rate, rates of the fields that are True or False, and
    figures of each quantity over the successful trials.
    """
    succeeded, finished = results.succeeded, results.finished
    values = {name: np.where(succeeded, results.values(name), np.nan) for name in metrics_of(results)}
    flags = {name: results.values(name) for name in results.flags() if name != results.success}
    found = []
    for index, cell in enumerate(results.cells):
        of_flags = {}
        for name, placed in flags.items():
            known = placed[index][np.isfinite(placed[index])]
            of_flags[name] = _rate(rate_of(int(known.sum()), len(known)))
        found.append(
            {
                "parameters": dict(cell),
                "trials": int(finished[index].sum()),
                SUCCESS: _rate(rate_of(int(succeeded[index].sum()), int(finished[index].sum()))),
                "rates": of_flags,
                "metrics": {name: _figures(figures_of(placed[index])) for name, placed in values.items()},
            }
        )
    return found


def differences_of(results: Results) -> list[dict[str, Any]]:
    """Differences of each cell from the baseline, in pairs of equal seeds."""
    base = results.baseline
    succeeded, finished = results.succeeded, results.finished
    values = {name: np.where(succeeded, results.values(name), np.nan) for name in metrics_of(results)}
    found = []
    for index, cell in enumerate(results.cells):
        if index == base:
            continue
        both = finished[index] & finished[base]
        rates = paired_rates(succeeded[index][both], succeeded[base][both])
        found.append(
            {
                "parameters": dict(cell),
                "baseline": dict(results.cells[base]),
                SUCCESS: _difference(rates),
                "metrics": {
                    name: _difference(paired_difference(placed[index], placed[base]))
                    for name, placed in values.items()
                },
            }
        )
    return found


def failures_of(results: Results) -> list[dict[str, Any]]:
    """The trials that were not successful: number, error or reason, and command."""
    found = []
    rows = results.table.to_pylist()
    for row in rows:
        error = row["error"]
        if row["outcome"] == TrialOutcome.DONE.value:
            if not results.success or row[results.success]:
                continue
            error = row.get("reason") or f"{results.success} is False"
        found.append({"trial": row["trial"], "error": error, "command": row["command"]})
    return found


def _missing(results: Results) -> list[str]:
    """The note on a study that is not complete."""
    if results.complete:
        return []
    trials = results.runs * len(results.cells)
    missing = trials - results.table.num_rows
    return [f"{missing} of {trials} trials are missing: the figures are preliminary"]


def notes_of(
    results: Results, cells: Sequence[Mapping[str, Any]], differences: Sequence[Mapping[str, Any]]
) -> list[str]:
    """What the number of runs does not carry."""
    notes = _missing(results)
    metrics = list(differences[0]["metrics"]) if differences else []
    counts = [figures["n"] for cell in cells for figures in cell["metrics"].values()]
    if results.runs < FEW:
        notes.append(
            f"{results.runs} runs per cell carry no more than a first impression; {FEW} or more are needed"
        )
    elif counts and min(counts) < FEW:
        notes.append(f"some figures are from fewer than {FEW} values: no more than a first impression")
    failed = [cell for cell in cells if cell[SUCCESS]["count"] < cell["trials"]]
    if failed:
        count = sum(cell["trials"] - cell[SUCCESS]["count"] for cell in failed)
        notes.append(
            f"{count} trials were not successful; figures are of the others, which may be the easier ones"
        )
    never_failed = [cell for cell in cells if cell["trials"] and cell[SUCCESS]["count"] == cell["trials"]]
    if results.success and never_failed:
        low = min(cell[SUCCESS]["ci95"][0] for cell in never_failed)
        notes.append(
            f"no failure in a cell does not mean that there are none: the rate may be as low as {low:.0%}"
        )
    for name in metrics:
        unsure = [
            name_of(d["parameters"]) + _needed(figures["runs_needed"])
            for d in differences
            if (figures := d["metrics"][name])["n"] and not figures["conclusive"] and figures["mean"]
        ]
        if unsure:
            more = f" and {len(unsure) - _MOST_NAMED} more" if len(unsure) > _MOST_NAMED else ""
            notes.append(
                f"{name}: no difference from the baseline is shown for "
                f"{'; '.join(unsure[:_MOST_NAMED])}{more}; in "
                "brackets, the runs that would show one of the size seen"
            )
    pairs = sum(len(difference["metrics"]) for difference in differences)
    if pairs >= 20:
        notes.append(f"of {pairs} differences, about {0.05 * pairs:.0f} exclude 0 by chance alone")
    versions = {text for text in results.table["versions"].unique().to_pylist() if text}
    if len(versions) > 1:
        notes.append(
            f"the rows are from {len(versions)} different sets of software versions; see column versions"
        )
    return notes


def summary_of(
    study: Study[Any, Any] | None,
    results: Results,
    *,
    engine: Engine | None = None,
    outcome: str = "",
    reason: str = "",
    wall_time_s: float | None = None,
) -> dict[str, Any]:
    """Contents of `summary.json`, without the command.

    Args:
        study: the study, for the entries that it adds; None: only those of every study.
        results: its results.
        engine: the engine that computed them.
        outcome: "completed", "interrupted" or "failed".
        reason: why it is not complete.
        wall_time_s: time of this session.
    """
    cells = cells_of(results)
    differences = differences_of(results)
    versions = [text for text in results.table["versions"].unique().to_pylist() if text]
    summary: dict[str, Any] = {
        "study": results.name,
        "description": results.description,
        "outcome": outcome or ("completed" if results.complete else "interrupted"),
        "reason": reason,
        "partial": not results.complete,
        "runs": results.runs,
        "seed": results.seed,
        "trials": results.table.num_rows,
        "failed": results.count(TrialOutcome.FAILED),
        "timed_out": results.count(TrialOutcome.TIMED_OUT),
        "lost": results.count(TrialOutcome.LOST),
        "engine": None if engine is None else engine.name,
        "workers": None if engine is None else engine.workers,
        "wall_time_s": None if wall_time_s is None else round(wall_time_s, 3),
        "trial_wall_time_s": round(float(np.sum(results.timing["wall_time_s"].to_numpy())), 3),
        "options": dict(results.options),
        "sampled": list(results.sampled),
        "cells": cells,
        "differences": differences,
        "notes": notes_of(results, cells, differences),
        "versions": json.loads(versions[0]) if versions else {},
    }
    if study is not None and study.summarise is not None:
        summary |= study.summarise(results)
    return summary


def _rate(rate: Rate) -> dict[str, Any]:
    return asdict(rate)


def _figures(figures: Figures) -> dict[str, Any]:
    return asdict(figures)


def _difference(difference: Difference) -> dict[str, Any]:
    return {**asdict(difference), "conclusive": difference.conclusive}


def study_table(study: Study[Any, Any] | None, results: Results, summary: Mapping[str, Any]) -> Sequence[str]:
    """Lines of the table of a study: its own table, or that of every study."""
    if study is None or study.report is None:
        return table_of(summary)
    return [*study.report(results), *(f"Note: {note}" for note in _missing(results))]


def table_of(summary: Mapping[str, Any]) -> list[str]:
    """Lines of the table of every study: one row for each cell, then the differences from the baseline, then
    the notes.
    """
    cells = summary["cells"]
    names = list(cells[0]["parameters"]) if cells else []
    metrics = [
        name
        for name in (cells[0]["metrics"] if cells else [])
        if any(cell["metrics"][name]["n"] for cell in cells)
    ]
    shown = metrics[:_MOST_COLUMNS]
    head = [*names, "trials", SUCCESS, *(f"{name} [95 %]" for name in shown)]
    rows = [
        [
            *(_value(cell["parameters"][name]) for name in names),
            str(cell["trials"]),
            _share(cell[SUCCESS]),
            *(interval_text(cell["metrics"][name], "median", "median_ci95") for name in shown),
        ]
        for cell in cells
    ]
    lines = aligned([head, *rows])
    lines.append("Medians with 95 % intervals (bootstrap); success with Wilson's interval.")
    if summary["differences"]:
        base = name_of(summary["differences"][0]["baseline"])
        head = [*names, "success", *shown]
        rows = [
            [
                *(_value(d["parameters"][name]) for name in names),
                interval_text(d[SUCCESS], "mean", "ci95", mark=True),
                *(interval_text(d["metrics"][name], "mean", "ci95", mark=True) for name in shown),
            ]
            for d in summary["differences"]
        ]
        lines += ["", f"Difference from {base}, mean over pairs of equal seeds; * excludes 0:"]
        lines += aligned([head, *rows])
    if len(metrics) > len(shown):
        lines += ["", f"Not shown: {', '.join(metrics[_MOST_COLUMNS:])} (summary.json)."]
    if summary["notes"]:
        lines += ["", *(f"Note: {note}." for note in summary["notes"])]
    return lines


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of texts as lines, each column as wide as its widest text."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [
        "  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]


def _needed(runs: int | None) -> str:
    return "" if runs is None else f" ({runs} runs)"


def _value(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _share(rate: Mapping[str, Any]) -> str:
    if not rate["n"]:
        return "-"
    low, high = rate["ci95"]
    return f"{rate['count']}/{rate['n']} [{low:.2f}, {high:.2f}]"


def interval_text(figures: Mapping[str, Any], key: str, interval: str, *, mark: bool = False) -> str:
    """A figure with its interval, as `1.2 [1.1, 1.3]`; `mark`: with * if the interval excludes 0."""
    if not figures["n"]:
        return "-"
    low, high = figures[interval]
    figure = f"{figures[key]:.4g}"
    if math.isfinite(low):
        figure += f" [{low:.4g}, {high:.4g}]"
    return f"{figure} *" if mark and figures["conclusive"] else figure
