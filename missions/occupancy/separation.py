"""Smallest distance between the vehicles of a team in the air, from the truth in the log."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import not_in_gaps
from flightsim.foundation.geodesy import LocalFrame
from missions.flown.records import FlightRecords, place_of, positions_ned_m

Array = NDArray[np.float64]

_STEP_S: Final = 0.1
_AIRBORNE_M: Final = 10.0  # height above the start; vehicles next to each other on the ground are not counted


def least_separation_m(records: FlightRecords, system_ids: list[int]) -> float | None:
    """Smallest distance of two vehicles while both were above 10 m; None: never, or no truth in the log."""
    tracks: list[tuple[Array, Array]] = []
    frame: LocalFrame | None = None
    for system_id in system_ids:
        table = records.truth(system_id)
        if len(table) < 2:
            return None
        frame = frame or LocalFrame(place_of(table[0]))
        places = positions_ned_m(table, frame)
        tracks.append((table["time_usec"].astype(np.float64) * 1e-6, places))
    if len(tracks) < 2:
        return None
    start_s, end_s = max(time[0] for time, _ in tracks), min(time[-1] for time, _ in tracks)
    at_s = np.arange(start_s, end_s, _STEP_S)
    for time, _ in tracks:
        at_s = at_s[not_in_gaps(at_s, time)]
    if not len(at_s):
        return None
    least = np.inf
    even = [np.column_stack([np.interp(at_s, time, axis) for axis in places.T]) for time, places in tracks]
    for k, own in enumerate(even):
        for other in even[k + 1 :]:
            up = (own[:, 2] < own[0, 2] - _AIRBORNE_M) & (other[:, 2] < other[0, 2] - _AIRBORNE_M)
            if up.any():
                least = min(least, float(np.linalg.norm(own[up] - other[up], axis=1).min()))
    return least if np.isfinite(least) else None
