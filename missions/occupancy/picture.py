"""The picture of a search: the occupancy map at four times, as figure 8 of Lum et al. 2005, and the
result.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from estimators.received import broken_at_gaps
from estimators.reports.figure import INK, blank_figure, save_figure
from missions.base.report import Debriefing
from missions.occupancy.search import Search
from missions.occupancy.snapshots import Snapshot
from missions.occupancy.suspect import Suspect, Verdict
from missions.occupancy.team import SearchTeam

_COLOURS: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b91c1c", "#0e7490")
_GRID: Final = "#e5e7eb"
_TARGET: Final = "#dc2626"
_LETTERS: Final = "abcd"
_BEFORE_US: Final = 2_000_000
_MARK: Final[Mapping[str, Any]] = {"linestyle": "", "markeredgecolor": "white"}
_VERDICT_MARKS: Final[Mapping[Verdict, Mapping[str, Any]]] = {
    Verdict.DISMISSED: {**_MARK, "color": INK, "marker": "X", "markersize": 8},
    Verdict.OPEN: {**_MARK, "color": _TARGET, "marker": "D", "markersize": 6},
}
"""Marks of suspects in the last map; the target has a mark of its own."""


def four_moments(search: Search, end_us: int) -> list[Snapshot]:
    """Snapshots at four times: the start, before the target was first detected, after its scores were raised,
    and the end.

    If no target was found, the four times are evenly spaced.
    """
    snapshots = search.snapshots
    start_us = snapshots[0].time_us
    if search.found is not None and len(snapshots) >= 4:
        first_us = min(anomaly.time_us for _, anomaly in search.found.anomalies)
        raised = next((s for s in snapshots if s.event and s.time_us >= first_us), snapshots[-1])
        before = [s for s in snapshots if s.time_us <= max(start_us, first_us - _BEFORE_US)]
        return [snapshots[0], before[-1], raised, snapshots[-1]]
    times_us = [start_us + k * (end_us - start_us) / 3 for k in range(4)]
    return [min(snapshots, key=lambda s: abs(s.time_us - time_us)) for time_us in times_us]


def draw_search(path: Path, title: str, team: SearchTeam, debriefing: Debriefing) -> None:
    """Draw the search.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        team: the team at the end of the search.
        debriefing: debriefing of the run.
    """
    search, target_ne_m = team.search, debriefing.target_ne_m
    end_us = max([search.snapshots[-1].time_us] + [s.track[-1][0] for s in team.searchers if s.track])
    moments = four_moments(search, end_us)
    figure = blank_figure(10.0, 12.6, dpi=130)
    figure.suptitle(title, fontsize=12, fontweight="bold", color=INK)
    grid = figure.add_gridspec(3, 2, height_ratios=(4.0, 4.0, 2.0))
    cells = search.map.layout.rows * search.map.layout.columns
    highest = max(2.0, max(float(np.percentile(s.scores, 99.5)) for s in moments) * cells)
    maps = [figure.add_subplot(grid[k // 2, k % 2]) for k in range(4)]
    for k, (axes, moment) in enumerate(zip(maps, moments, strict=True)):
        shades = _draw_moment(axes, moment, team, target_ne_m, highest)
        since_s = (moment.time_us - team.began_us) * 1e-6
        axes.set_title(f"({_LETTERS[k]}) {max(0.0, since_s):.0f} s", fontsize=10, color=INK, loc="left")
    bar = figure.colorbar(shades, ax=maps, shrink=0.5, pad=0.02, aspect=30)
    bar.set_label("score of a cell, in mean prior scores", fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8, colors=INK)
    _draw_probability(figure.add_subplot(grid[2, :]), team, end_us)
    figure.legend(
        handles=_handles(debriefing, search), loc="outside lower center", ncols=6, fontsize=8, frameon=False
    )
    save_figure(figure, path)


def _draw_moment(
    axes: Any, moment: Snapshot, team: SearchTeam, target_ne_m: tuple[float, float] | None, highest: float
) -> Any:
    layout = team.search.map.layout
    shades = axes.imshow(
        moment.scores * (layout.rows * layout.columns),
        origin="lower",
        extent=(layout.west_m, layout.east_m, layout.south_m, layout.north_m),
        cmap="YlGnBu",
        vmin=0.0,
        vmax=highest,
        interpolation="nearest",
        zorder=1,
    )
    for k, searcher in enumerate(team.searchers):
        track = np.array([flown for flown in searcher.track if flown[0] <= moment.time_us])
        colour = _COLOURS[k % len(_COLOURS)]
        if len(track):
            _, track_north_m, track_east_m = broken_at_gaps(*(track * (1e-6, 1.0, 1.0)).T)
            axes.plot(track_east_m, track_north_m, color="white", linewidth=2.2, alpha=0.7, zorder=3)
            axes.plot(track_east_m, track_north_m, color=colour, linewidth=1.2, zorder=4)
        place_ne_m = moment.places_ne_m[k]
        if math.isfinite(place_ne_m[0]):
            axes.plot(*reversed(place_ne_m), "x", color=colour, markersize=9, markeredgewidth=2.4, zorder=6)
        for anomaly in searcher.anomalies:
            if anomaly.time_us <= moment.time_us:
                axes.plot(
                    anomaly.east_m, anomaly.north_m, "o", color=colour, markersize=7, markerfacecolor="none",
                    markeredgewidth=1.3, zorder=5,
                )  # fmt: skip
    if target_ne_m is not None:
        side_m = layout.cell_m
        axes.add_patch(
            Rectangle(
                (target_ne_m[1] - 0.5 * side_m, target_ne_m[0] - 0.5 * side_m), side_m, side_m, fill=False,
                linestyle="--", linewidth=1.6, edgecolor=_TARGET, zorder=7,
            )
        )  # fmt: skip
    found = team.search.found
    if found is not None and moment.time_us >= team.search.found_us:
        north_m, east_m = found.place_ne_m
        axes.plot(east_m, north_m, "*", color=_TARGET, markersize=11, markeredgecolor="white", zorder=8)
    if moment is team.search.snapshots[-1]:
        for candidate in team.search.candidates:
            mark = _VERDICT_MARKS.get(candidate.verdict) if isinstance(candidate, Suspect) else None
            if mark is not None:
                axes.plot(*reversed(candidate.place_ne_m), zorder=8, **mark)
    axes.set_aspect("equal")
    margin_m = 1.5 * layout.cell_m
    axes.set_xlim(layout.west_m - margin_m, layout.east_m + margin_m)
    axes.set_ylim(layout.south_m - margin_m, layout.north_m + margin_m)
    axes.set_xlabel("east, m", fontsize=8, color=INK)
    axes.set_ylabel("north, m", fontsize=8, color=INK)
    axes.tick_params(labelsize=7, colors=INK)
    return shades


def _draw_probability(axes: Any, team: SearchTeam, end_us: int) -> None:
    search = team.search
    times_s = np.array([0] + [t - team.began_us for t, _ in search.detection_curve], dtype=np.float64) * 1e-6
    values = np.array([0.0] + [value for _, value in search.detection_curve])
    axes.plot(times_s, values, color=INK, linewidth=1.6)
    for k, searcher in enumerate(team.searchers):
        for anomaly in searcher.anomalies:
            axes.axvline(
                (anomaly.time_us - team.began_us) * 1e-6, color=_COLOURS[k % len(_COLOURS)], linewidth=1.0,
                linestyle=":",
            )  # fmt: skip
    if search.found is not None:
        found_s = (search.found_us - team.began_us) * 1e-6
        axes.axvline(found_s, color=_TARGET, linewidth=1.4)
        axes.annotate(
            f"found after {found_s:.0f} s", (found_s, 0.03), xytext=(-5, 0), textcoords="offset points",
            ha="right", fontsize=8, color=_TARGET,
        )  # fmt: skip
    axes.set_ylim(0.0, 1.0)
    axes.set_xlim(0.0, max(1.0, (end_us - team.began_us) * 1e-6))
    axes.set_ylabel("cumulative probability\nof detection", fontsize=9, color=INK)
    axes.set_xlabel("time of search, s", fontsize=9, color=INK)
    axes.tick_params(labelsize=8, colors=INK)
    axes.grid(True, color=_GRID, linewidth=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _handles(debriefing: Debriefing, search: Search) -> list[Any]:
    handles: list[Any] = [
        Line2D(
            [], [], color=_COLOURS[k % len(_COLOURS)], marker="x", markersize=7, markeredgewidth=2.0,
            label=f"vehicle {notes.system_id} ({notes.kind.replace('_', ' ')})",
        )
        for k, (notes, _) in enumerate(debriefing.flights)
    ]  # fmt: skip
    handles.append(
        Line2D([], [], color=INK, marker="o", markerfacecolor="none", linestyle="", label="anomaly")
    )
    if debriefing.target_ne_m is not None:
        handles.append(
            Rectangle((0, 0), 1, 1, fill=False, linestyle="--", edgecolor=_TARGET, label="target (truth)")
        )
    verdicts = {candidate.verdict for candidate in search.candidates if isinstance(candidate, Suspect)}
    handles += [
        Line2D([], [], label=f"{verdict} at the end", **mark)
        for verdict, mark in _VERDICT_MARKS.items()
        if verdict in verdicts
    ]
    if search.found is not None:
        handles.append(
            Line2D([], [], color=_TARGET, marker="*", linestyle="", markersize=9, label="found at")
        )
    return handles
