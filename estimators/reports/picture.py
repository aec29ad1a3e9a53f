"""The picture of an estimator's errors: each estimate with its references, and the difference below."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from estimators.comparison import Comparison
from estimators.references import AUTOPILOT, TRUTH, quantity_of
from estimators.reports.figure import INK, blank_figure, label_of, save_figure, tidy
from flightsim.foundation.vectors import wrap_pi

_ESTIMATE: Final = "#c2410c"
_COLOURS: Final = {AUTOPILOT: "#1769aa", TRUTH: "#111827"}
_IN_AIR: Final = "#f3f4f6"
_MOST: Final = 6  # largest number of quantities in one picture
_MOST_ALONE: Final = 9  # largest number of quantities without a reference
_NOT_DRAWN: Final = ("target",)
_POINTS: Final = 6000  # more cannot be distinguished in the picture
_UNITS: Final = {"deg": "deg", "m": "m", "m_s": "m/s"}


def draw_errors(path: Path, title: str, compared: Sequence[Comparison]) -> None:
    """Draw `errors.png`.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        compared: vehicles or targets; the first quantities of all of them are shown, those with a reference
            before those without.
    """
    groups: dict[str, list[Comparison]] = {}
    for c in compared:
        if c.group:
            groups.setdefault(c.group, []).append(c)
    together = [
        (members, column)
        for group, members in groups.items()
        for column in members[0].estimates
        if column != group
    ]
    compared = [c for c in compared if not c.group]
    shown = [
        (c, column) for c in compared for column in dict.fromkeys(k for r in c.references.values() for k in r)
    ][:_MOST]
    alone = [
        (c, column)
        for c in compared
        for column in c.estimates
        if (c, column) not in shown and column not in _NOT_DRAWN and np.isfinite(c.estimates[column]).any()
    ]
    left_out = max(0, len(alone) - _MOST_ALONE)
    alone = alone[:_MOST_ALONE]
    heights = [1.9, 1.0] * len(shown) + [1.1] * (len(alone) + len(together)) or [1.1]
    figure = blank_figure(10.0, 0.9 + 3.1 * len(shown) + 1.2 * max(1, len(alone) + len(together)))
    more = f"\n{left_out} more columns are in estimates.csv" if left_out else ""
    figure.suptitle(title + more, fontsize=12, fontweight="bold", color=INK)
    grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    several = len({c.label for c, _ in [*shown, *alone]}) > 1
    below: Any = None
    first: Any = None  # all panels share its time axis
    for k, (c, column) in enumerate(shown):
        above = figure.add_subplot(grid[2 * k], sharex=first)
        first = first or above
        below = figure.add_subplot(grid[2 * k + 1], sharex=above)
        _draw_quantity(above, below, c, column, c.label if several else "")
        above.tick_params(labelbottom=False)
        if k == 0:
            _legend(above, c)
        tidy(above)
        tidy(below)
    for k, (c, column) in enumerate(alone):
        below = figure.add_subplot(grid[2 * len(shown) + k], sharex=first)
        first = first or below
        _draw_alone(below, c, column, c.label if several else "")
        if k == 0 and not shown:
            _legend(below, c)
        tidy(below)
    for k, (members, column) in enumerate(together):
        below = figure.add_subplot(grid[2 * len(shown) + len(alone) + k], sharex=first)
        first = first or below
        _draw_together(below, members, column, legend=k == 0)
        tidy(below)
    if below is None:
        figure.text(0.5, 0.4, "no estimate was made", ha="center", fontsize=11, color=INK)
    else:
        below.set_xlabel("vehicle time, s", fontsize=9, color=INK)
    save_figure(figure, path)


def _legend(axes: Any, compared: Comparison) -> None:
    handles = [
        Line2D([], [], color=_COLOURS[name], linewidth=1.4, label=f"{name} ({', '.join(sources)})")
        for name, sources in compared.sources.items()
    ]
    handles.append(Line2D([], [], color=_ESTIMATE, linewidth=1.4, label="estimate"))
    handles.append(Line2D([], [], color=_IN_AIR, linewidth=7, label="in the air"))
    axes.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(handles),
        fontsize=8,
        frameon=False,
    )


def _draw_quantity(above: Any, below: Any, c: Comparison, column: str, label: str) -> None:
    name, unit, factor = quantity_of(column)
    time_s = _continuous_s(c)
    for axes in (above, below):
        _shade(axes, time_s, c.counted)
    thin = slice(None, None, max(1, len(time_s) // _POINTS))
    breaks = _breaks(time_s)
    # The truth is drawn below the autopilot's line, and both below the estimate.
    for reference in sorted(c.references, key=lambda r: r != TRUTH):
        columns = c.references[reference]
        if column not in columns:
            continue
        colour = _COLOURS[reference]
        width = 2.2 if reference == TRUTH and len(c.references) > 1 else 1.3
        above.plot(
            time_s[thin],
            factor * _parted(columns[column], breaks, column)[thin],
            color=colour,
            linewidth=width,
        )
        error = factor * c.errors(reference, column)
        below.plot(time_s[thin], _parted(error, breaks, "")[thin], color=colour, linewidth=0.8)
    estimate = factor * _parted(c.estimates[column], breaks, column)
    above.plot(time_s[thin], estimate[thin], color=_ESTIMATE, linewidth=0.9)
    written = _UNITS.get(unit, unit)
    above.set_ylabel(_axis_label(label, name, written), fontsize=9, color=INK)
    below.set_ylabel(f"error, {written}", fontsize=9, color=INK)
    below.axhline(0.0, color=INK, linewidth=0.6)
    _limit(below, c, column, factor)
    labels = [
        f"{reference}: RMS {figure.rms:.3g} {written}, at most {figure.max:.3g} {written}"
        for reference, figures in c.figures.items()
        for figure in figures
        if figure.quantity == name and figure.unit == unit
    ]
    below.annotate(
        "   ".join(labels), (1.0, 1.0), xycoords="axes fraction", xytext=(-4, -3), textcoords="offset points",
        ha="right", va="top", fontsize=8, color=INK,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.5},
    )  # fmt: skip


def _draw_alone(axes: Any, c: Comparison, column: str, label: str) -> None:
    """Draw a column that has no reference to compare with."""
    name, unit, factor = quantity_of(column)
    time_s = _continuous_s(c)
    _shade(axes, time_s, c.counted)
    thin = slice(None, None, max(1, len(time_s) // _POINTS))
    values = factor * _parted(c.estimates[column], _breaks(time_s), column)
    axes.plot(time_s[thin], values[thin], color=_ESTIMATE, linewidth=0.9)
    written = _UNITS.get(unit, unit)
    axes.set_ylabel(_axis_label(label, name, written), fontsize=8, color=INK)


def _axis_label(label: str, quantity: str, unit: str) -> str:
    """Such as "vehicle 2 offset north, m": the name of a column in words, with its unit if it has one."""
    words = f"{label} {label_of(quantity)}".strip()
    return f"{words}, {unit}" if unit else words


def _draw_together(axes: Any, members: Sequence[Comparison], column: str, *, legend: bool) -> None:
    """Draw a column of all things of a group. Their estimates are apart in time, so they are points."""
    name, unit, factor = quantity_of(column)
    for c in members:
        values = factor * (wrap_pi(c.estimates[column]) if column.endswith("_rad") else c.estimates[column])
        axes.plot(_continuous_s(c), values, ".", markersize=5, label=c.label)
    written = _UNITS.get(unit, unit)
    axes.set_ylabel(_axis_label("", name, written), fontsize=8, color=INK)
    if legend:
        axes.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(6, len(members)), fontsize=8, frameon=False
        )


def _limit(axes: Any, c: Comparison, column: str, factor: float) -> None:
    """Set the axis limits to the errors in the air; errors on the ground may be outside the picture."""
    largest = 0.0
    for reference, columns in c.references.items():
        if column in columns:
            error = np.abs(factor * c.errors(reference, column)[c.counted])
            largest = max(largest, float(np.nanmax(error, initial=0.0, where=np.isfinite(error))))
    if largest > 0.0:
        axes.set_ylim(-1.2 * largest, 1.8 * largest)  # room for the figures above the line


def _continuous_s(c: Comparison) -> NDArray[np.float64]:
    """Time for the axis, with the boots in sequence."""
    time_s = c.time_us * 1e-6
    offset = 0.0
    for number in np.unique(c.boot)[1:]:
        before, here = time_s[c.boot < number], c.boot == number
        offset = float(before.max()) + 5.0 - float(time_s[here].min()) if len(before) else 0.0
        time_s[here] += offset
    return np.asarray(time_s, dtype=np.float64)


def _breaks(time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask of the points at which a line is interrupted: after more than a second without an estimate."""
    return np.append(np.diff(time_s) > 1.0, False) if len(time_s) else np.zeros(0, dtype=np.bool_)


def _parted(values: NDArray[np.float64], breaks: NDArray[np.bool_], column: str) -> NDArray[np.float64]:
    """Values with NaN where the line is interrupted: at gaps, and at angles that wrap around."""
    wrapped = values
    if column.endswith("_rad"):
        wrapped = wrap_pi(values)
        with np.errstate(invalid="ignore"):
            jumps = np.append(np.abs(np.diff(wrapped)) > math.pi, False)
        return np.where(breaks | jumps, np.nan, wrapped)
    return np.where(breaks, np.nan, wrapped)


def _shade(axes: Any, time_s: NDArray[np.float64], counted: NDArray[np.bool_]) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], counted, [False])).astype(np.int8)))
    for first, last in edges.reshape(-1, 2).tolist():
        axes.axvspan(time_s[first], time_s[last - 1], color=_IN_AIR, zorder=0, linewidth=0)
