"""What the picture of a flight has of a search for a tag: the searched area, the target, the detection."""

from typing import Any, Final

import numpy as np

from estimators.received import interpolated
from estimators.reports.figure import INK
from flightsim.foundation.geodesy import LocalFrame
from missions.base.report import Debriefing
from missions.flown.targets import true_targets

__all__ = ["draw_search"]

_AREA: Final = "#15803d"
_FOUND: Final = "#be185d"
_TRUE: Final = "#dc2626"


def draw_search(debriefing: Debriefing, words: str, axes: Any) -> None:
    """Draw the searched area, true places, and from where the tag was detected at which place.

    Args:
        debriefing: of the flight.
        words: what the search has found.
        axes: those of the track from above.
    """
    axes.text(0.01, 0.015, words, transform=axes.transAxes, fontsize=9, color=INK, zorder=10)
    notes, score = debriefing.flights[0]
    if notes.commanded is None:
        return
    points = notes.commanded.points_ned_m
    (south, west), (north, east) = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    corners = [west, east, east, west], [south, south, north, north]
    axes.fill(*corners, facecolor=_AREA, alpha=0.06, edgecolor=_AREA, label="searched area", zorder=0)
    for number, (_, place) in enumerate(true_targets(debriefing.records, LocalFrame(notes.commanded.origin))):
        axes.plot(place[:, 1], place[:, 0], color=_TRUE, linewidth=1.0, zorder=4)
        axes.plot(place[-1, 1], place[-1, 0], "+", color=_TRUE, markersize=13, zorder=9,
                  label="target, true" if number == 0 else None)  # fmt: skip
    marks = notes.marks
    if "search_north_m" not in marks:
        return
    found = np.array([marks["search_east_m"], marks["search_north_m"]])
    axes.plot(*found, "o", color=_FOUND, markersize=10, fillstyle="none", zorder=9, label="tag, as detected")
    if score.estimate is not None and len(score.estimate.time_s):
        at = interpolated(marks["search_exposed_us"] * 1e-6, score.estimate.time_s, score.estimate.pos_ned_m)
        axes.plot([at[1], found[0]], [at[0], found[1]], color=_FOUND, linestyle=":", zorder=8,
                  label="line of sight")  # fmt: skip
