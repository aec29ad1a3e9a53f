"""The paper's figures 6 and 7: the drones' paths, and the target as each estimator has it, in one run."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from missions.picture import tidy
from missions.studies.lissajous_localization import SampleRun
from missions.studies.lissajous_setting import DT, SAMPLE_CELL, START, STEPS

_INK: Final = "#1f2937"
_TRUTH: Final = "#111827"
_DRONES: Final = ("#1769aa", "#0e7490")
_COLOURS: Final = {"N": "#9aa3af", "K": "#c2410c", "P": "#1769aa", "F": "#15803d"}
_NAMES: Final = {
    "N": "N, unfiltered",
    "K": "K, Kalman filter",
    "P": "P, proposed",
    "F": "F, frequencies as states",
}
_FIGURES: Final[dict[str, Any]] = {
    "figsize": (9.0, 8.0),
    "dpi": 130,
    "layout": "constrained",
    "facecolor": "white",
}


def draw_paths(path: Path, run: SampleRun) -> None:
    """Figure 6: both drones' paths, the target's, and where the estimators have the first drone."""
    figure = Figure(**_FIGURES)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for drone in range(run.drones.shape[1]):
        x, y = run.drones[:, drone, 0], run.drones[:, drone, 2]
        axes.plot(x, y, color=_DRONES[drone], linewidth=1.4, label=f"drone {drone + 1}, true")
        axes.plot(START[drone, 0], START[drone, 2], "o", color=_DRONES[drone], markersize=7)
    for index, column in enumerate(run.block.columns):
        if column.name in ("K", "P"):
            axes.plot(
                run.first_drone[:, index, 0],
                run.first_drone[:, index, 1],
                color=_COLOURS[column.name],
                linewidth=1.0,
                linestyle="--" if column.name == "K" else ":",
                label=f"drone 1 by {_NAMES[column.name]}",
            )
    axes.plot(
        run.target[:, 0], run.target[:, 1], color=_TRUTH, linewidth=1.0, alpha=0.7, label="target, true"
    )
    axes.set_aspect("equal")
    _finish(axes, "x", "y")
    figure.suptitle(f"Drone paths, {_cell()}", fontsize=13, fontweight="bold", color=_INK)
    _save(figure, path)


def draw_target(path: Path, run: SampleRun) -> None:
    """Figure 7: the target by each estimator, and how far off each is."""
    figure = Figure(**_FIGURES)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 1, height_ratios=(3.0, 1.2))
    place, error = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    times = DT * np.arange(1, STEPS + 1)
    for index, column in enumerate(run.block.columns):
        colour, seen = _COLOURS[column.name], run.estimates[:, index]
        style: dict[str, Any] = {"color": colour, "linewidth": 1.2, "zorder": 2 + index}
        label = f"{_NAMES[column.name]}: {run.errors[index]:.2f}"
        place.plot(seen[:, 0], seen[:, 1], **style, label=label)
        off = np.sqrt(0.5 * np.sum((seen - run.target) ** 2, axis=1))
        error.semilogy(times, off, **style)
    place.plot(
        run.target[:, 0], run.target[:, 1], color=_TRUTH, linewidth=1.0, label="target, true", zorder=9
    )
    place.set_aspect("equal")
    centre, reach = run.target.mean(axis=0), 1.35 * np.ptp(run.target, axis=0) / 2.0
    place.set_xlim(centre[0] - 1.6 * reach[0], centre[0] + 1.6 * reach[0])
    place.set_ylim(centre[1] - reach[1], centre[1] + reach[1])
    _finish(place, "x", "y")
    tidy(error)
    error.set_xlabel("time", fontsize=9, color=_INK)
    error.set_ylabel("error", fontsize=9, color=_INK)
    figure.suptitle(f"Target estimates, {_cell()}", fontsize=13, fontweight="bold", color=_INK)
    _save(figure, path)


def _cell() -> str:
    epsilon, delta = SAMPLE_CELL
    return f"$\\delta$ = {delta:g}, $\\epsilon$ = {epsilon:g}"


def _finish(axes: Any, x: str, y: str) -> None:
    tidy(axes)
    axes.set_xlabel(x, fontsize=9, color=_INK)
    axes.set_ylabel(y, fontsize=9, color=_INK)
    axes.legend(fontsize=8, loc="upper left", frameon=False)


def _save(figure: Figure, path: Path) -> None:
    with path.open("xb") as file:
        figure.savefig(file, format="png", metadata={"Software": None})
