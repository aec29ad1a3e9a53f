"""The Monte Carlo study `magnetic-search`: a team searches for a magnetic target among false anomalies, and
names it by passes that detect an anomaly, by the trace of the confidence, or by the evidence of classes.

The worlds are those of `fly occupancy` with the same seeds. The aircraft are points (`point_searchers`), so a
search takes seconds, or they fly: a trial is then the flight of that command.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from missions.base.request import RunRequest
from missions.occupancy.figures import NAMED_WITHIN_M
from missions.occupancy.magnetic_target import MagneticTarget
from missions.occupancy.mission import OccupancyMission
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.parameters import Identify
from missions.occupancy.world import occupancy_world
from missions.occupancy.world_searchers import search_with_points
from missions.studies.design import grid
from missions.studies.flights import fly_trial
from missions.studies.options import MagneticStudyOptions
from missions.studies.results import Results
from missions.studies.study import Study
from missions.studies.worlds import NOMINAL, World, chosen_worlds
from missions.worlds.defaults import default_world

__all__ = ["MagneticSearchCell", "SearchRow", "study"]

VEHICLES: Final = 3
FALSE_ANOMALIES: Final = 5
WORLDS: Final[Mapping[str, World[bool]]] = MappingProxyType(
    {
        "nominal": World(setting=True),
        "no-target": World(
            setting=False, differs="there is no target", source="a search where the target is not"
        ),
    }
)
"""By name; the setting is whether there is a target."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticSearchCell:
    """A cell of the design.

    Attributes:
        identify: a value of `Identify`.
        world: one of `WORLDS`.
    """

    identify: str
    world: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRow:
    """One search.

    Attributes:
        target_named: the target was named.
        false_anomaly_named: something else was.
        time_s: until something was named; the search time if nothing was.
        error_m: of the named place; NaN: none was named.
        passes: that were flown on purpose.
        no_target_probability: stated at the end.
        reason: why a flight did not complete or failed its checks; "" otherwise.
    """

    target_named: bool
    false_anomaly_named: bool
    time_s: float
    error_m: float
    passes: int
    no_target_probability: float
    reason: str = ""


def trial(cell: MagneticSearchCell, seed: int) -> SearchRow:
    """One search by points."""
    options = _options(cell)
    absent = not WORLDS[cell.world].setting
    done = search_with_points(options, seed, false_count=FALSE_ANOMALIES, absent=absent)
    investigation, error_m = done.search.investigation, done.error_m
    return SearchRow(
        target_named=error_m <= NAMED_WITHIN_M,
        false_anomaly_named=error_m > NAMED_WITHIN_M,
        time_s=done.time_s,
        error_m=error_m,
        passes=0 if investigation is None else investigation.passes_assigned,
        no_target_probability=done.search.no_target_probability,
    )


def flight(cell: MagneticSearchCell, seed: int) -> SearchRow:
    """One search by aircraft."""
    options = _options(cell)
    world = default_world(OccupancyMission.world_defaults, count=VEHICLES, seed=seed)
    world = occupancy_world(
        world, options, MagneticTarget(absent=not WORLDS[cell.world].setting, false_count=FALSE_ANOMALIES)
    )
    result = fly_trial(OccupancyMission(), RunRequest(options=options, world=world))
    summary = result.summary
    time_s, error_m = summary["time_to_find_s"], summary["target_error_m"]
    return SearchRow(
        target_named=summary.get("target_named", False),
        false_anomaly_named=summary["target_found"] and not summary.get("target_named", False),
        time_s=options.search_time_s if time_s is None else time_s,
        error_m=math.nan if error_m is None else error_m,
        passes=summary.get("passes_assigned", 0),
        no_target_probability=summary["no_target_probability"],
        reason=result.reason,
    )


def _options(cell: MagneticSearchCell) -> OccupancyOptions:
    return OccupancyOptions(vehicles=VEHICLES, identify=Identify(cell.identify))


def summarise(results: Results) -> dict[str, Any]:
    """`searches`, by way of identification: how many, what was named, time and error; and, if the threshold
    is one of the ways, the difference of time to it in pairs of equal seeds. The time of a search that does
    not name the target is infinite. A trial without a row named nothing.
    """
    named = results.values("target_named") > 0.0
    wrong = results.values("false_anomaly_named") > 0.0
    none = results.values("no_target_probability")
    never_s = np.where(named, results.values("time_s"), math.inf)
    blocks: dict[str, Any] = {}
    for k, cell in enumerate(results.cells):
        ended = results.finished[k]
        if not ended.any():
            continue
        blocks[_name(cell)] = block = {
            "searches": int(ended.sum()),
            "nothing_found": int(np.sum(ended & ~named[k] & ~wrong[k])),
            "no_target_probability_median": _finite(float(np.median(none[k, ended]))),
            "target_named": round(float(named[k, ended].mean()), 4),
            "false_anomaly_named": round(float(wrong[k, ended].mean()), 4),
            "time_s_median": _finite(float(np.median(never_s[k, ended]))),
            "error_m_median": _finite(float(np.median(results.values("error_m")[k, named[k]])))
            if named[k].any()
            else None,
        }
        pairs = ended & results.finished[0]
        alike = cell["world"] == results.cells[0]["world"]
        if alike and results.cells[0]["identify"] == Identify.THRESHOLD and pairs.any():
            both = named[k] & named[0]
            later_s = results.values("time_s")[k, both] - results.values("time_s")[0, both]
            block |= {
                "sooner_than_threshold": round(float(np.mean(never_s[k, pairs] < never_s[0, pairs])), 4),
                "later_than_threshold": round(float(np.mean(never_s[k, pairs] > never_s[0, pairs])), 4),
                "pairs_that_both_name_it": int(both.sum()),
                "time_to_threshold_s_median_of_pairs": _finite(float(np.median(later_s)))
                if both.any()
                else None,
            }
    return {"searches": blocks}


def _name(cell: Mapping[str, Any]) -> str:
    """Name of a cell: its way of identification, and its world where that is not the nominal one."""
    way, world = str(cell["identify"]), str(cell["world"])
    return way if world == NOMINAL else f"{way}, {world}"


def _finite(value: float) -> float | None:
    return round(value, 2) if math.isfinite(value) else None


def _shown(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def report(results: Results) -> list[str]:
    """The table of the command line."""
    titles = ("runs", "target", "false", "nothing", "p(none)", "time, s", "error, m", "pairs", "later, s")
    lines = [f"{'identify':20s}" + "".join(f"{title:>10s}" for title in titles)]
    for name, block in summarise(results)["searches"].items():
        columns = (
            f"{block['searches']}",
            f"{block['target_named']:.3f}",
            f"{block['false_anomaly_named']:.3f}",
            f"{block['nothing_found']}",
            _shown(block["no_target_probability_median"], 2),
            _shown(block["time_s_median"]),
            _shown(block["error_m_median"]),
            f"{block.get('pairs_that_both_name_it', '-')}",
            _shown(block.get("time_to_threshold_s_median_of_pairs")),
        )
        lines.append(f"{name:20s}" + "".join(f"{column:>10s}" for column in columns))
    return [
        *lines,
        "target, false: shares of the searches that name the target, or something else",
        "nothing, p(none): searches that found nothing; median probability that there is no target",
        "time: median of all searches; the time of a search that does not name the target is infinite",
        "later: time after the search by the threshold with the same seed, median of the pairs in which both "
        "name the target",
    ]


def study(options: MagneticStudyOptions | None = None) -> Study[MagneticSearchCell, SearchRow]:
    """The study.

    Args:
        options: None: the defaults.
    """
    o = options or MagneticStudyOptions()
    worlds = chosen_worlds(o.world, WORLDS)
    compared = [way.value for way in Identify if way in o.identify]
    return Study(
        name="magnetic-search",
        description="A team names a magnetic target among false anomalies: Lum et al. 2005, figure 8.",
        trial=flight if o.flights else trial,
        parameters=MagneticSearchCell,
        row=SearchRow,
        design=grid(world=worlds) * grid(identify=compared),
        runs=100,
        success="target_named",
        metrics=("time_s", "error_m", "passes"),
        baseline=0,
        options={"world": ",".join(worlds), "flights": o.flights},
        summarise=summarise,
        report=report,
    )
