"""The figures of a search for a tag, from the notes of the flight and the truth in its log."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.received import GAP_US, interpolated
from flightsim.foundation.geodesy import LocalFrame
from missions.base.options import FlightOptions
from missions.base.report import Debriefing
from missions.flown.targets import true_targets

__all__ = ["search_figures"]


def search_figures(debriefing: Debriefing, options: FlightOptions) -> Mapping[str, Any]:
    """`search` in `summary.json`.

    Its `search_s` is the time from the search altitude to the exposure of the picture with the tag, or to the
    end of the search; `error_m` the distance of the tag's place from the nearest true target at that time.
    """
    notes = debriefing.flights[0][0]
    marks = notes.marks
    north_m, east_m = marks.get("search_north_m"), marks.get("search_east_m")
    error_m = None
    if north_m is not None and east_m is not None and notes.commanded is not None:
        at_us = marks["search_exposed_us"]
        distances = [
            math.dist(interpolated(at_us, times, place, gap=GAP_US), (north_m, east_m))
            for times, place in true_targets(debriefing.records, LocalFrame(notes.commanded.origin))
        ]
        if distances and np.isfinite(distances).all():
            error_m = min(distances)
    return {
        "tag_id": options.tag_id,
        "found": bool(marks.get("search_found", 0.0)),
        "search_s": round(marks.get("search_s", 0.0), 3),
        "limit_s": options.search_time_s,
        "frames": int(marks.get("search_frames", 0.0)),
        "north_m": _rounded(north_m),
        "east_m": _rounded(east_m),
        "distance_m": _rounded(marks.get("search_distance_m")),
        "error_m": _rounded(error_m),
    }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
