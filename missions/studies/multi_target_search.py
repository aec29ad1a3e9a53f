"""The Monte Carlo study `multi-target`: both experiments of Yousuf, Lendek and Busoniu, as flights on
SITL.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from missions.multi_target.options import MultiTargetOptions
from missions.search.planner_parameters import PlannerParameters
from missions.studies.design import grid
from missions.studies.multi_target_trial import EXPERIMENTS, MAPS, PLANNERS, Cell, Found, SearchTrial
from missions.studies.results import Results
from missions.studies.statistics import paired_difference, rate_of
from missions.studies.study import Study

__all__ = ["study"]

Array = NDArray[np.float64]

PROPOSED: Final = "proposed"
_FIRST: Final = 0.1  # share of the time in which the planners are not compared
_COLOURS: Final = {"proposed": "#15803d", "lawnmower": "#c2410c", "information": "#1769aa"}


def study(planning: PlannerParameters | None = None) -> Study[Cell, Found]:
    """The study.

    Args:
        planning: of the exploring planner; None: that of the mission.
    """
    planning = planning or MultiTargetOptions().planning
    return Study(
        name="multi-target",
        description=(
            "An unknown number of targets: the experiments of Yousuf, Lendek and Busoniu with the proposed "
            "planner, a lawnmower, and information alone."
        ),
        trial=SearchTrial(planning=planning),
        parameters=Cell,
        row=Found,
        design=grid(experiment=tuple(EXPERIMENTS)) * grid(planner=tuple(PLANNERS)),
        runs=50,
        success="completed",
        metrics=(),
        options={
            "horizon": planning.horizon,
            "alpha": planning.alpha,
            "exploration": planning.exploration.value,
        },
        summarise=summarise,
        report=lines_of,
        draw=draw,
    )


def _rows(results: Results, experiment: str, planner: str) -> int:
    """Index of a cell."""
    return next(
        index
        for index, cell in enumerate(results.cells)
        if (cell["experiment"], cell["planner"]) == (experiment, planner)
    )


def summarise(results: Results) -> Mapping[str, Any]:
    """Entries of `summary.json`: found targets over time, areas under the curves, and their differences."""
    return {"experiments": {name: _experiment(results, name) for name in EXPERIMENTS}}


def _experiment(results: Results, name: str) -> dict[str, Any]:
    experiment = EXPERIMENTS[name]
    time_s = experiment.time_s
    curves = results.values("found_over_time", len(time_s))
    areas, complete = results.values("area"), results.values("all_found")
    cells = {planner: _rows(results, name, planner) for planner in PLANNERS}
    own = cells[PROPOSED]
    later = time_s >= _FIRST * time_s[-1]
    planners, means = {}, {}
    for planner, cell in cells.items():
        mean, low, high = _interval(curves[cell])
        means[planner] = mean
        known = complete[cell][np.isfinite(complete[cell])]
        rate = rate_of(int(known.sum()), len(known))
        planners[planner] = {
            "found_mean": _listed(mean),
            "found_ci95": [list(pair) for pair in zip(_listed(low), _listed(high), strict=True)],
            "area_mean": _rounded(np.nanmean(areas[cell])) if np.isfinite(areas[cell]).any() else None,
            "all_found": rate.count,
            "all_found_ci95": [_rounded(value) for value in rate.ci95],
            "runs": rate.n,
        }
    against = {}
    for planner, cell in cells.items():
        if planner == PROPOSED:
            continue
        area = paired_difference(areas[own], areas[cell])
        gap = means[PROPOSED] - means[planner]
        worst = int(np.argmin(np.where(later, gap, np.inf)))
        compared = bool(np.isfinite(gap[worst]))
        against[planner] = {
            "area_difference": _rounded(area.mean),
            "area_difference_ci95": [_rounded(value) for value in area.ci95],
            "conclusive": bool(area.conclusive),
            "least_found_difference": _rounded(gap[worst]),
            "least_found_difference_s": _rounded(time_s[worst]) if compared else None,
            "never_fewer": bool(gap[worst] >= 0.0),
        }
    found = {
        "targets": experiment.targets,
        "time_s": _listed(time_s),
        "planners": planners,
        "proposed_minus": against,
    }
    if name == "E2":
        found["maps"] = _maps(results, cells)
    return found


def _maps(results: Results, cells: Mapping[str, int]) -> list[dict[str, Any]]:
    """Mean number of found targets at the end, by terrain."""
    found, terrain = results.values("found"), results.values("terrain")
    rows = []
    for number in range(MAPS):
        row: dict[str, Any] = {"terrain": number}
        for planner, cell in cells.items():
            values = found[cell][terrain[cell] == number]
            row[planner] = _rounded(np.mean(values)) if len(values) else None
        rows.append(row)
    return rows


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
    return [_rounded(value) for value in values.tolist()]


def _rounded(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None


def lines_of(results: Results) -> list[str]:
    """The table of the study."""
    lines = []
    for name, found in summarise(results)["experiments"].items():
        lines.append(f"{name}: {found['targets']} targets, {found['time_s'][-1]:.0f} s")
        lines.append(f"  {'planner':<12} {'runs':>5} {'area':>8} {'end':>7} {'all found':>10}")
        for planner, row in found["planners"].items():
            end, area = row["found_mean"][-1], row["area_mean"]
            shown = f"{'' if area is None else f'{area:.3f}':>8} {'' if end is None else f'{end:.2f}':>7}"
            lines.append(f"  {planner:<12} {row['runs']:>5} {shown} {row['all_found']:>10}")
        for planner, row in found["proposed_minus"].items():
            low, high = row["area_difference_ci95"]
            if row["area_difference"] is None:
                continue
            interval = "" if low is None else f" ({low:+.3f} to {high:+.3f})"
            lines.append(
                f"  proposed minus {planner}: area {row['area_difference']:+.3f}{interval}, "
                f"least difference after a tenth {row['least_found_difference']:+.2f} targets"
            )
    return lines


def draw(results: Results, folder: Path) -> None:
    """Draw `found.png`: found targets over time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.2), dpi=120, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    for axes, (name, experiment) in zip(figure.subplots(1, 2), EXPERIMENTS.items(), strict=True):
        curves = results.values("found_over_time", len(experiment.time_s))
        for planner, colour in _COLOURS.items():
            mean, low, high = _interval(curves[_rows(results, name, planner)])
            axes.plot(experiment.time_s, mean, color=colour, label=planner)
            axes.fill_between(experiment.time_s, low, high, color=colour, alpha=0.15, linewidth=0)
        axes.axhline(experiment.targets, color="#6b7280", linewidth=0.8)
        axes.set_title(f"{name}: {experiment.targets} targets", fontsize=10, loc="left")
        axes.set_xlabel("time of the search, s", fontsize=9)
        axes.set_ylabel("found targets, mean and 95 % interval", fontsize=9)
        axes.set_xlim(0.0, experiment.time_s[-1])
        axes.set_ylim(bottom=0.0)
        axes.grid(color="#e5e7eb", linewidth=0.8)
        axes.tick_params(labelsize=8)
        axes.legend(fontsize=8, frameon=False)
    with (folder / "found.png").open("xb") as file:
        figure.savefig(file, format="png", metadata={"Software": None})
