"""The picture of an orbit: over ground, around the target, and distance and height over time."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from estimators.reports.figure import INK, blank_figure, save_figure, tidy
from missions.base.report import Debriefing
from missions.flown.picture import draw_run
from missions.orbit.options import OrbitOptions
from missions.orbit.score import OrbitTruth, orbit_truth

_GREY: Final = "#9aa3af"
_BLUE: Final = "#1769aa"
_RED: Final = "#c2410c"
_GPS_LOST: Final = "#fee2e2"


def draw_orbit(path: Path, title: str, debriefing: Debriefing, options: OrbitOptions) -> None:
    """Draw `track.png`. Without truth (a vehicle that is not embedded) the standard picture of a flight is
    drawn.

    Args:
        path: the file; it must not exist.
        title: title above the picture.
        debriefing: of the flight.
        options: of the first vehicle.
    """
    notes, _ = debriefing.flights[0]
    truth = orbit_truth(debriefing.records, notes.system_id)
    if truth is None or not notes.phases:
        draw_run(path, title, list(debriefing.flights))
        return
    flown = truth.during(notes.phases[0].start_us, notes.phases[-1].end_us)
    figure = blank_figure(12.0, 11.0)
    grid = figure.add_gridspec(3, 2, height_ratios=(3.0, 1.0, 1.0))
    ground, around = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    distance = figure.add_subplot(grid[1, :])
    height = figure.add_subplot(grid[2, :], sharex=distance)
    figure.suptitle(title, fontsize=13, fontweight="bold", color=INK)
    phase = notes.phase("orbit")
    lost_s, back_s = notes.marks.get("gps_lost_at_s"), notes.marks.get("gps_back_at_s")
    orbit = None if phase is None else flown.during(phase.start_us, phase.end_us)
    entry = None
    if lost_s is not None:
        end_us = flown.time_s[-1] * 1e6 if phase is None else phase.end_us
        entry = flown.during(round(lost_s * 1e6), round(end_us))
    _draw_ground(ground, flown, orbit)
    _draw_around(around, entry if entry is not None else orbit, orbit, options)
    for axes in (distance, height):
        if lost_s is not None:
            axes.axvspan(lost_s, back_s or flown.time_s[-1], color=_GPS_LOST, zorder=0, linewidth=0)
    thin = max(1, len(flown.time_s) // 8000)
    shown = flown.broken_at_gaps(thin)
    distance.plot(shown.time_s, shown.radius_m, color=_BLUE, linewidth=1.0)
    distance.axhline(options.radius_m, color=_GREY, linewidth=3.0, alpha=0.6)
    distance.set_ylim(0.0, max(3.0 * options.radius_m, 1.2 * options.entry_distance_m))
    distance.set_ylabel("distance to\ntarget, m", fontsize=9, color=INK)
    distance.tick_params(labelbottom=False)
    if orbit is not None and len(orbit.time_s):
        error = 100.0 * (float(orbit.radius_m.mean()) / options.radius_m - 1.0)
        distance.set_title(
            f"mean {orbit.radius_m.mean():.1f} m ({error:+.1f} %), standard deviation "
            f"{orbit.radius_m.std():.1f} m; "
            "GPS off where red",
            fontsize=9,
            color=INK,
        )
    height.plot(shown.time_s, -shown.aircraft_ned_m[:, 2], color=_BLUE, linewidth=1.0)
    height.axhline(options.own_altitude_m, color=_GREY, linewidth=3.0, alpha=0.6)
    height.set_ylim(bottom=0.0)
    height.set_ylabel("height, m", fontsize=9, color=INK)
    height.set_xlabel("vehicle time, s", fontsize=9, color=INK)
    for axes in (ground, around, distance, height):
        tidy(axes)
    save_figure(figure, path)


def _draw_ground(axes: Any, flown: OrbitTruth, orbit: OrbitTruth | None) -> None:
    track, target = flown.aircraft_ned_m, flown.target_ned_m
    thin = max(1, len(track) // 8000)
    shown = flown.broken_at_gaps(thin)
    north, east, _ = shown.aircraft_ned_m.T
    axes.plot(east, north, color=_GREY, linewidth=0.9, label="aircraft")
    if orbit is not None and len(orbit.time_s):
        north, east, _ = orbit.broken_at_gaps(thin).aircraft_ned_m.T
        axes.plot(east, north, color=_BLUE, linewidth=0.9, label="its orbit")
    north, east, _ = shown.target_ned_m.T
    axes.plot(east, north, color=_RED, linewidth=2.0, label="target")
    axes.plot(target[-1, 1], target[-1, 0], "o", color=_RED, markersize=6)
    axes.plot(
        track[0, 1], track[0, 0], "o", color="#15803d", markersize=8, markeredgecolor="white", label="start"
    )
    axes.plot(
        track[-1, 1], track[-1, 0], "s", color="#b91c1c", markersize=6, markeredgecolor="white", label="end"
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("over ground", fontsize=10, color=INK)
    axes.set_xlabel("east, m", fontsize=9, color=INK)
    axes.set_ylabel("north, m", fontsize=9, color=INK)
    axes.legend(fontsize=8, frameon=False)


def _draw_around(
    axes: Any, entry: OrbitTruth | None, orbit: OrbitTruth | None, options: OrbitOptions
) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(
        options.radius_m * np.sin(angle),
        options.radius_m * np.cos(angle),
        color=_GREY,
        linewidth=5.0,
        alpha=0.6,
    )
    for part, colour, width in ((entry, _GREY, 1.0), (orbit, _BLUE, 0.8)):
        if part is not None and len(part.time_s):
            shown = part.broken_at_gaps()
            offset = shown.aircraft_ned_m - shown.target_ned_m
            axes.plot(offset[:, 1], offset[:, 0], color=colour, linewidth=width)
    axes.plot(0.0, 0.0, "o", color=_RED, markersize=7)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("around the target", fontsize=10, color=INK)
    axes.set_xlabel("east of target, m", fontsize=9, color=INK)
    axes.set_ylabel("north of target, m", fontsize=9, color=INK)
