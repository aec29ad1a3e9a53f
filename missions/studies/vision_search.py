"""The study `vision-search`: one and two aircraft search for a tag and localize it, as flights on SITL.

Source: Tisdale et al. 2008.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.reports.figure import blank_figure, save_figure
from estimators.tracking.camera_likelihood import ground_spread
from estimators.tracking.camera_sight import CameraSight, DetectionRate, PoseErrors, SightModel
from flightsim.foundation.vectors import from_euler, product
from missions.studies.design import grid
from missions.studies.options import VisionStudyOptions
from missions.studies.results import Results
from missions.studies.statistics import figures_of, paired_difference, rate_of
from missions.studies.study import Study
from missions.studies.vision_search_trial import (
    BELIEFS,
    MOMENTS_S,
    TEAMS,
    Localized,
    VisionSearchCell,
    VisionSearchTrial,
)

__all__ = ["error_budget", "study"]

Array = NDArray[np.float64]

MAIN: Final = "fine"
"""The belief that the entries `one` and `two` are about."""

TABLE_II: Final[Mapping[str, tuple[float, float]]] = {
    "forward_m": (10.5, 10.5),
    "right_m": (5.5, 5.5),
    "height_m": (5.5, 1.77),
    "yaw_rad": (0.01, 0.29),
    "pitch_rad": (0.05, 4.65),
    "roll_rad": (0.02, 1.96),
}
"""Of the paper: standard deviation of each error, and of the target's place by it, m."""
_ROLL_RAD: Final = 0.26
_PITCH_RAD: Final = 0.17
_HEIGHT_M: Final = 90.0
_POSE: Final = (
    *("forward_m", "right_m", "height_m", "yaw_rad", "pitch_rad", "roll_rad"),
    *("place_time_s", "attitude_time_s"),
)
_COLOURS: Final = {"one": "#1769aa", "two": "#c2410c"}


def study(options: VisionStudyOptions | None = None) -> Study[VisionSearchCell, Localized]:
    """The study.

    Args:
        options: None: the defaults.
    """
    o = options or VisionStudyOptions()
    return Study(
        name="vision-search",
        description=(
            "One and two aircraft search for a tag with downward cameras and localize it: Tisdale et al. "
            "2008, with a fine grid, a coarse grid and particles over the same flights."
        ),
        trial=VisionSearchTrial(model=o.model, side_m=o.side_m, passes=o.passes),
        parameters=VisionSearchCell,
        row=Localized,
        design=grid(aircraft=tuple(TEAMS)),
        runs=50,
        success="completed",
        metrics=(),
        options=asdict(o),
        summarise=summarise,
        report=lines_of,
        draw=draw,
    )


def error_budget() -> dict[str, dict[str, float]]:
    """Table II by the code that the filter uses: the target is in the middle of the picture."""
    level = from_euler(_ROLL_RAD, _PITCH_RAD, 0.0)
    down = from_euler(0.0, -0.5 * math.pi, 0.0)
    model = SightModel(rate=DetectionRate(), target_size_m=1.0)
    budget = {}
    for name, (sigma, paper_m) in TABLE_II.items():
        errors = PoseErrors(**(dict.fromkeys(TABLE_II, 0.0) | {name: sigma}))
        place_m2, rotation_rad2 = errors.covariances(level, down)
        sight = CameraSight(
            place_ned_m=(0.0, 0.0, -_HEIGHT_M),
            q_ned_from_mount=product(level, down),
            place_m2=place_m2,
            rotation_rad2=rotation_rad2,
            width_px=640,
            height_px=480,
            focal_px=500.0,
        )
        found_m = math.sqrt(float(np.trace(ground_spread((0.0, 0.0), sight, model))))
        budget[name] = {"sigma": sigma, "localization_m": _rounded(found_m), "paper_m": paper_m}
    return budget


def _figure(results: Results, name: str) -> Array:
    """(cells, runs) of one of the rows' figures; NaN where a trial has none."""
    column = f"figures.{name}"
    if column not in results.table.column_names:
        return np.full((len(results.cells), results.runs), np.nan)
    return results.values(column)


def _rounded(value: float) -> Any:
    return round(float(value), 4) if math.isfinite(value) else None


def summarise(results: Results) -> Mapping[str, Any]:
    """Entries of `summary.json`: `one`, `two`, their difference, the pose errors, and Table II."""
    cells = {cell["aircraft"]: index for index, cell in enumerate(results.cells)}
    found: dict[str, Any] = {}
    for team, index in cells.items():
        beliefs = {belief: _belief(results, index, belief) for belief in BELIEFS}
        times = results.values("localized_s")[index]
        localized = results.values("localized")[index]
        known = localized[np.isfinite(localized)]
        found[team] = {
            **{name: beliefs[MAIN][name] for name in ("median_error_m", "inside_ellipse_rate", "runs")},
            "inside_ellipse_ci95": beliefs[MAIN]["inside_ellipse_ci95"],
            "localized": int(known.sum()),
            "localized_s_median": _rounded(figures_of(times).median),
            "beliefs": beliefs,
        }
    error = _figure(results, f"{MAIN}_error_m")
    difference = paired_difference(error[cells["two"]], error[cells["one"]])
    times = results.values("localized_s")
    sooner = paired_difference(times[cells["two"]], times[cells["one"]])
    found["two_minus_one"] = {
        "error_m": _rounded(difference.mean),
        "error_m_ci95": [_rounded(value) for value in difference.ci95],
        "localized_s": _rounded(sooner.mean),
        "localized_s_ci95": [_rounded(value) for value in sooner.ci95],
        **_narrower(results, cells),
    }
    found["pose_errors"] = {
        name: _rounded(figures_of(_figure(results, f"pose_{name}").ravel()).median) for name in _POSE
    }
    found["table_ii"] = error_budget()
    return found


def _narrower(results: Results, cells: Mapping[str, int]) -> dict[str, Any]:
    """By how much the belief of two is narrower than that of one, at the end and at times of the search."""
    found: dict[str, Any] = {}
    names = {"sigma_m": f"{MAIN}_sigma_m"}
    names |= {f"sigma_at_{moment_s}_s_m": f"{MAIN}_sigma_at_{moment_s}_m" for moment_s in MOMENTS_S}
    for name, figure in names.items():
        sigma = _figure(results, figure)
        gap = paired_difference(sigma[cells["two"]], sigma[cells["one"]])
        found[name] = _rounded(gap.mean)
        found[f"{name}_ci95"] = [_rounded(value) for value in gap.ci95]
    return found


def _belief(results: Results, index: int, belief: str) -> dict[str, Any]:
    error = figures_of(_figure(results, f"{belief}_error_m")[index])
    sigma = figures_of(_figure(results, f"{belief}_sigma_m")[index])
    inside = _figure(results, f"{belief}_inside")[index]
    inside = inside[np.isfinite(inside)]
    distance = figures_of(_figure(results, f"{belief}_distance_squared")[index])
    rate = rate_of(int(inside.sum()), len(inside))
    return {
        "median_error_m": _rounded(error.median),
        "median_error_m_ci95": [_rounded(value) for value in error.median_ci95],
        "q95_error_m": _rounded(error.q95),
        "median_sigma_m": _rounded(sigma.median),
        "inside_ellipse_rate": _rounded(rate.rate),
        "inside_ellipse_ci95": [_rounded(value) for value in rate.ci95],
        "nees_per_axis": _rounded(0.5 * distance.mean),
        "runs": rate.n,
    }


def lines_of(results: Results) -> list[str]:
    """The table of the study."""
    summary = summarise(results)
    lines = [f"{'aircraft':<9}{'belief':<11}{'runs':>5}{'median error':>14}{'sigma':>8}{'inside 95 %':>13}"]
    for team in TEAMS:
        for belief, row in summary[team]["beliefs"].items():
            if row["median_error_m"] is None:
                continue
            low, high = row["inside_ellipse_ci95"]
            lines.append(
                f"{team:<9}{belief:<11}{row['runs']:>5}{row['median_error_m']:>12.2f} m"
                f"{row['median_sigma_m']:>6.2f} m{row['inside_ellipse_rate']:>7.0%} ({low:.0%} to {high:.0%})"
            )
        if summary[team]["localized_s_median"] is not None:
            lines.append(
                f"{team:<9}localized in {summary[team]['localized']} runs, after "
                f"{summary[team]['localized_s_median']:.0f} s (median)"
            )
    gap = summary["two_minus_one"]
    if gap["error_m"] is not None and gap["error_m_ci95"][0] is not None:
        low, high = gap["error_m_ci95"]
        lines.append(f"two minus one ({MAIN}): error {gap['error_m']:+.2f} m ({low:+.2f} to {high:+.2f})")
        low, high = gap["localized_s_ci95"]
        lines.append(f"two minus one: localized {gap['localized_s']:+.0f} s ({low:+.0f} to {high:+.0f})")
        for moment_s in (None, *MOMENTS_S):
            name = "sigma_m" if moment_s is None else f"sigma_at_{moment_s}_s_m"
            if gap[name] is not None and gap[f"{name}_ci95"][0] is not None:
                low, high = gap[f"{name}_ci95"]
                when = "at the end" if moment_s is None else f"after {moment_s} s"
                lines.append(f"  sigma {when}: {gap[name]:+.2f} m ({low:+.2f} to {high:+.2f})")
    return lines


def draw(results: Results, folder: Path) -> None:
    """Draw `errors.png`: the errors of the three beliefs, and the consistency of the main one."""

    figure = blank_figure(10.0, 4.2)
    left, right = figure.subplots(1, 2)
    cells = {cell["aircraft"]: index for index, cell in enumerate(results.cells)}
    for team, index in cells.items():
        for belief, style in zip(BELIEFS, ("-", ":", "--"), strict=True):
            values = np.sort(_finite(_figure(results, f"{belief}_error_m")[index]))
            share = np.arange(1, len(values) + 1) / max(1, len(values))
            left.step(values, share, style, where="post", color=_COLOURS[team], label=f"{team}, {belief}")
        distances = np.sort(_finite(_figure(results, f"{MAIN}_distance_squared")[index]))
        share = np.arange(1, len(distances) + 1) / max(1, len(distances))
        right.step(distances, share, where="post", color=_COLOURS[team], label=f"{team}, {MAIN}")
    expected = np.linspace(0.0, 12.0, 200)
    right.plot(expected, 1.0 - np.exp(-0.5 * expected), color="#6b7280", linewidth=0.9, label="honest")
    left.set_xlabel("final error, m", fontsize=9)
    left.set_ylabel("share of the runs", fontsize=9)
    right.set_xlabel("squared Mahalanobis distance of the true place", fontsize=9)
    for axes in (left, right):
        axes.set_xlim(left=0.0)
        axes.set_ylim(0.0, 1.0)
        axes.grid(color="#e5e7eb", linewidth=0.8)
        axes.tick_params(labelsize=8)
        axes.legend(fontsize=8, frameon=False, loc="lower right")
    right.set_xlim(0.0, 12.0)
    save_figure(figure, folder / "errors.png")


def _finite(values: Array) -> Array:
    return values[np.isfinite(values)]
