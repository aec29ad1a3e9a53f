"""The picture of a run: the track from above, and below it altitude and error over time."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar  # type: ignore[import-untyped]

from estimators.received import broken_at_gaps
from estimators.reports.figure import INK, blank_figure, save_figure, tidy
from flightsim.foundation.geodesy import LocalFrame
from missions.flown.score import FlightScore, Track
from missions.vehicle.notes import PATTERN, FlightNotes

_COMMANDED: Final = "#9aa3af"
_COLOURS: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b91c1c", "#0e7490")
_TRUTH: Final = "#111827"
_LEAST_SPAN_M: Final = 10.0
_PHASE: Final = "#f3f4f6"


def draw_run(
    path: Path,
    title: str,
    flights: list[tuple[FlightNotes, FlightScore]],
    overlay: Callable[[Any], object] | None = None,
) -> None:
    """Draw `track.png` for one vehicle or a team.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        flights: notes and scores, one per vehicle. Tracks of a team are drawn around the first vehicle's
            home.
        overlay: draws more on the axes of the track from above, labelled for its legend.
    """
    figure = blank_figure(9.0, 11.6, dpi=130)
    scored = any(notes.commanded is not None for notes, _ in flights)
    ratios = (3.6, 1.0, 1.0) if scored else (4.6, 1.0)
    grid = figure.add_gridspec(len(ratios), 1, height_ratios=ratios)
    above, altitude, *rest = (figure.add_subplot(grid[k]) for k in range(len(ratios)))
    figure.suptitle(title, fontsize=13, fontweight="bold", color=INK)
    _draw_from_above(above, flights, overlay)
    _draw_altitude(altitude, flights)
    for error in rest:  # there is a path to compare with
        error.sharex(altitude)  # the altitude always has times, even if the flight never reached its curve
        _draw_error(error, flights)
        altitude.tick_params(labelbottom=False)
    for axes in (above, altitude, *rest):
        tidy(axes)
    (rest or [altitude])[0].set_xlabel("vehicle time, s", fontsize=9, color=INK)
    save_figure(figure, path)


def _shown(track: Track, notes: FlightNotes) -> Track:
    """The part of a track in flight, reduced to the points that a picture can show."""
    if notes.phases:
        track = track.between(notes.phases[0].start_us, notes.phases[-1].end_us)
    return track.thinned(len(track.time_s) // 6000)


def _offset(notes: FlightNotes, first: FlightNotes) -> tuple[float, float]:
    """North and east of this vehicle's home relative to the first vehicle's home."""
    if notes.commanded is None or first.commanded is None or notes is first:
        return 0.0, 0.0
    home = notes.commanded.origin
    north, east, _ = LocalFrame(first.commanded.origin).ned_from_geodetic(
        home.lat_deg, home.lon_deg, home.alt_m
    )
    return north, east


def _draw_from_above(
    axes: Any, flights: list[tuple[FlightNotes, FlightScore]], overlay: Callable[[Any], object] | None
) -> None:
    first = flights[0][0]
    handles: list[Line2D] = []
    team = len(flights) > 1
    for k, (notes, score) in enumerate(flights):
        north, east = _offset(notes, first)
        colour = _COLOURS[k % len(_COLOURS)]
        if notes.commanded is not None:
            path = notes.commanded.points_ned_m
            axes.plot(
                path[:, 1] + east, path[:, 0] + north, color=_COMMANDED, linewidth=4.5, alpha=0.55, zorder=1
            )
            waypoints = notes.commanded.waypoints_ned_m
            axes.plot(
                waypoints[:, 1] + east, waypoints[:, 0] + north, "o", color=_COMMANDED, markersize=3.2,
                markerfacecolor="white", zorder=4,
            )  # fmt: skip
        for track, is_truth in ((score.estimate, False), (score.truth, True)):
            if track is not None:
                _, shown = _shown(track, notes).drawn()
                style = _truth_style(colour, team) if is_truth else _estimate_style(colour, team)
                axes.plot(shown[:, 1] + east, shown[:, 0] + north, zorder=3 if is_truth else 2, **style)
        main = score.truth if score.truth is not None else score.estimate
        shown_track = None if main is None else _shown(main, notes)
        if shown_track is not None and len(shown_track.time_s) > 1:
            _draw_marks(axes, shown_track, north, east)
        label = f"vehicle {notes.system_id}" if team else "autopilot's estimate"
        handles.append(Line2D([], [], color=colour, linewidth=1.6, label=label))
    if any(notes.commanded is not None for notes, _ in flights):
        handles.insert(0, Line2D([], [], color=_COMMANDED, linewidth=4.5, alpha=0.55, label="commanded"))
    if any(len(notes.commanded.waypoints_ned_m) for notes, _ in flights if notes.commanded):
        handles.insert(
            1,
            Line2D(
                [], [], color=_COMMANDED, marker="o", markerfacecolor="white", linestyle="", label="waypoints"
            ),
        )
    if not team and flights[0][1].truth is not None:
        handles.append(Line2D([], [], **_truth_style(INK, team), label="truth"))
    handles.append(Line2D([], [], color=INK, marker="$\u27a4$", markersize=9, linestyle="", label="heading"))
    handles.append(Line2D([], [], color="#15803d", marker="o", markersize=7, linestyle="", label="start"))
    handles.append(Line2D([], [], color="#b91c1c", marker="s", markersize=6, linestyle="", label="end"))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06, 0.08)
    axes.set_xlabel("east of home, m", fontsize=9, color=INK)
    axes.set_ylabel("north of home, m", fontsize=9, color=INK)
    if overlay is not None:
        overlay(axes)
    handles += axes.get_legend_handles_labels()[0]
    one_row = len(handles) < 8
    above = 1.07 if one_row else 1.1 if len(handles) < 13 else 1.13  # of the axes: under the title
    axes.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, above),
        ncols=len(handles) if one_row else 4, fontsize=8, frameon=False, handlelength=1.6, columnspacing=1.2,
    )  # fmt: skip
    middle = axes.dataLim.get_points().mean(axis=0) if axes.dataLim.width >= 0.0 else np.zeros(2)
    axes.update_datalim([middle - _LEAST_SPAN_M / 2, middle + _LEAST_SPAN_M / 2])
    axes.autoscale_view()
    box = axes.dataLim
    _draw_scale(axes, max(box.width, box.height, 1.0))


def _truth_style(colour: str, team: bool) -> dict[str, Any]:
    """Style of the truth: a thin dark line; for a team, a line in the vehicle's colour."""
    return {"color": colour if team else _TRUTH, "linewidth": 1.3 if team else 0.9}


def _estimate_style(colour: str, team: bool) -> dict[str, Any]:
    """Style of the autopilot's estimate: a line in the vehicle's colour; for a team, a pale band below the
    truth.
    """
    return {"color": colour, "linewidth": 3.0 if team else 1.6, "alpha": 0.3 if team else 0.85}


def _draw_marks(axes: Any, track: Track, north: float, east: float) -> None:
    """Draw heading arrows evenly along the track, and marks at start and end."""
    steps = np.linalg.norm(np.diff(track.pos_ned_m[:, :2], axis=0), axis=1)
    arc = np.concatenate(([0.0], np.cumsum(steps)))
    if arc[-1] > 1.0:
        count = int(np.clip(arc[-1] / 45.0, 6, 28))
        where = np.searchsorted(arc, (np.arange(count) + 0.5) / count * arc[-1])
        yaw = track.yaw_rad[where]
        axes.quiver(
            track.pos_ned_m[where, 1] + east, track.pos_ned_m[where, 0] + north, np.sin(yaw), np.cos(yaw),
            color=INK, scale=48, width=0.0038, headwidth=4.2, headlength=5.0, headaxislength=4.4,
            pivot="middle", zorder=6,
        )  # fmt: skip
    start, end = track.pos_ned_m[0], track.pos_ned_m[-1]
    axes.plot(
        start[1] + east,
        start[0] + north,
        "o",
        color="#15803d",
        markersize=9,
        zorder=7,
        markeredgecolor="white",
    )
    axes.plot(
        end[1] + east, end[0] + north, "s", color="#b91c1c", markersize=6, zorder=8, markeredgecolor="white"
    )


def _draw_scale(axes: Any, span_m: float) -> None:
    """Draw a bar of a round length in the lower right corner, in the scale of the axes."""
    exponent = math.floor(math.log10(span_m / 4.0))
    length = max(m * 10.0**exponent for m in (1, 2, 5) if m * 10.0**exponent <= span_m / 4.0)
    bar = AnchoredSizeBar(
        axes.transData, length, f"{length:g} m", "lower right", pad=0.4, sep=4, frameon=True, color=INK,
        size_vertical=span_m * 0.004, label_top=True, fontproperties=FontProperties(size=8),
    )  # fmt: skip
    bar.patch.set(edgecolor="none", facecolor="white", alpha=0.8)
    bar.set_zorder(9)
    axes.add_artist(bar)


def _shade_pattern(axes: Any, notes: FlightNotes) -> None:
    phase = notes.phase(PATTERN)
    if phase is not None:
        axes.axvspan(phase.start_us * 1e-6, phase.end_us * 1e-6, color=_PHASE, zorder=0, linewidth=0)


def _draw_altitude(axes: Any, flights: list[tuple[FlightNotes, FlightScore]]) -> None:
    for k, (notes, score) in enumerate(flights):
        colour = _COLOURS[k % len(_COLOURS)]
        if k == 0:
            _shade_pattern(axes, notes)
        phase = notes.phase(PATTERN)
        if notes.commanded is not None and phase is not None:
            height = -float(notes.commanded.points_ned_m[0, 2])
            axes.plot(
                [phase.start_us * 1e-6, phase.end_us * 1e-6], [height, height], color=_COMMANDED,
                linewidth=4.5, alpha=0.55, solid_capstyle="butt",
            )  # fmt: skip
        team = len(flights) > 1
        for track, is_truth in ((score.estimate, False), (score.truth, True)):
            if track is not None:
                times, shown = _shown(track, notes).drawn()
                style = _truth_style(colour, team) if is_truth else _estimate_style(colour, team)
                axes.plot(times, -shown[:, 2], **style)
    axes.set_ylabel("height above\nhome, m", fontsize=9, color=INK)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))


def _draw_error(axes: Any, flights: list[tuple[FlightNotes, FlightScore]]) -> None:
    for k, (notes, score) in enumerate(flights):
        if k == 0:
            _shade_pattern(axes, notes)
        if not len(score.error_m):
            continue
        colour = _COLOURS[k % len(_COLOURS)]
        axes.plot(*broken_at_gaps(score.error_time_s, score.error_m), color=colour, linewidth=1.1)
        rms = score.path_rms_error_m or 0.0
        axes.axhline(rms, color=colour, linewidth=0.8, linestyle="--")
        axes.annotate(
            f"RMS {rms:.2f} m", (1.0, rms), xycoords=("axes fraction", "data"), xytext=(-4, 3 + 9 * k),
            textcoords="offset points", ha="right", fontsize=8, color=colour,
        )  # fmt: skip
    if not any(len(score.error_m) for _, score in flights):
        axes.text(
            0.5, 0.5, "the path was not flown", transform=axes.transAxes, ha="center", va="center",
            fontsize=9, color=INK,
        )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    reference = flights[0][1].reference
    axes.set_ylabel(f"distance to path, m\n({reference})", fontsize=9, color=INK)
