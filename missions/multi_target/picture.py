"""The picture of a search: the way over the exploration map, the intensity at four times, and the result
over time.
"""

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.ticker import MaxNLocator

from estimators.received import broken_at_gaps
from estimators.reports.figure import INK, blank_figure, save_figure
from missions.base.report import Debriefing
from missions.multi_target.figures import CUTOFF_M, SearchScore, search_score
from missions.multi_target.search import Moment
from missions.multi_target.team import TargetSearchTeam

__all__ = ["draw_search"]

_COLOURS: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b91c1c", "#0e7490")
_GRID: Final = "#e5e7eb"
_TRUE: Final = "#dc2626"
_FOUND: Final = "#15803d"
_MOMENTS: Final = 4


def draw_search(path: Path, title: str, team: TargetSearchTeam, debriefing: Debriefing) -> None:
    """Draw the search.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        team: the team at the end of the search.
        debriefing: debriefing of the run.
    """
    score = search_score(team, debriefing)
    figure = blank_figure(13.0, 9.6)
    figure.suptitle(title, fontsize=12, fontweight="bold", color=INK)
    grid = figure.add_gridspec(3, 4, height_ratios=(3.0, 3.0, 2.2))
    _draw_way(figure, figure.add_subplot(grid[:2, :2]), team, score)
    for k, moment in enumerate(_four(team)):
        axes = figure.add_subplot(grid[k // 2, 2 + k % 2])
        _draw_moment(axes, moment, team, score)
        if k == 0:
            axes.legend(fontsize=6, loc="upper right", framealpha=0.85)
        if k >= 2:
            axes.set_xlabel("east, m", fontsize=8, color=INK)
    _draw_found(figure.add_subplot(grid[2, :2]), team, score)
    _draw_metrics(figure.add_subplot(grid[2, 2:]), team, score)
    save_figure(figure, path)


def _four(team: TargetSearchTeam) -> list[Moment]:
    """Intensities at four times, evenly spread from the begin until the last target was found; at the end of
    the search when none was.
    """
    moments, found = team.search.moments, team.watch.belief.found
    start_us = max(0, team.search.began_us)
    end_us = found[-1].time_us if found else moments[-1].time_us
    wanted = [start_us + (end_us - start_us) * (k + 0.5) / _MOMENTS for k in range(_MOMENTS)]
    return [min(moments, key=lambda moment: abs(moment.time_us - time_us)) for time_us in wanted]


def _limits(axes: Any, team: TargetSearchTeam) -> None:
    layout = team.watch.belief.exploration.layout
    axes.set_xlim(layout.west_m, layout.east_m)
    axes.set_ylim(layout.south_m, layout.north_m)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7, colors=INK)


def _draw_way(figure: Any, axes: Any, team: TargetSearchTeam, score: SearchScore | None) -> None:
    exploration = team.watch.belief.exploration
    layout = exploration.layout
    shades = axes.imshow(
        exploration.undetected,
        origin="lower",
        extent=(layout.west_m, layout.east_m, layout.south_m, layout.north_m),
        cmap="Blues_r",
        vmin=0.0,
        vmax=1.0,
        interpolation="bilinear",
        alpha=0.75,
    )
    for k, searcher in enumerate(team.searchers):
        track = np.array(searcher.track, dtype=np.float64).reshape(-1, 3)
        _, north_m, east_m = broken_at_gaps(*(track * (1e-6, 1.0, 1.0)).T)
        colour = _COLOURS[(k + 1) % len(_COLOURS)]
        axes.plot(east_m, north_m, "-", color=colour, linewidth=1.2, label=f"vehicle {k + 1}")
        if len(track):
            axes.plot(east_m[0], north_m[0], "o", color=colour, markersize=5)
    _mark_targets(axes, team, score, size=7)
    _limits(axes, team)
    axes.set_title("way over the exploration map", fontsize=10, color=INK, loc="left")
    axes.set_xlabel("east, m", fontsize=8, color=INK)
    axes.set_ylabel("north, m", fontsize=8, color=INK)
    axes.legend(fontsize=7, loc="upper right", framealpha=0.85)
    bar = figure.colorbar(shades, ax=axes, shrink=0.6, pad=0.02)
    bar.set_label("probability that a target was never detected", fontsize=8, color=INK)
    bar.ax.tick_params(labelsize=7, colors=INK)


def _mark_targets(axes: Any, team: TargetSearchTeam, score: SearchScore | None, size: float) -> None:
    if score is not None:
        axes.plot(
            score.targets_ne_m[:, 1],
            score.targets_ne_m[:, 0],
            "+",
            color=_TRUE,
            markersize=size,
            label="target",
        )
    found = team.watch.belief.found
    axes.plot(
        [t.east_m for t in found],
        [t.north_m for t in found],
        "o",
        color=_FOUND,
        markersize=size,
        markerfacecolor="none",
        label="found",
    )


def _draw_moment(axes: Any, moment: Moment, team: TargetSearchTeam, score: SearchScore | None) -> None:
    north, east, mass = moment.points
    axes.set_facecolor("#f8fafc")
    if len(mass):
        axes.scatter(east, north, c=mass, s=9.0, cmap="inferno_r", vmin=0.0, linewidths=0, label="belief")
    found = [t for t in team.watch.belief.found if t.time_us <= moment.time_us]
    axes.plot(
        [t.east_m for t in found],
        [t.north_m for t in found],
        "o",
        color=_FOUND,
        markersize=4,
        fillstyle="none",
        label="found",
    )
    if score is not None:
        places = score.targets_ne_m
        axes.plot(places[:, 1], places[:, 0], "+", color=_TRUE, markersize=4, label="target")
    for k, searcher in enumerate(team.searchers):
        before = [(n, e) for t, n, e in searcher.track if t <= moment.time_us]
        if before:
            axes.plot(
                before[-1][1], before[-1][0], "^", color=_COLOURS[(k + 1) % len(_COLOURS)], markersize=6
            )
    _limits(axes, team)
    since_s = (moment.time_us - team.search.began_us) * 1e-6
    axes.set_title(
        f"{since_s:.0f} s: {len(found)} found, {float(np.sum(mass)):.1f} expected in the belief",
        fontsize=9,
        color=INK,
        loc="left",
    )


def _times(team: TargetSearchTeam) -> list[float]:
    search = team.search
    return [(state.time_us - search.began_us) * 1e-6 for state in search.states]


def _draw_found(axes: Any, team: TargetSearchTeam, score: SearchScore | None) -> None:
    states = team.search.states
    found = [sum(target.found for target in state.targets) for state in states]
    axes.step(_times(team), found, where="post", color=_FOUND, label="found")
    if score is not None:
        axes.step(score.time_s, score.right, where="post", color=_COLOURS[0], linestyle="--", label="right")
        axes.axhline(len(score.targets_ne_m), color=_TRUE, linewidth=0.8, label="targets")
    _style(axes, "number of targets")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))


def _draw_metrics(axes: Any, team: TargetSearchTeam, score: SearchScore | None) -> None:
    if score is not None:
        axes.plot(score.time_s, score.ospa_m, color=_COLOURS[0], label=f"OSPA, cut-off {CUTOFF_M:g} m")
        axes.plot(score.time_s, [part.distance for part in score.gospa], color=_COLOURS[1], label="GOSPA")
        _style(axes, "distance to the true targets, m")
        return
    left = [state.expected_undetected for state in team.search.states]
    axes.plot(_times(team), left, color=_COLOURS[0], label="expected undetected")
    _style(axes, "expected number of targets")


def _style(axes: Any, label: str) -> None:
    axes.set_ylabel(label, fontsize=8, color=INK)
    axes.set_xlabel("time of the search, s", fontsize=8, color=INK)
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(left=0.0)
    axes.grid(color=_GRID, linewidth=0.8)
    axes.tick_params(labelsize=7, colors=INK)
    axes.legend(fontsize=7, loc="best", frameon=False)
