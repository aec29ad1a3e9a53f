"""The comparison of two studies, cell by cell."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missions.errors import PlanError
from missions.studies.results import Results
from missions.studies.statistics import (
    Difference,
    paired_difference,
    paired_rates,
    unpaired_difference,
    unpaired_rates,
)
from missions.studies.summary import SUCCESS, aligned, interval_text, metrics_of, name_of

__all__ = ["compared", "lines_of"]

Array = NDArray[np.float64]


def compared(first: Results, second: Results) -> dict[str, Any]:
    """Differences `second - first` of the quantities that both studies have, for the cells that both have.

    Raises:
        PlanError: they have no cell, or no quantity, in common.
    """
    cells = [(k, second.cells.index(cell)) for k, cell in enumerate(first.cells) if cell in second.cells]
    if not cells:
        raise PlanError(
            f"{first.name} and {second.name} have no cell with the same parameters; the first has "
            f"{name_of(first.cells[0]) or 'no parameters'}, the second {name_of(second.cells[0]) or 'none'}"
        )
    metrics = [name for name in metrics_of(first) if name in metrics_of(second)]
    if not metrics and not (first.success and second.success):
        raise PlanError(f"{first.name} and {second.name} have no quantity in common")
    pairs = _pairs(first, second)
    values = [
        {name: np.where(r.succeeded, r.values(name), np.nan) for name in metrics} for r in (first, second)
    ]
    found = []
    for one, other in cells:
        done = [r.finished[cell] for r, cell in ((first, one), (second, other))]
        good = [r.succeeded[cell] for r, cell in ((first, one), (second, other))]
        if pairs is None:
            rates = unpaired_rates(good[1][done[1]], good[0][done[0]])
        else:
            both = done[0][pairs[0]] & done[1][pairs[1]]
            rates = paired_rates(good[1][pairs[1]][both], good[0][pairs[0]][both])
        found.append(
            {
                "parameters": dict(first.cells[one]),
                SUCCESS: _block(rates),
                "metrics": {
                    name: _block(_difference(values[1][name][other], values[0][name][one], pairs))
                    for name in metrics
                },
            }
        )
    return {"first": first.name, "second": second.name, "paired": pairs is not None, "cells": found}


def _pairs(first: Results, second: Results) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Runs of both studies with the same seed and the same drawn parameters; None: there are none."""
    if first.sampled != second.sampled:
        return None
    seeds, other_seeds = first.seed_of_run, second.seed_of_run
    _, one, other = np.intersect1d(
        seeds[seeds >= 0], other_seeds[other_seeds >= 0], assume_unique=True, return_indices=True
    )
    one, other = np.flatnonzero(seeds >= 0)[one], np.flatnonzero(other_seeds >= 0)[other]
    for name in first.sampled:
        drawn = [np.nanmax(r.values(name), axis=0, initial=-np.inf) for r in (first, second)]
        same = drawn[0][one] == drawn[1][other]
        one, other = one[same], other[same]
    return (one, other) if len(one) else None


def _difference(
    values: Array, baseline: Array, pairs: tuple[NDArray[np.int64], NDArray[np.int64]] | None
) -> Difference:
    if pairs is None:
        return unpaired_difference(values, baseline)
    return paired_difference(values[pairs[1]], baseline[pairs[0]])


def _block(difference: Difference) -> dict[str, Any]:
    return {**asdict(difference), "conclusive": difference.conclusive}


def lines_of(differences: Mapping[str, Any]) -> list[str]:
    """The differences as lines of a table."""
    cells = differences["cells"]
    names, metrics = list(cells[0]["parameters"]), list(cells[0]["metrics"])
    head = [*names, "n", SUCCESS, *metrics]
    rows = [
        [
            *(
                f"{value:g}" if isinstance(value, float) else str(value)
                for value in cell["parameters"].values()
            ),
            str(cell[SUCCESS]["n"]),
            interval_text(cell[SUCCESS], "mean", "ci95", mark=True),
            *(interval_text(cell["metrics"][name], "mean", "ci95", mark=True) for name in metrics),
        ]
        for cell in cells
    ]
    how = "in pairs of equal seeds" if differences["paired"] else "without pairs: the seeds differ"
    title = f"{differences['second']} - {differences['first']}, {how}; mean with 95 % interval, * excludes 0:"
    return [title, *aligned([head, *rows])]
