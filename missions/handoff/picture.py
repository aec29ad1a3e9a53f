"""The picture of a handoff: both tracks in a common frame, modes of the pose, and scores over time."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import broken_at_gaps
from estimators.reports.figure import INK, blank_figure, save_figure, tidy
from flightsim.foundation.vectors import ImagePoint
from missions.base.report import Debriefing
from missions.flown.camera_picture import CameraPicture, PicturesOf, clip, png
from missions.handoff.figures import HandoffTruth, handoff_truth, marks_of
from missions.handoff.team import HandoffTeam
from missions.handoff.watch import Moment

_CLIP_HZ: Final = 10  # four times as fast as the flight
_AFTER_US: Final = 20_000_000
_GREY: Final = "#9aa3af"
_BLUE: Final = "#1769aa"
_RED: Final = "#c2410c"
_GREEN: Final = "#15803d"
_LINES: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b45309", "#0f766e", "#be185d", "#64748b")


def draw_handoff(path: Path, title: str, team: HandoffTeam, debriefing: Debriefing) -> None:
    """Draw `track.png`. Without truth (aircraft that are not embedded) the frame of the tracks is the handoff
    aircraft's own dead reckoning, which is not drawn; then only pose and scores are.

    Args:
        path: the file; it must not exist.
    """
    end_us = debriefing.flights[0][0].marks.get("gps_back_at_s", math.inf) * 1e6
    moments = [moment for moment in team.watch.moments if moment.time_us <= end_us] or team.watch.moments
    truth = handoff_truth(debriefing.records, [flight[0].system_id for flight in debriefing.flights])
    figure = blank_figure(12.0, 12.0)
    grid = figure.add_gridspec(3, 2, height_ratios=(3.0, 1.2, 1.2))
    ground, pose = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    bearing = figure.add_subplot(grid[1, :])
    score = figure.add_subplot(grid[2, :], sharex=bearing)
    figure.suptitle(title, fontsize=13, fontweight="bold", color=INK)
    marks = marks_of(team, debriefing)
    begin_s = marks.get("GPS lost", moments[0].time_us * 1e-6)
    if truth is not None:
        _draw_ground(ground, truth, moments, begin_s, team.options.radius_m)
    _draw_modes(pose, moments, begin_s)
    _draw_bearing(bearing, truth, moments)
    _draw_scores(score, moments, team.options.estimator.decision)
    for axes in (bearing, score):
        for line, (name, time_s) in enumerate(marks.items()):
            axes.axvline(time_s, color=_GREY, linewidth=1.0, linestyle="--")
            if axes is bearing:
                height = 1.02 + 0.1 * (len(marks) - 1 - line)
                axes.text(time_s, height, name, fontsize=8, color=INK, transform=axes.get_xaxis_transform())
    for axes in (ground, pose, bearing, score):
        tidy(axes)
    save_figure(figure, path)


def camera_pictures(
    team: HandoffTeam, system_ids: Sequence[int], pictures_of: PicturesOf
) -> dict[str, bytes]:
    """What each camera saw at the decision, or at the end without one, as a picture; and from the contact on,
    until some time after that, as a video. The found points and the tracks are drawn in; the decided track
    and that of the tracker's target are marked.
    """
    moments = team.watch.moments
    if not moments:
        return {}
    shown_us = next((m for m in moments if m.estimate.decided), moments[-1]).time_us
    times_us = [moment.time_us for moment in moments]
    found = {}
    for index, (system_id, seen) in enumerate(zip(system_ids, team.watch.seen, strict=True)):

        def drawn(
            picture: CameraPicture, index: int = index, seen: dict[int, dict[int, ImagePoint]] = seen
        ) -> NDArray[np.uint8]:
            moment = moments[max(0, bisect_right(times_us, picture.time_us) - 1)]
            estimate = moment.tracker if index else moment.estimate
            marked = 0 if estimate is None else estimate.track
            tracks = seen.get(picture.time_us, {})
            return picture.drawn([(point, str(k), k == marked) for k, point in tracks.items()])

        kept = pictures_of(system_id)
        if kept:
            name = f"camera{system_id}.png"
            found[name] = png(drawn(min(kept, key=lambda one: abs(one.time_us - shown_us))))
        video = clip(
            (drawn(one) for one in kept if times_us[0] <= one.time_us <= shown_us + _AFTER_US), _CLIP_HZ
        )
        if video:
            found[f"tracks{system_id}.mp4"] = video
    return found


def _draw_ground(
    axes: Any, truth: HandoffTruth, moments: list[Moment], begin_s: float, radius_m: float
) -> None:
    during = truth.time_us >= begin_s * 1e6
    during &= truth.time_us <= moments[-1].time_us
    for aircraft, colour, name in zip(
        truth.aircraft, (_BLUE, _RED), ("handoff aircraft", "tracker"), strict=True
    ):
        thin = max(1, np.count_nonzero(during) // 4000)
        _, own = broken_at_gaps(1e-6 * truth.time_us[during][::thin], aircraft[during][::thin])
        axes.plot(own[:, 1], own[:, 0], color=colour, linewidth=0.6, alpha=0.4, label=name)
    for number, target in enumerate(truth.targets):
        _, shown = broken_at_gaps(1e-6 * truth.time_us[during], target[during])
        axes.plot(
            shown[:, 1],
            shown[:, 0],
            color=_GREY,
            linewidth=2.5,
            label="true targets" if number == 0 else None,
        )
    decided = [moment.estimate for moment in moments if moment.estimate.decided]
    tracked = [moment.tracker for moment in moments if moment.tracker and moment.tracker.track]
    for index, estimates, colour, name in (
        (1, tracked, _RED, "tracker's track"),
        (0, decided, _BLUE, "decided track"),
    ):
        if estimates:
            places = truth.placed(index, estimates)
            axes.plot(places[:, 1], places[:, 0], color=colour, linewidth=1.2, label=name)
    if len(truth.targets):
        # the aircraft fly on for some seconds when they leave
        places = truth.targets[:, during].reshape(-1, 2)
        places = places[np.isfinite(places[:, 0])]
    if len(truth.targets) and len(places):
        margin = 2.5 * radius_m
        axes.set_xlim(places[:, 1].min() - margin, places[:, 1].max() + margin)
        axes.set_ylim(places[:, 0].min() - margin, places[:, 0].max() + margin)
    axes.set_aspect("equal", adjustable="box")
    axes.set_title("over ground, from the first aircraft's start", fontsize=10, color=INK)
    axes.set_xlabel("east, m", fontsize=9, color=INK)
    axes.set_ylabel("north, m", fontsize=9, color=INK)
    axes.legend(fontsize=8, frameon=False, loc="best")


def _draw_modes(axes: Any, moments: list[Moment], begin_s: float) -> None:
    """The modes of the pose in the first seconds without GPS, in the handoff aircraft's level frame."""
    angle = np.linspace(0.0, 2.0 * math.pi, 61)
    chosen = [moment for moment in moments if moment.modes and moment.time_us >= begin_s * 1e6][:60]
    for age, moment in enumerate(chosen):
        shade = 0.25 + 0.75 * age / max(1, len(chosen) - 1)
        for mode in moment.modes:
            values, vectors = np.linalg.eigh(mode.covariance[:2, :2])
            radii = 2.0 * np.sqrt(np.maximum(values, 0.0))
            outline = vectors @ (radii[:, None] * np.array([np.cos(angle), np.sin(angle)]))
            axes.plot(
                mode.right_m + outline[1],
                mode.forward_m + outline[0],
                color=_BLUE if moment.estimate.converged else _RED,
                alpha=shade * max(0.15, mode.weight),
                linewidth=0.9,
            )
    axes.plot([], [], color=_RED, label="modes, not converged")
    axes.plot([], [], color=_BLUE, label="converged")
    axes.plot(0.0, 0.0, "^", color=INK, markersize=8, label="handoff aircraft")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("tracker in the level frame, 2 sigma, first 30 s", fontsize=10, color=INK)
    axes.set_xlabel("right, m", fontsize=9, color=INK)
    axes.set_ylabel("forward, m", fontsize=9, color=INK)
    axes.legend(fontsize=8, frameon=False, loc="best")


def _draw_bearing(axes: Any, truth: HandoffTruth | None, moments: list[Moment]) -> None:
    for moment in moments:
        for mode in moment.modes:
            axes.plot(
                moment.time_us * 1e-6,
                math.degrees(mode.bearing_rad),
                ".",
                markersize=3.0,
                color=_BLUE,
                alpha=max(0.1, mode.weight),
            )
    if truth is not None and moments:
        times = np.array([moment.time_us for moment in moments], dtype=np.float64)
        own, other = ([truth.at(time, aircraft) for time in times] for aircraft in truth.aircraft)
        true = [
            math.degrees(math.remainder(math.atan2(b[1] - a[1], b[0] - a[0]) - a[2], math.tau))
            for a, b in zip(own, other, strict=True)
        ]
        axes.plot(times * 1e-6, true, ".", markersize=2.0, color=_GREY, label="true")
    axes.set_ylabel("bearing of the\ntracker, degrees", fontsize=9, color=INK)
    axes.set_ylim(-180.0, 180.0)
    axes.tick_params(labelbottom=False)


def _draw_scores(axes: Any, moments: list[Moment], decision: float) -> None:
    numbers = sorted({number for moment in moments for number in moment.scores})
    for k, number in enumerate(numbers):
        own = [moment for moment in moments if number in moment.scores]
        axes.plot(
            [moment.time_us * 1e-6 for moment in own],
            [moment.scores[number] for moment in own],
            ".-",
            markersize=2.5,
            linewidth=1.0,
            color=_LINES[k % len(_LINES)],
            label=f"track {number}",
        )
    axes.axhline(decision, color=_GREEN, linewidth=1.0, linestyle=":")
    axes.set_ylim(-0.02, 1.02)
    axes.set_ylabel("probability", fontsize=9, color=INK)
    axes.set_xlabel("vehicle time, s", fontsize=9, color=INK)
    if numbers:
        axes.legend(fontsize=7, frameon=False, ncols=min(8, len(numbers)), loc="center left")
