"""The pictures of a survey: lines, differential measurement and map; the manoeuvres of a compensation."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import broken_at_gaps
from estimators.reports.figure import INK, blank_figure, save_figure
from estimators.survey.lines import LineKind
from estimators.survey.processing import SurveyResult
from missions.survey.records import Calibration

__all__ = ["draw_calibration", "draw_survey"]

Array = NDArray[np.float64]

_GRID: Final = "#e5e7eb"
_LINE: Final = "#1769aa"
_TIE: Final = "#c2410c"
_TARGET: Final = "#dc2626"
_KILOMETRE: Final = 1e-3
_MOST_NAMES: Final = 14  # of lines beside the map
_NAME_PT: Final = 8.0  # distance of a line's name from its end
_LIMITS: Final = (2.0, 98.0)  # percentiles of the colours


def draw_survey(
    path: Path, title: str, result: SurveyResult, targets_ne_m: Sequence[tuple[float, float]] = ()
) -> None:
    """Draw the lines coloured by the differential measurement, the map, and the profiles.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        result: the processed survey.
        targets_ne_m: true places of targets, where they are known.
    """
    figure = blank_figure(12.0, 11.0)
    figure.suptitle(title, fontsize=12, fontweight="bold", color=INK)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 0.75))
    _draw_lines(figure, figure.add_subplot(grid[0, 0]), result, targets_ne_m)
    _draw_map(figure, figure.add_subplot(grid[0, 1]), result)
    _draw_profiles(figure.add_subplot(grid[1, :]), result)
    save_figure(figure, path)


def _draw_lines(
    figure: Any, axes: Any, result: SurveyResult, targets_ne_m: Sequence[tuple[float, float]]
) -> None:
    r, on = result.readings, result.on_lines
    _, track_east_m, track_north_m = broken_at_gaps(r.time_s, r.east_m, r.north_m)
    axes.plot(track_east_m * _KILOMETRE, track_north_m * _KILOMETRE, color="#cbd5e1", linewidth=0.6, zorder=1)
    values = result.differential_nt[on]
    size = max(1.0, float(np.percentile(np.abs(values), 99.0))) if len(values) else 1.0
    shades = axes.scatter(
        r.east_m[on] * _KILOMETRE, r.north_m[on] * _KILOMETRE, c=values, s=4.0, cmap="RdBu_r",
        vmin=-size, vmax=size, zorder=2, linewidths=0.0,
    )  # fmt: skip
    what = "reading - map" if result.against_map else "reading - main field"
    figure.colorbar(shades, ax=axes, shrink=0.8, label=f"{what}, nT", extend=_beyond(values, -size, size))
    step = math.ceil(len(result.plan.lines) / _MOST_NAMES)
    for line in result.plan.lines:
        if line.kind is LineKind.LINE and _number(line.name) % step:
            continue
        # survey lines have their names at one end, tie lines at the other, both outside of the area
        kind, way_rad = line.kind, line.course_rad
        end, away = (
            (line.end_ne_m, 1.0) if _backwards(way_rad) is (kind is LineKind.TIE) else (line.start_ne_m, -1.0)
        )
        axes.annotate(
            line.name, (end[1] * _KILOMETRE, end[0] * _KILOMETRE), fontsize=6, ha="center", va="center",
            xytext=(_NAME_PT * away * math.sin(way_rad), _NAME_PT * away * math.cos(way_rad)),
            textcoords="offset points", color=_LINE if kind is LineKind.LINE else _TIE,
        )  # fmt: skip
    for k, (north_m, east_m) in enumerate(targets_ne_m):
        axes.plot(
            east_m * _KILOMETRE, north_m * _KILOMETRE, "+", color=_TARGET, markersize=12, zorder=4,
            label="target (truth)" if not k else None,
        )  # fmt: skip
    for k, anomaly in enumerate(result.anomalies):
        axes.plot(
            anomaly.east_m * _KILOMETRE, anomaly.north_m * _KILOMETRE, "o", markerfacecolor="none",
            markeredgecolor=INK, markersize=12, zorder=3, label="anomaly" if not k else None,
        )  # fmt: skip
    if targets_ne_m or result.anomalies:
        axes.legend(loc="upper right", fontsize=8)
    _map_axes(axes, "lines, coloured by the differential measurement")


def _draw_map(figure: Any, axes: Any, result: SurveyResult) -> None:
    grid = result.grid
    if grid is None:
        axes.text(0.5, 0.5, f"no map: {result.no_grid}", ha="center", wrap=True, transform=axes.transAxes,
                  color=INK)  # fmt: skip
        axes.set_axis_off()
        return
    low, high = np.nanpercentile(grid.values_nt, _LIMITS)
    shades = axes.pcolormesh(
        grid.east_m * _KILOMETRE, grid.north_m * _KILOMETRE, grid.values_nt, cmap="turbo", vmin=low,
        vmax=high, shading="nearest", rasterized=True,
    )  # fmt: skip
    extend = _beyond(grid.values_nt, low, high)
    figure.colorbar(shades, ax=axes, shrink=0.8, label="total field, nT", extend=extend)
    _map_axes(axes, "map from the flight")


def _draw_profiles(axes: Any, result: SurveyResult) -> None:
    """The differential measurement along each line, one above the other, in the order of place."""
    order = sorted(
        range(len(result.plan.lines)),
        key=lambda k: (result.plan.lines[k].kind, _number(result.plan.lines[k].name)),
    )
    spread = [
        float(np.ptp(result.differential_nt[result.line_of == k]))
        for k in order
        if np.any(result.line_of == k)
    ]
    step = max(2.0, float(np.percentile(spread, 60.0)) if spread else 2.0)
    for row, k in enumerate(order):
        line, own = result.plan.lines[k], result.line_of == k
        along, _ = line.along_across_m(result.readings.north_m[own], result.readings.east_m[own])
        if _backwards(line.course_rad):  # all profiles in the same direction
            along = line.length_m - along
        colour = _LINE if line.kind is LineKind.LINE else _TIE
        _, along, values = broken_at_gaps(result.readings.time_s[own], along, result.differential_nt[own])
        axes.plot(along * _KILOMETRE, values - row * step, color=colour, linewidth=0.6)
        axes.text(-0.01, -row * step, line.name, fontsize=7, color=colour, ha="right", va="center",
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_yticks([])
    axes.set_xlabel("along the line, km", fontsize=9, color=INK)
    axes.set_title(
        f"differential measurement; profiles are drawn {step:.1f} nT apart", fontsize=10, color=INK
    )
    axes.grid(True, axis="x", color=_GRID, linewidth=0.6)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)


def _beyond(values: Array, low: float, high: float) -> str:
    """The ends of a colour scale beyond which there are values, as matplotlib names them."""
    below, above = bool(np.any(values < low)), bool(np.any(values > high))
    return {(True, True): "both", (True, False): "min", (False, True): "max"}.get((below, above), "neither")


def _map_axes(axes: Any, title: str) -> None:
    axes.set_aspect("equal")
    axes.set_title(title, fontsize=10, color=INK)
    axes.set_xlabel("east, km", fontsize=9, color=INK)
    axes.set_ylabel("north, km", fontsize=9, color=INK)
    axes.tick_params(labelsize=8, colors=INK)


def _number(name: str) -> int:
    digits = name.lstrip("LT")
    return int(digits) if digits.isdecimal() else 0


def _backwards(course_rad: float) -> bool:
    return bool(
        np.cos(course_rad) + 1e-6 * np.sin(course_rad) < -1e-6
        or (abs(np.cos(course_rad)) <= 1e-6 and np.sin(course_rad) < 0.0)
    )


def draw_calibration(path: Path, title: str, made: Calibration) -> None:
    """Draw the readings of the twelve manoeuvres of the second box, before and after compensation."""
    figure = blank_figure(12.0, 8.0)
    figure.suptitle(
        f"{title}\nfigure of merit {made.figure_of_merit_before_nt:.1f} nT before, "
        f"{made.figure_of_merit_nt:.2f} nT after; improvement ratio {made.improvement:.1f}",
        fontsize=11, fontweight="bold", color=INK,
    )  # fmt: skip
    axes = figure.subplots(4, 3, sharey=True)
    for axis, label in zip(axes.ravel(), made.before_nt, strict=True):
        for values, colour, name in (
            (made.before_nt[label], "#94a3b8", "before"),
            (made.after_nt[label], _LINE, "after"),
        ):
            axis.plot(0.1 * np.arange(len(values)), values - np.median(values), color=colour, label=name,
                      linewidth=1.0)  # fmt: skip
        axis.set_title(label.partition(" heading ")[2], fontsize=9, color=INK)
        axis.tick_params(labelsize=7, colors=INK)
        axis.grid(True, color=_GRID, linewidth=0.6)
    axes[0, 0].legend(fontsize=8)
    figure.supxlabel("time, s", fontsize=9, color=INK)
    figure.supylabel("reading less main field and level, nT", fontsize=9, color=INK)
    save_figure(figure, path)
