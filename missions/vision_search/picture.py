"""The picture of a vision search: beliefs at four moments with the footprints, and how the belief narrows
down.
"""

import math
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.patches import Ellipse, Polygon

from estimators.received import broken_at_gaps
from estimators.reports.figure import INK, blank_figure, save_figure
from estimators.vision_search import AreaEstimate
from missions.base.report import Debriefing
from missions.vision_search.figures import ELLIPSE_95, true_place
from missions.vision_search.search import Moment
from missions.vision_search.team import VisionSearchTeam

__all__ = ["draw_search"]

_COLOURS: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b91c1c", "#0e7490")
_GRID: Final = "#e5e7eb"
_TRUE: Final = "#dc2626"
_BLACK: Final = 6.0  # times the probability of a cell of a uniform belief
_WIDTHS: Final = 6.0  # half the side of the ellipses' view, in standard deviations


def draw_search(path: Path, title: str, team: VisionSearchTeam, debriefing: Debriefing) -> None:
    """Draw the search.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        team: the team at the end of the search.
        debriefing: debriefing of the run.
    """
    place = true_place(team, debriefing, team.search.moments[-1].time_us)
    figure = blank_figure(14.0, 7.2)
    figure.suptitle(title, fontsize=12, fontweight="bold", color=INK)
    grid = figure.add_gridspec(2, 4, height_ratios=(3.4, 2.8))
    moments = _moments(team)
    above = grid[0, :].subgridspec(1, len(moments))
    for k, moment in enumerate(moments):
        axes = figure.add_subplot(above[0, k])
        _draw_moment(axes, moment, team, place)
        axes.set_xlabel("east of home, m", fontsize=8, color=INK)
        if k == 0:
            axes.set_ylabel("north of home, m\n(shade: where the target may be)", fontsize=8, color=INK)
    _draw_detection(figure.add_subplot(grid[1, 0]), team)
    _draw_covariance(figure.add_subplot(grid[1, 1:3]), team, place)
    _draw_ellipses(figure.add_subplot(grid[1, 3]), team, place)
    save_figure(figure, path)


def _moments(team: VisionSearchTeam) -> list[Moment]:
    """Up to four different moments: two of the search, the first after the target was localized, and the
    last.
    """
    search = team.search
    moments, end_us = search.moments, search.localized_us
    flown = [m for m in moments if m.time_us >= search.began_us] or moments
    if end_us < 0:
        return _different([flown[min(len(flown) - 1, k * len(flown) // 3)] for k in range(4)])
    start_us = flown[0].time_us
    wanted = [start_us + share * (end_us - start_us) for share in (0.4, 0.85)]
    after = [m for m in flown if m.time_us >= end_us] or [flown[-1]]
    searched = (min(flown, key=lambda m: abs(m.time_us - t)) for t in wanted)
    return _different([*searched, after[0], flown[-1]])


def _different(moments: list[Moment]) -> list[Moment]:
    """The moments of different times, in order: a target that is found at once leaves few."""
    return list({moment.time_us: moment for moment in moments}.values())


def _times(states: list[AreaEstimate], began_us: int) -> list[float]:
    return [(state.time_us - began_us) * 1e-6 for state in states]


def _draw_moment(
    axes: Any, moment: Moment, team: VisionSearchTeam, place: tuple[float, float] | None
) -> None:
    layout, search = team.search.layout, team.search
    # a uniform belief is grey: black is a place that is much more probable than others
    density = moment.shares / max(moment.shares.max(), _BLACK / moment.shares.size)
    axes.imshow(
        np.sqrt(density),  # small probabilities are visible too
        origin="lower",
        extent=(layout.west_m, layout.east_m, layout.south_m, layout.north_m),
        cmap="Greys",
        vmin=0.0,
        vmax=1.0,
        interpolation="nearest",
    )
    for k, searcher in enumerate(team.searchers):
        colour = _COLOURS[k % len(_COLOURS)]
        track = np.array([flown for flown in searcher.track if flown[0] <= moment.time_us]).reshape(-1, 3)
        _, north_m, east_m = broken_at_gaps(*(track * (1e-6, 1.0, 1.0)).T)
        axes.plot(east_m, north_m, "-", color=colour, linewidth=1.0, label=f"vehicle {k + 1}")
        here = moment.places[k]
        if here is not None:
            axes.add_patch(_footprint(here, team, k, colour))
    if place is not None:
        axes.plot(place[1], place[0], "+", color=_TRUE, markersize=10, label="target")
    _ellipse(axes, moment.estimate, _COLOURS[2])
    axes.set_xlim(layout.west_m, layout.east_m)
    axes.set_ylim(layout.south_m, layout.north_m)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7, colors=INK)
    seconds = (moment.time_us - search.began_us) * 1e-6
    axes.set_title(
        f"{seconds:.0f} s: {moment.estimate.detections} detections, sigma {moment.estimate.sigma_m:.1f} m",
        fontsize=9,
        color=INK,
        loc="left",
    )
    axes.legend(fontsize=7, loc="upper right", framealpha=0.85)


def _footprint(here: tuple[float, float, float], team: VisionSearchTeam, index: int, colour: str) -> Any:
    """What a level camera sees from a place."""
    options = team.options[index]
    north_m, east_m, yaw_rad = here
    half_right = options.own_altitude_m * math.tan(0.5 * options.view_rad)
    half_ahead = 0.5625 * half_right
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    corners = [
        (east_m + ahead * sine + right * cosine, north_m + ahead * cosine - right * sine)
        for ahead, right in (
            (half_ahead, -half_right),
            (half_ahead, half_right),
            (-half_ahead, half_right),
            (-half_ahead, -half_right),
        )
    ]
    return Polygon(corners, closed=True, fill=False, edgecolor=colour, linewidth=1.4)


def _ellipse(axes: Any, estimate: AreaEstimate, colour: str, label: str = "") -> None:
    """The 95 % ellipse."""
    covariance = np.array(
        [
            [estimate.east_variance_m2, estimate.north_east_covariance_m2],
            [estimate.north_east_covariance_m2, estimate.north_variance_m2],
        ]
    )
    values, vectors = np.linalg.eigh(covariance)
    width, height = 2.0 * np.sqrt(ELLIPSE_95 * np.maximum(values, 0.0))
    angle = math.degrees(math.atan2(vectors[1, 0], vectors[0, 0]))
    centre = estimate.east_m, estimate.north_m
    axes.add_patch(
        Ellipse(centre, width, height, angle=angle, fill=False, edgecolor=colour, linewidth=1.3, label=label)
    )


def _draw_detection(axes: Any, team: VisionSearchTeam) -> None:
    for k, states in enumerate(team.search.states):
        pod = [state.probability_of_detection for state in states]
        colour = _COLOURS[k % len(_COLOURS)]
        axes.plot(_times(states, team.search.began_us), pod, color=colour, label=f"vehicle {k + 1}")
    axes.set_ylim(0.0, 1.0)
    _style(axes, "cumulative probability of detection")


def _draw_covariance(axes: Any, team: VisionSearchTeam, place: tuple[float, float] | None) -> None:
    for k, states in enumerate(team.search.states):
        colour = _COLOURS[k % len(_COLOURS)]
        times = _times(states, team.search.began_us)
        axes.semilogy(times, [s.sigma_m for s in states], color=colour, label=f"sigma, vehicle {k + 1}")
        if place is not None:
            errors = [max(1e-3, math.dist(place, (s.north_m, s.east_m))) for s in states]
            axes.semilogy(times, errors, color=colour, linestyle=":", label=f"error, vehicle {k + 1}")
    _style(axes, "standard deviation (longest axis)\nand error of the target's place, m")


def _draw_ellipses(axes: Any, team: VisionSearchTeam, place: tuple[float, float] | None) -> None:
    last = [states[-1] for states in team.search.states if states]
    for k, estimate in enumerate(last):
        colour = _COLOURS[k % len(_COLOURS)]
        _ellipse(axes, estimate, colour, f"vehicle {k + 1}")
        axes.plot(estimate.east_m, estimate.north_m, "o", color=colour, markersize=3)
    if place is not None:
        axes.plot(place[1], place[0], "+", color=_TRUE, markersize=10)
    if last:
        half_m = _WIDTHS * last[0].sigma_m
        axes.set_xlim(last[0].east_m - half_m, last[0].east_m + half_m)
        axes.set_ylim(last[0].north_m - half_m, last[0].north_m + half_m)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7, colors=INK)
    axes.set_xlabel("east of home, m", fontsize=8, color=INK)
    axes.set_ylabel("north of home, m", fontsize=8, color=INK)
    axes.set_title("95 % ellipses at the end", fontsize=9, color=INK, loc="left")


def _style(axes: Any, label: str) -> None:
    axes.set_ylabel(label, fontsize=8, color=INK)
    axes.set_xlabel("time of the search, s", fontsize=8, color=INK)
    axes.set_xlim(left=0.0)
    axes.grid(color=_GRID, linewidth=0.8)
    axes.tick_params(labelsize=7, colors=INK)
    axes.legend(fontsize=7, loc="best", frameon=False)
