"""The Monte Carlo study `multi-target`: both experiments of Yousuf, Lendek and Busoniu, in the paper's world
and in worlds that the filter does not expect.

Every run has its own targets, and in the second experiment its own terrain and numbers, so that intervals
over runs are intervals over terrains.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from estimators.multi_target.parameters import Belief
from estimators.reports.figure import blank_figure, save_figure
from missions.studies.calibration import rounded, verdicts_of
from missions.studies.design import grid
from missions.studies.multi_target_trial import EXPERIMENTS, Found, MultiTargetCell, SearchTrial
from missions.studies.multi_target_worlds import WORLDS, SearchWorlds
from missions.studies.options import Experiments, MultiTargetStudyOptions, Planners
from missions.studies.results import Results
from missions.studies.statistics import Difference, figures_of, mean_interval, paired_difference, rate_of
from missions.studies.study import Study
from missions.studies.worlds import chosen_worlds, described

__all__ = ["study"]

Array = NDArray[np.float64]

_FIRST: Final = 0.1  # share of the time in which the planners are not compared
_COLOURS: Final[Mapping[str, str]] = {
    Planners.PROPOSED: "#15803d",
    Planners.PAPER: "#7c3aed",
    Planners.LAWNMOWER: "#c2410c",
    Planners.INFORMATION: "#1769aa",
    Planners.REVISIT: "#b45309",
    Planners.ERGODIC: "#be185d",
}


def study(options: MultiTargetStudyOptions | None = None) -> Study[MultiTargetCell, Found]:
    """The study.

    Args:
        options: None: the defaults.
    """
    o = options or MultiTargetStudyOptions()
    worlds = [SearchWorlds(name).value for name in chosen_worlds(o.world, WORLDS)]
    return Study(
        name="multi-target",
        description=(
            "An unknown number of targets: the experiments of Yousuf, Lendek and Busoniu with the proposed "
            "planner, the paper's, and baselines."
        ),
        trial=SearchTrial(planning=o.planning, points=o.points),
        parameters=MultiTargetCell,
        row=Found,
        design=grid(experiment=[e.value for e in Experiments if e in o.experiment], world=worlds)
        * grid(belief=[belief.value for belief in Belief if belief in o.belief])
        * grid(planner=[planner.value for planner in Planners if planner in o.planner]),
        runs=50,
        success="completed",
        metrics=("area", "gospa_m", "cardinality_error", "false"),
        options={
            "horizon": o.planning.horizon,
            "alpha": o.planning.alpha,
            "exploration": o.planning.exploration.value,
            "points": o.points,
        },
        summarise=summarise,
        report=lines_of,
        draw=draw,
    )


def _cells(results: Results, **chosen: str) -> dict[str, int]:
    """Indices of the cells with these parameters, by their planner."""
    return {
        str(cell["planner"]): index
        for index, cell in enumerate(results.cells)
        if all(cell[name] == value for name, value in chosen.items())
    }


def _values(results: Results, name: str) -> list[str]:
    """The values of a parameter, each once, in the order of the cells."""
    return list(dict.fromkeys(str(cell[name]) for cell in results.cells))


def summarise(results: Results) -> Mapping[str, Any]:
    """Entries of `summary.json`: `experiments`, in the first world with the first filter, and `worlds`."""
    world, belief = _values(results, "world")[0], _values(results, "belief")[0]
    return {
        "experiments": {
            name: _experiment(results, name, _cells(results, experiment=name, world=world, belief=belief))
            for name in _values(results, "experiment")
        },
        "worlds": {
            name: {**described(WORLDS[name]), **_world(results, name)} for name in _values(results, "world")
        },
    }


def _experiment(results: Results, name: str, cells: Mapping[str, int]) -> dict[str, Any]:
    experiment = EXPERIMENTS[name]
    time_s = experiment.time_s
    curves = results.values("found_over_time", len(time_s))
    areas, complete = results.values("area"), results.values("all_found")
    gospa_m = results.values("gospa_m")
    later = time_s >= _FIRST * time_s[-1]
    planners, means = {}, {}
    for planner, cell in cells.items():
        mean, low, high = _interval(curves[cell])
        means[planner] = mean
        known = complete[cell][np.isfinite(complete[cell])]
        rate = rate_of(int(known.sum()), len(known))
        area, apart = figures_of(areas[cell]), figures_of(gospa_m[cell])
        planners[planner] = {
            "found_mean": _listed(mean),
            "found_ci95": [list(pair) for pair in zip(_listed(low), _listed(high), strict=True)],
            "area_mean": rounded(area.mean),
            "area_ci95": [rounded(value) for value in area.mean_ci95],
            "gospa_m": rounded(apart.mean),
            "gospa_ci95": [rounded(value) for value in apart.mean_ci95],
            "all_found": rate.count,
            "all_found_ci95": [rounded(value) for value in rate.ci95],
            "runs": rate.n,
        }
    found: dict[str, Any] = {
        "targets": experiment.targets,
        "time_s": _listed(time_s),
        "planners": planners,
        "proposed_minus": {},
    }
    own = cells.get(Planners.PROPOSED)
    for planner, cell in cells.items():
        if own is None or cell == own:
            continue
        gap = means[Planners.PROPOSED] - means[planner]
        worst = int(np.argmin(np.where(later, gap, np.inf)))
        compared = bool(np.isfinite(gap[worst]))
        gained = paired_difference(areas[own], areas[cell])
        found["proposed_minus"][planner] = {
            "area_difference": rounded(gained.mean),
            "area_difference_ci95": [rounded(value) for value in gained.ci95],
            "conclusive": bool(gained.conclusive),
            **_of_gospa(paired_difference(gospa_m[own], gospa_m[cell])),
            "least_found_difference": rounded(gap[worst]),
            "least_found_difference_s": rounded(time_s[worst]) if compared else None,
            "never_fewer": bool(gap[worst] >= 0.0),
        }
    if experiment.counts is not None:
        found["terrains"] = _terrains(results, cells)
    return found


def _of_gospa(difference: Difference) -> dict[str, Any]:
    return {
        "gospa_difference_m": rounded(difference.mean),
        "gospa_difference_ci95": [rounded(value) for value in difference.ci95],
    }


def _terrains(results: Results, cells: Mapping[str, int]) -> list[dict[str, Any]]:
    """Each terrain: its run, true targets, and the area under the curve of each planner. The intervals of the
    experiment are over these.
    """
    targets, areas = results.values("targets"), results.values("area")
    rows = []
    for run, seed in enumerate(results.seed_of_run.tolist()):
        known = [targets[cell, run] for cell in cells.values() if np.isfinite(targets[cell, run])]
        if known:
            row: dict[str, Any] = {"terrain": run, "seed": seed, "targets": int(known[0])}
            rows.append(row | {planner: rounded(areas[cell, run]) for planner, cell in cells.items()})
    return rows


def _world(results: Results, world: str) -> dict[str, Any]:
    """What the proposed planner, or the first one, found in a world, with the first filter; `filters` has the
    others too.
    """
    planner = Planners.PROPOSED.value
    if planner not in _values(results, "planner"):
        planner = _values(results, "planner")[0]
    filters = {
        belief: _verdicts(
            results,
            [
                index
                for index, cell in enumerate(results.cells)
                if (cell["world"], cell["belief"], cell["planner"]) == (world, belief, planner)
            ],
        )
        for belief in _values(results, "belief")
    }
    return {"planner": planner, **next(iter(filters.values())), "filters": filters}


def _verdicts(results: Results, cells: Sequence[int]) -> dict[str, Any]:
    """Targets found right, places found where no target is, and true targets that were not found; with the
    calibration of all that is reported. The terrain, with the experiment, is the cluster of the intervals.
    """
    found, false, true = (results.values(name)[cells] for name in ("found", "false", "targets"))
    known = np.isfinite(true)
    names = np.arange(true.size).reshape(true.shape)[known]
    right, wrong = found[known].astype(np.int64), false[known].astype(np.int64)
    left = true[known].astype(np.int64) - right
    kinds = np.concatenate(
        [np.full(int(count.sum()), kind) for kind, count in enumerate((right, wrong, left))]
    )
    clusters = np.concatenate([np.repeat(names, count) for count in (right, wrong, left)])
    rows = {name: results.values(name)[cells][known] for name in ("stated", "right", "inside")}
    stated = rows["stated"].ravel()
    reported = np.isfinite(stated)
    of = np.repeat(names, rows["stated"].shape[-1])[reported]
    verdicts = verdicts_of(kinds == 0, kinds == 1, np.full(len(kinds), np.nan), clusters=clusters)
    calibration = verdicts_of(
        rows["right"].ravel()[reported] > 0.5,
        rows["right"].ravel()[reported] < 0.5,
        stated[reported],
        clusters=of,
    )
    gospa, error = results.values("gospa_m")[cells][known], results.values("cardinality_error")[cells][known]
    return {
        **verdicts,
        "runs": len(right),
        "calibration": calibration["calibration"],
        "calibration_gap": calibration["calibration_gap"],
        "inside_95": rounded(float(np.nanmean(rows["inside"])))
        if np.isfinite(rows["inside"]).any()
        else None,
        **{
            f"{name}{part}": value
            for name, values in (("gospa_m", gospa), ("cardinality_error", error))
            for part, value in (
                ("", rounded(float(values.mean())) if len(values) else None),
                ("_ci95", [rounded(value) for value in mean_interval(values)]),
            )
        },
        **{
            name: rounded(float(results.values(name)[cells][known].mean())) if known.any() else None
            for name in ("gospa_missed", "gospa_false")
        },
        "false_per_run": rounded(float(wrong.mean())) if len(wrong) else None,
    }


def _interval(curves: Array) -> tuple[Array, Array, Array]:
    """Mean over the runs and its 95 % interval (Student) at each time; NaN with fewer than two runs."""
    known = curves[np.isfinite(curves).all(axis=-1)]
    count = len(known)
    if not count:
        nothing = np.full(curves.shape[-1], np.nan)
        return nothing, nothing, nothing
    mean: Array = known.mean(axis=0)
    if count < 2:
        return mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    half = stats.t.ppf(0.975, count - 1) * known.std(axis=0, ddof=1) / np.sqrt(count)
    return mean, mean - half, mean + half


def _listed(values: Array) -> list[float | None]:
    return [rounded(value) for value in values.tolist()]


def _shown(value: float | None, interval: Sequence[float | None] = (), form: str = ".2f") -> str:
    if value is None:
        return "-"
    low, high = (*interval, None, None)[:2]
    return (
        f"{value:{form}}" if low is None or high is None else f"{value:{form}} [{low:{form}}, {high:{form}}]"
    )


def lines_of(results: Results) -> list[str]:
    """The table of the study: worlds first, if there is more than the nominal one, then the planners."""
    summary = summarise(results)
    lines = _lines_of_worlds(summary["worlds"]) if len(results.cells) > 1 else []
    for name, found in summary["experiments"].items():
        terrains = f", {len(found['terrains'])} terrains" if "terrains" in found else ""
        lines.append(f"{name}: {found['time_s'][-1]:.0f} s{terrains}; mean over runs [95 %]")
        lines.append(
            f"  {'planner':<12} {'runs':>5} {'area':>22} {'end':>7} {'all found':>10} {'GOSPA, m':>20}"
        )
        for planner, row in found["planners"].items():
            lines.append(
                f"  {planner:<12} {row['runs']:>5} {_shown(row['area_mean'], row['area_ci95'], '.3f'):>22} "
                f"{_shown(row['found_mean'][-1]):>7} {row['all_found']:>10} "
                f"{_shown(row['gospa_m'], row['gospa_ci95']):>20}"
            )
        for planner, row in found["proposed_minus"].items():
            if row["area_difference"] is None:
                continue
            difference = _shown(row["area_difference"], row["area_difference_ci95"], "+.3f")
            lines.append(
                f"  proposed minus {planner}: area {difference}, "
                f"least difference after a tenth {row['least_found_difference']:+.2f} targets"
            )
    return lines


def _lines_of_worlds(worlds: Mapping[str, Any]) -> list[str]:
    titles = (
        f"{'right [95 %]':>22} {'not found':>10} {'false':>6} {'GOSPA, m [95 %]':>20} {'cardinality':>22}"
    )
    lines = [f"{'world':<17} {'filter':<11} {'targets':>8} {titles} {'calibration':>12} {'in 95 %':>8}"]
    for world, found in worlds.items():
        for belief, row in found["filters"].items():
            true = row["right"] + row["undecided"]
            gap = "-" if row["calibration_gap"] is None else f"{row['calibration_gap']:.3f}"
            share = row["right"] / row["n"] if row["n"] else None
            lines.append(
                f"{world:<17} {belief:<11} {true:>8} {_shown(share, row['interval'], '.3f'):>22} "
                f"{row['undecided']:>10} {row['wrong']:>6} {_shown(row['gospa_m'], row['gospa_m_ci95']):>20} "
                f"{_shown(row['cardinality_error'], row['cardinality_error_ci95'], '+.2f'):>22} {gap:>12} "
                f"{_shown(row['inside_95']):>8}"
            )
    return [
        *lines,
        "right: share of the true and the false targets; calibration: largest gap between stated and "
        "achieved probability; in 95 %: share of errors inside the stated ellipse",
        "",
    ]


def draw(results: Results, folder: Path) -> None:
    """Draw `found.png`: found targets over time, in the first world and with the first filter."""
    figure = blank_figure(10.0, 4.2)
    world, belief = _values(results, "world")[0], _values(results, "belief")[0]
    names = _values(results, "experiment")
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        experiment = EXPERIMENTS[name]
        curves = results.values("found_over_time", len(experiment.time_s))
        for planner, cell in _cells(results, experiment=name, world=world, belief=belief).items():
            mean, low, high = _interval(curves[cell])
            axes.plot(experiment.time_s, mean, color=_COLOURS[planner], label=planner)
            axes.fill_between(experiment.time_s, low, high, color=_COLOURS[planner], alpha=0.15, linewidth=0)
        axes.axhline(experiment.targets, color="#6b7280", linewidth=0.8)
        axes.set_title(f"{name}: {experiment.targets} targets on average", fontsize=10, loc="left")
        axes.set_xlabel("time of the search, s", fontsize=9)
        axes.set_ylabel("found targets, mean and 95 % interval", fontsize=9)
        axes.set_xlim(0.0, experiment.time_s[-1])
        axes.set_ylim(bottom=0.0)
        axes.grid(color="#e5e7eb", linewidth=0.8)
        axes.tick_params(labelsize=8)
        axes.legend(fontsize=8, frameon=False)
    save_figure(figure, folder / "found.png")
