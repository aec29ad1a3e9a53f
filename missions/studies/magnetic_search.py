"""The Monte Carlo study `magnetic-search`: a team searches for a magnetic target among false anomalies, and
names it by passes that detect an anomaly, by the trace of the confidence, or by the evidence of classes.

The worlds are those of `fly occupancy` with the same seeds. The aircraft are points (`point_searchers`), so a
search takes seconds.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from missions.embedded.point_searchers import search_with_points
from missions.occupancy.figures import NAMED_WITHIN_M
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.suspect import Identify
from missions.studies.design import grid
from missions.studies.results import Results
from missions.studies.study import Study

__all__ = ["Cell", "SearchRow", "study"]

VEHICLES: Final = 3
FALSE_ANOMALIES: Final = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of the design.

    Attributes:
        identify: a value of `Identify`.
    """

    identify: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRow:
    """One search.

    Attributes:
        target_named: the target was named.
        false_anomaly_named: something else was.
        time_s: until something was named; the search time if nothing was.
        error_m: of the named place; NaN: none was named.
        passes: that were flown on purpose.
    """

    target_named: bool
    false_anomaly_named: bool
    time_s: float
    error_m: float
    passes: int


def trial(cell: Cell, seed: int) -> SearchRow:
    """One search."""
    options = OccupancyOptions(vehicles=VEHICLES, identify=Identify(cell.identify))
    done = search_with_points(options, seed, false_count=FALSE_ANOMALIES)
    investigation, error_m = done.search.investigation, done.error_m
    return SearchRow(
        target_named=error_m <= NAMED_WITHIN_M,
        false_anomaly_named=error_m > NAMED_WITHIN_M,
        time_s=done.time_s,
        error_m=error_m,
        passes=0 if investigation is None else investigation.passes_flown,
    )


def summarise(results: Results) -> dict[str, Any]:
    """`searches`, by way of identification: what was named, time and error; and, if the threshold is one of
    the ways, the difference of time to it in pairs of equal seeds. The time of a search that does not name
    the target is infinite.
    """
    named = results.values("target_named") > 0.0
    never_s = np.where(named, results.values("time_s"), math.inf)
    blocks: dict[str, Any] = {}
    for k, cell in enumerate(results.cells):
        blocks[str(cell["identify"])] = block = {
            "target_named": round(float(named[k].mean()), 4),
            "false_anomaly_named": round(float(np.nanmean(results.values("false_anomaly_named")[k])), 4),
            "time_s_median": _finite(float(np.median(never_s[k]))),
            "error_m_median": _finite(float(np.median(results.values("error_m")[k, named[k]])))
            if named[k].any()
            else None,
        }
        if results.cells[0]["identify"] == Identify.THRESHOLD:
            both = named[k] & named[0]
            later_s = results.values("time_s")[k, both] - results.values("time_s")[0, both]
            block |= {
                "sooner_than_threshold": round(float(np.mean(never_s[k] < never_s[0])), 4),
                "later_than_threshold": round(float(np.mean(never_s[k] > never_s[0])), 4),
                "pairs_that_both_name_it": int(both.sum()),
                "time_to_threshold_s_median_of_pairs": _finite(float(np.median(later_s)))
                if both.any()
                else None,
            }
    return {"searches": blocks}


def _finite(value: float) -> float | None:
    return round(value, 2) if math.isfinite(value) else None


def report(results: Results) -> list[str]:
    """The table of the command line."""
    lines = [
        f"{'identify':10s} {'target':>8s} {'false':>8s} {'time, s':>8s} {'error, m':>9s} {'pairs':>6s} "
        f"{'later, s':>9s}"
    ]
    for name, block in summarise(results)["searches"].items():
        shown = [
            "-" if value is None else f"{value:.1f}"
            for value in (
                block["time_s_median"],
                block["error_m_median"],
                block.get("time_to_threshold_s_median_of_pairs"),
            )
        ]
        lines.append(
            f"{name:10s} {block['target_named']:8.3f} {block['false_anomaly_named']:8.3f} {shown[0]:>8s} "
            f"{shown[1]:>9s} {block.get('pairs_that_both_name_it', '-'):>6} {shown[2]:>9s}"
        )
    lines.append(
        "time: median, where a search that does not name the target never does; later: than threshold,"
    )
    lines.append("median of the pairs of equal seeds that both name it")
    return lines


def study(ways: Collection[Identify] = tuple(Identify)) -> Study[Cell, SearchRow]:
    """The study.

    Args:
        ways: of identification that are compared, the threshold first.
    """
    compared = [way.value for way in Identify if way in ways]
    return Study(
        name="magnetic-search",
        description="A team names a magnetic target among false anomalies: Lum et al. 2005, figure 8.",
        trial=trial,
        parameters=Cell,
        row=SearchRow,
        design=grid(identify=compared),
        runs=100,
        success="target_named",
        metrics=("time_s", "error_m", "passes"),
        baseline=0,
        summarise=summarise,
        report=report,
    )
