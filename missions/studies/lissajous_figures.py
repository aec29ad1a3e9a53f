"""The paper's figures 6 and 7: the drones' paths, and each estimator's target position, in one run."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from estimators.reports.figure import INK, blank_figure, save_figure, tidy
from missions.studies.lissajous_setting import DT, SAMPLE_CELL, START, STEPS
from missions.studies.lissajous_trial import SampleRun

_TARGET: Final = "#7c3aed"
_TRUTH: Final = "#111827"
_DRONES: Final = ("#111827", "#94a3b8")
_STYLES: Final[dict[str, dict[str, Any]]] = {
    "N": {"color": "#94a3b8", "linewidth": 0.9},
    "K": {"color": "#ea580c", "linewidth": 0.9, "alpha": 0.7},
    "P": {"color": "#1769aa", "linewidth": 1.4},
    "F": {"color": "#15803d", "linewidth": 1.4},
}
_NAMES: Final = {
    "N": "N, unfiltered",
    "K": "K, Kalman filter",
    "P": "P, proposed",
    "F": "F, frequencies as states",
}
_UNIT: Final = "(no unit, as in the paper)"
_ZOOM: Final = 12.0
"""Half the side of the window in figure 7."""


def draw_paths(path: Path, run: SampleRun) -> None:
    """Figure 6: the paths of both drones and the target, and the estimates of the first drone's position."""
    figure = _figure("The paper's figure 6: drone paths", (10.5, 7.6))
    axes = figure.add_subplot()
    for drone in range(run.drones.shape[1]):
        x, y = run.drones[:, drone, 0], run.drones[:, drone, 2]
        axes.plot(x, y, color=_DRONES[drone], linewidth=1.3, label=f"drone {drone + 1}, true")
        axes.plot(START[drone, 0], START[drone, 2], "o", color=_DRONES[drone], markersize=8)
    for index, column in enumerate(run.block.columns):
        if column.name in ("K", "P"):
            axes.plot(
                run.first_drone[:, index, 0],
                run.first_drone[:, index, 1],
                **_STYLES[column.name],
                linestyle="--",
                label=f"drone 1 by {_NAMES[column.name]}",
            )
    axes.plot(run.target[:, 0], run.target[:, 1], color=_TARGET, linewidth=1.3, label="target, true")
    axes.plot([], [], "o", color=_TRUTH, markersize=8, label="start")
    axes.set_aspect("equal")
    _finish(axes, f"x {_UNIT}", "y")
    axes.legend(fontsize=9, loc="upper left", frameon=False)
    save_figure(figure, path)


def draw_target(path: Path, run: SampleRun) -> None:
    """Figure 7: each estimator's target position, an enlarged part of it, and the error of each."""
    figure = _figure("The paper's figure 7: the target by each estimator", (11.5, 8.6))
    grid = figure.add_gridspec(2, 2, height_ratios=(3.0, 1.3))
    place, near = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    error = figure.add_subplot(grid[1, :])
    times = DT * np.arange(1, STEPS + 1)
    for index, column in enumerate(run.block.columns):
        seen = run.estimates[:, index]
        label = f"{_NAMES[column.name]}: mean error {run.errors[index]:.2f}"
        behind = 1 if column.name == "K" else 2 + index
        for axes in (place, near):
            axes.plot(seen[:, 0], seen[:, 1], **_STYLES[column.name], zorder=behind, label=label)
        off = np.sqrt(0.5 * np.sum((seen - run.target) ** 2, axis=1))
        error.semilogy(times, off, **_STYLES[column.name], zorder=behind)
    for axes in (place, near):
        axes.plot(
            run.target[:, 0],
            run.target[:, 1],
            color=_TRUTH,
            linewidth=1.2,
            linestyle=":",
            label="target, true",
            zorder=9,
        )
        axes.set_aspect("equal")
    centre, reach = run.target.mean(axis=0), 0.7 * np.ptp(run.target, axis=0)
    _window(place, centre, reach)
    _window(near, run.target[STEPS // 8], np.array([_ZOOM, _ZOOM]))
    _finish(place, f"x {_UNIT}", "y")
    _finish(near, "x, from near", "")
    _finish(error, "time (no unit)", "error, $\\sqrt{(e_x^2 + e_y^2)/2}$")
    figure.legend(
        *place.get_legend_handles_labels(), fontsize=9, loc="outside lower center", ncols=3, frameon=False
    )
    save_figure(figure, path)


def _figure(title: str, size_in: tuple[float, float]) -> Any:
    figure = blank_figure(*size_in, dpi=130)
    epsilon, delta = SAMPLE_CELL
    figure.suptitle(
        f"{title}, one run with $\\delta$ = {delta:g}, $\\epsilon$ = {epsilon:g}\n",
        fontsize=13,
        fontweight="bold",
        color=INK,
    )
    figure.text(
        0.5,
        0.955,
        "after Steckenrider, Leamy and Furukawa 2020, by the corrected equations",
        ha="center",
        fontsize=9,
        color=INK,
    )
    return figure


def _window(axes: Any, centre: Any, reach: Any) -> None:
    axes.set_xlim(centre[0] - reach[0], centre[0] + reach[0])
    axes.set_ylim(centre[1] - reach[1], centre[1] + reach[1])


def _finish(axes: Any, x: str, y: str) -> None:
    tidy(axes)
    axes.set_xlabel(x, fontsize=9, color=INK)
    axes.set_ylabel(y, fontsize=9, color=INK)
