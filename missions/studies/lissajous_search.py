"""The Monte Carlo study `lissajous-search`: how soon patterns find a walking tag, as flights on SITL with
rendered pictures: the seven of Steckenrider, Leamy and Furukawa 2020, Table I, and an ergodic search.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from estimators.reports.figure import blank_figure, save_figure
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions
from missions.base.request import RunRequest
from missions.pattern_search.tag_target import TagTarget
from missions.pattern_search.world import tag_search_world
from missions.studies.design import grid
from missions.studies.flights import fly_trial
from missions.studies.options import LissajousStudyOptions, SearchPatterns
from missions.studies.results import Results
from missions.studies.statistics import paired_difference, rate_of
from missions.studies.study import Study

__all__ = [
    "PAPER",
    "PATTERNS",
    "LissajousSearchCell",
    "SearchTrial",
    "Searched",
    "restricted_mean_s",
    "study",
]

Array = NDArray[np.float64]

LIMIT_S: Final = 1800.0
_LISSAJOUS: Final = (SearchPatterns.L1, SearchPatterns.L2, SearchPatterns.L3, SearchPatterns.L4)
PATTERNS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        name.value: ("lissajous", name.value) if name in _LISSAJOUS else (name.value.replace("_", "-"), "L3")
        for name in SearchPatterns
    }
)
"""Mission and named Lissajous pattern of each entry."""

PAPER: Final[Mapping[str, tuple[int, float | None, float | None]]] = MappingProxyType(
    {
        "L1": (0, None, None),
        "L2": (1, 87.0, None),
        "L3": (5, 185.0, 138.0),
        "L4": (6, 364.0, 343.0),
        "sector": (1, 134.0, None),
        "parallel_sweep": (6, 493.0, 224.0),
        "expanding_square": (5, 304.4, 174.0),
    }
)
"""Table I: found of seven, mean and standard deviation of the time in seconds. It has no ergodic search."""
_PAPER_RUNS: Final = 7
_BASELINE: Final = "parallel_sweep"  # the standard pattern with the most searches that found the target
_CUT_SHORT_S: Final = 1.0  # a search that ends so much before the limit was cut short
_BATTERY_AH: Final = 12.0  # for half an hour of flight: the battery of the paper's simulation lasts


@dataclass(frozen=True, slots=True, kw_only=True)
class LissajousSearchCell:
    """Parameters of a trial."""

    pattern: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """The result of a search.

    Attributes:
        completed: the search was flown, and passed its checks.
        reason: why not; "" otherwise.
        found: whether the tag was detected within the limit.
        search_s: time until then, or the searched time.
        error_m: distance of the tag's estimated place from the true one; NaN: not found.
        frames: number of searched pictures.
        sim_time_s: time from boot to the end.
    """

    completed: bool
    reason: str
    found: bool
    search_s: float
    error_m: float
    frames: int
    sim_time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTrial:
    """One search with a pattern.

    Attributes:
        speed_m_s: of the vehicle.
        target_speed_m_s: of the target's random walk.
        limit_s: duration of a search.
    """

    speed_m_s: float = 5.0
    target_speed_m_s: float = 0.3
    limit_s: float = LIMIT_S

    def __call__(self, cell: LissajousSearchCell, seed: int) -> Searched:
        """Fly the search. The same seed has the same walk of the target for all patterns."""
        mission, pattern = PATTERNS[cell.pattern]
        options = FlightOptions(
            pattern=pattern, speed_m_s=self.speed_m_s, search=True, search_time_s=self.limit_s
        )
        world = WorldSpec.of_team(1, seed=seed)
        world = replace(world, vehicles=(replace(world.vehicles[0], battery_ah=_BATTERY_AH),))
        world = tag_search_world(world, options, TagTarget(speed_m_s=self.target_speed_m_s))
        result = fly_trial(mission, RunRequest(options=options, world=world))
        search = result.summary["search"]
        return Searched(
            completed=result.outcome == "completed",
            reason=result.reason,
            found=search["found"],
            search_s=search["search_s"],
            error_m=math.nan if search["error_m"] is None else search["error_m"],
            frames=search["frames"],
            sim_time_s=result.summary["sim_time_s"],
        )


def study(options: LissajousStudyOptions | None = None) -> Study[LissajousSearchCell, Searched]:
    """The study.

    Args:
        options: None: the defaults.
    """
    o = options or LissajousStudyOptions()
    return Study(
        name="lissajous-search",
        description="Patterns search for a walking tag: Table I of Steckenrider et al. 2020, and an ergodic "
        "search.",
        trial=SearchTrial(speed_m_s=o.speed_m_s, target_speed_m_s=o.target_speed_m_s),
        parameters=LissajousSearchCell,
        row=Searched,
        design=grid(pattern=tuple(name for name in PATTERNS if name in o.pattern)),
        runs=100,
        success="completed",
        metrics=("search_s", "error_m"),
        options={"speed": o.speed_m_s, "target_speed": o.target_speed_m_s},
        summarise=summarise,
        report=lines_of,
        draw=draw,
    )


def restricted_mean_s(time_s: Array, found: NDArray[np.bool_], limit_s: float) -> float:
    """Mean of min(T, limit) by the Kaplan-Meier curve: the area under it up to the limit.

    Searches that ended without success are censored at their time.
    """
    times, missed = survival(time_s, found)
    edges = np.concatenate(([0.0], np.minimum(times, limit_s), [limit_s]))
    return float(np.sum(np.diff(edges) * np.concatenate(([1.0], missed))))


def survival(time_s: Array, found: NDArray[np.bool_]) -> tuple[Array, Array]:
    """The Kaplan-Meier curve: times (n,), and the probability that the search lasts longer (n,)."""
    data = stats.CensoredData.right_censored(time_s, ~found)
    curve = stats.ecdf(data).sf
    return np.asarray(curve.quantiles, dtype=np.float64), np.asarray(curve.probabilities, dtype=np.float64)


def _patterns(results: Results) -> list[str]:
    return [str(cell["pattern"]) for cell in results.cells]


def _rows(results: Results, pattern: str) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Of each run of a pattern the time, whether the tag was found, and whether the search was begun."""
    cell = _patterns(results).index(pattern)
    time_s, found = results.values("search_s")[cell], results.values("found")[cell] == 1.0
    return time_s, found, found | (time_s > 0.0)  # NaN: the trial itself failed


def _searches(results: Results, pattern: str) -> tuple[Array, NDArray[np.bool_]]:
    """Times, and whether the tag was found, of the searches of a pattern that were begun.

    A flight that failed counts as well: with its time if it has found the tag, else censored at that time.
    Without those that failed late, the patterns would look quicker than they are.
    """
    time_s, found, begun = _rows(results, pattern)
    return time_s[begun], found[begun]


def _restricted(results: Results, pattern: str) -> Array:
    """(runs,) times of the searches, the limit for those without success; NaN: cut short, or not begun."""
    time_s, found, _ = _rows(results, pattern)
    missed = np.where(time_s >= LIMIT_S - _CUT_SHORT_S, LIMIT_S, np.nan)
    return np.where(found, np.minimum(time_s, LIMIT_S), missed)


def summarise(results: Results) -> Mapping[str, Any]:
    """Entries of `summary.json`: the searches of each pattern, beside the paper's."""
    return {"patterns": {name: _pattern(results, name) for name in _patterns(results)}, "limit_s": LIMIT_S}


def _pattern(results: Results, name: str) -> dict[str, Any]:
    time_s, found = _searches(results, name)
    rate = rate_of(int(found.sum()), len(found))
    entry: dict[str, Any] = {
        "found": rate.count,
        "runs": rate.n,
        "rate_ci95": [_rounded(value) for value in rate.ci95],
        "mean_s": _rounded(float(time_s[found].mean())) if found.any() else None,
        "restricted_mean_s": None,
        "restricted_mean_ci95_s": None,
        "median_s": None,
        "minus_parallel_sweep_s": None,
        "minus_parallel_sweep_ci95_s": [None, None],
        "paper": None,
    }
    if len(found):
        restricted = np.where(found, np.minimum(time_s, LIMIT_S), LIMIT_S)
        entry["restricted_mean_s"] = _rounded(restricted_mean_s(time_s, found, LIMIT_S))
        if len(found) > 1 and (time_s[~found] >= LIMIT_S - _CUT_SHORT_S).all():
            # all censoring is at the limit, so that the variance is that of the restricted times
            half = float(stats.t.ppf(0.975, len(found) - 1)) * float(stats.sem(restricted))
            middle = float(restricted.mean())
            entry["restricted_mean_ci95_s"] = [_rounded(middle - half), _rounded(middle + half)]
        times, missed = survival(time_s, found)
        below = np.flatnonzero(missed <= 0.5)
        entry["median_s"] = _rounded(float(times[below[0]])) if len(below) else None
    if _BASELINE in _patterns(results):
        gap = paired_difference(_restricted(results, name), _restricted(results, _BASELINE))
        entry["minus_parallel_sweep_s"] = _rounded(gap.mean)
        entry["minus_parallel_sweep_ci95_s"] = [_rounded(value) for value in gap.ci95]
    if name not in PAPER:
        return entry
    paper_found, mean_s, sd_s = PAPER[name]
    low, high = rate_of(paper_found, _PAPER_RUNS).ci95
    entry["paper"] = {
        "found": paper_found,
        "runs": _PAPER_RUNS,
        "rate_ci95": [_rounded(low), _rounded(high)],
        "mean_s": mean_s,
        "sd_s": sd_s,
    }
    return entry


def _rounded(value: float) -> float | None:
    return round(value, 4) if math.isfinite(value) else None


def lines_of(results: Results) -> list[str]:
    """The table of the study."""
    lines = [
        f"{'pattern':<17} {'found':>9} {'rate, 95 %':>15} {'mean s':>8} {'restricted s':>13} {'median s':>9}"
        f" {'less sweep s':>20} {'paper':>6} {'mean s':>7}"
    ]
    for name, entry in summarise(results)["patterns"].items():
        low, high = entry["rate_ci95"]
        shown = "" if low is None else f"{low:.2f} to {high:.2f}"
        paper = entry["paper"]
        numbers = [entry["mean_s"], entry["restricted_mean_s"], entry["median_s"]]
        mean, restricted, median = ("" if value is None else f"{value:.0f}" for value in numbers)
        gap, (least, most) = entry["minus_parallel_sweep_s"], entry["minus_parallel_sweep_ci95_s"]
        sooner = "" if gap is None or name == _BASELINE else f"{gap:+.0f} ({least:+.0f} to {most:+.0f})"
        theirs = "" if paper is None else f"{paper['found']}/7"
        their_mean = "" if paper is None or paper["mean_s"] is None else f"{paper['mean_s']:.0f}"
        lines.append(
            f"{name:<17} {entry['found']:>4} / {entry['runs']:<3} {shown:>14} {mean:>8} {restricted:>13} "
            f"{median:>9} {sooner:>20} {theirs:>6} {their_mean:>7}"
        )
    return lines


def draw(results: Results, folder: Path) -> None:
    """Draw `search.png`: the share of searches that have found the tag, over time."""

    figure = blank_figure(7.2, 4.2)
    axes = figure.subplots()
    for name in _patterns(results):
        time_s, found = _searches(results, name)
        if not len(found):
            continue
        times, missed = survival(time_s, found)
        axes.step(
            np.concatenate(([0.0], times, [LIMIT_S])),
            1.0 - np.concatenate(([1.0], missed, missed[-1:])),
            where="post",
            label=name.replace("_", " "),
        )
    axes.set_xlim(0.0, LIMIT_S)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel("time of the search, s", fontsize=9)
    axes.set_ylabel("share of searches that have found the tag", fontsize=9)
    axes.grid(color="#e5e7eb", linewidth=0.8)
    axes.tick_params(labelsize=8)
    if axes.lines:
        axes.legend(fontsize=8, frameon=False)
    save_figure(figure, folder / "search.png")
