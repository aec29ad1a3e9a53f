"""The picture of a study: each quantity over the cells with its interval, or over the sampled parameters."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.reports.figure import INK, blank_figure, label_of, save_figure, tidy
from flightsim.foundation.random_streams import RandomStreams
from missions.studies.results import Results
from missions.studies.statistics import median_interval, rate_of
from missions.studies.summary import metrics_of, name_of

__all__ = ["PICTURE", "draw_study"]

Array = NDArray[np.float64]

PICTURE: Final = "study.png"
_COLOURS: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b45309", "#0f766e", "#be185d", "#4b5563")
_MOST: Final = 7  # largest number of quantities in one picture
_MOST_SAMPLED: Final = 4
_POINTS: Final = 200  # of a cell; more cannot be distinguished
_SPREAD: Final = 0.35  # of the points of a cell, as a share of the distance between cells


def draw_study(results: Results, folder: Path) -> None:
    """Draw `study.png`: a panel for the success rate and one for each quantity.

    The first parameter of the cells is the horizontal axis, and the combinations of the others have colours.
    Dots are single trials, and the marks are medians with their 95 % intervals. A study with one cell shows
    its quantities over the parameters that were drawn.
    """
    succeeded = results.succeeded
    values = {name: np.where(succeeded, results.values(name), np.nan) for name in metrics_of(results)}
    shown = [
        name for name, placed in values.items() if np.isfinite(placed).any() and np.nanstd(placed) > 0.0
    ][:_MOST]
    sampled = list(results.sampled)[:_MOST_SAMPLED] if len(results.cells) == 1 else []
    columns = max(1, len(sampled)) if sampled else 2 if len(shown) else 1
    panels = 1 + len(shown) if not sampled else max(1, len(shown)) * columns
    rows = -(-panels // columns)
    figure = blank_figure(1.0 + 5.0 * columns, 1.2 + 3.1 * rows)
    ended = f"{results.table.num_rows} trials" + ("" if results.complete else ", not complete")
    about = f"\n{results.description}" if results.description else ""
    marks = "dots: trials; marks: medians with 95 % intervals" if not sampled else "dots: trials"
    figure.suptitle(f"{results.name}: {ended} ({marks}){about}", fontsize=11, fontweight="bold", color=INK)
    axes = [figure.add_subplot(rows, columns, k + 1) for k in range(panels)]
    if sampled:
        for k, axis in enumerate(axes):
            name = shown[k // columns] if shown else ""
            _draw_scatter(axis, results, sampled[k % columns], name, values.get(name))
    else:
        _draw_rates(axes[0], results)
        for axis, name in zip(axes[1:], shown, strict=True):
            _draw_cells(axis, results, name, values[name])
        _legend(figure, axes[0])
    save_figure(figure, folder / PICTURE)


def _places(results: Results) -> tuple[list[float], list[int], Sequence[str], Sequence[str], str]:
    """Horizontal place and colour of each cell, tick labels, names of the colours, and the axis's label."""
    cells = results.cells
    names = list(cells[0])
    if not names:
        return [0.0], [0], ["all trials"], [""], ""
    first, others = names[0], names[1:]
    levels = list(dict.fromkeys(cell[first] for cell in cells))
    groups = list(dict.fromkeys(tuple(cell[name] for name in others) for cell in cells))
    step = 0.8 / max(1, len(groups))
    where, group_of = [], []
    for cell in cells:
        group = groups.index(tuple(cell[name] for name in others))
        where.append(levels.index(cell[first]) + step * (group - 0.5 * (len(groups) - 1)))
        group_of.append(group)
    ticks = [f"{level:g}" if isinstance(level, float) else str(level) for level in levels]
    labels = [name_of(dict(zip(others, group, strict=True))) for group in groups]
    return where, group_of, ticks, labels, first


def _draw_rates(axes: Any, results: Results) -> None:
    where, groups, ticks, labels, label = _places(results)
    succeeded, finished = results.succeeded, results.finished
    seen: set[int] = set()
    for cell, (x, group) in enumerate(zip(where, groups, strict=True)):
        rate = rate_of(int(succeeded[cell].sum()), int(finished[cell].sum()))
        if rate.n:
            name = labels[group] if group not in seen and labels[group] else None
            seen.add(group)
            _mark(axes, x, rate.rate, rate.ci95, group, name)
    axes.set_ylim(-0.03, 1.03)
    of = label_of(results.success) if results.success else "with a result"
    _finish(axes, ticks, label, f"share of trials: {of}\n(95 % intervals by Wilson)")


def _draw_cells(axes: Any, results: Results, name: str, placed: Array) -> None:
    where, groups, ticks, _, label = _places(results)
    generator = RandomStreams(0).generator("study", "picture", name)
    width = _SPREAD * 0.8 / (max(groups) + 1)
    for cell, (x, group) in enumerate(zip(where, groups, strict=True)):
        known = placed[cell][np.isfinite(placed[cell])]
        if not len(known):
            continue
        dots = known[:_POINTS]
        axes.plot(
            x + width * generator.uniform(-1.0, 1.0, len(dots)), dots, ".",
            color=_COLOURS[group % len(_COLOURS)], markersize=3, alpha=0.35, markeredgewidth=0,
        )  # fmt: skip
        _mark(axes, x, float(np.median(known)), median_interval(known), group, None)
    _finish(axes, ticks, label, label_of(name))


def _mark(
    axes: Any, x: float, value: float, interval: tuple[float, float], group: int, name: str | None
) -> None:
    low, high = (value - interval[0], interval[1] - value) if np.isfinite(interval).all() else (0.0, 0.0)
    axes.errorbar(
        [x], [value], [[max(0.0, low)], [max(0.0, high)]], fmt="o", markersize=5, capsize=3, linewidth=1.4,
        color=_COLOURS[group % len(_COLOURS)], label=name,
    )  # fmt: skip


def _draw_scatter(axes: Any, results: Results, parameter: str, name: str, placed: Array | None) -> None:
    drawn = results.values(parameter)[0]
    succeeded, finished = results.succeeded[0], results.finished[0]
    values = np.ones(len(drawn)) if placed is None else placed[0]
    good = finished & succeeded
    axes.plot(drawn[good], values[good], ".", color=_COLOURS[0], markersize=4, alpha=0.5)
    for x in drawn[finished & ~succeeded]:
        axes.axvline(x, ymax=0.04, color=_COLOURS[1], linewidth=1.2)
    tidy(axes)
    axes.set_xlabel(f"{label_of(parameter)} (below: trials without success)", fontsize=9, color=INK)
    axes.set_ylabel(label_of(name) if name else "success", fontsize=9, color=INK)


def _finish(axes: Any, ticks: Sequence[str], label: str, title: str) -> None:
    tidy(axes)
    axes.set_xticks(range(len(ticks)), ticks)
    axes.set_xlim(-0.6, len(ticks) - 0.4)
    axes.set_xlabel(label_of(label), fontsize=9, color=INK)
    axes.set_ylabel(title, fontsize=9, color=INK)


def _legend(figure: Any, axes: Any) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(
            handles, labels, loc="outside lower center", ncols=min(4, len(labels)), fontsize=8, frameon=False
        )
