"""What was received of a vehicle: gaps in it, and positions and times that no vehicle can have.

The one definition of both, for scores, verdicts and pictures of flights, and for reports and comparisons of
logs.
"""

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

__all__ = [
    "GAP_S",
    "GAP_US",
    "Received",
    "broken_at_gaps",
    "counted_words",
    "gaps_of",
    "interpolated",
    "not_in_gaps",
    "received_positions",
    "received_times",
    "together",
]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

GAP_S: Final = 2.0
"""Between two messages that are farther apart nothing is known of a vehicle. Autopilots send their position
at least once a second.
"""
GAP_US: Final = 2_000_000

NO_PLACE: Final = "no_place_on_earth"
POSITION_JUMPED: Final = "position_jumped"
TIME_JUMPED: Final = "time_jumped"

_ALT_M: Final = (-1_000.0, 100_000.0)  # the Dead Sea with room below, and the edge of space
_FASTEST_M_S: Final = 1_000.0  # three times the speed of sound
_CORRECTED_M: Final = 1_000.0  # a navigation filter moves its position at once, when it has drifted
_LONGEST_SILENCE_US: Final = 3_600_000_000
_LATE_US: Final = 1_000_000  # late frames of a radio are no jump of the clock


@dataclass(frozen=True, slots=True, kw_only=True)
class Received:
    """The rows of a table that a vehicle can have sent.

    Attributes:
        rows: (n,) their positions in the table; times strictly increase.
        left_out: number of other rows, by reason. Late and repeated rows are left out and not counted: links
            deliver such frames.
    """

    rows: Rows
    left_out: Mapping[str, int] = field(default_factory=dict)


def received_times(time_us: NDArray[np.int64]) -> Received:
    """The rows of a stream whose times advance, of times in the order of arrival.

    As few rows as possible are left out, so that a single wrong stamp costs only its own row. Where times
    advance by more than an hour at once, the longer part counts.
    """
    times = np.asarray(time_us, dtype=np.int64)
    rows = _longest_increasing(times)
    parts = np.split(rows, np.flatnonzero(np.diff(times[rows]) > _LONGEST_SILENCE_US) + 1)
    rows = max(parts, key=len)
    others = np.setdiff1d(np.arange(len(times)), rows)
    if not len(others):
        return Received(rows=rows)
    before = np.clip(np.searchsorted(rows, others) - 1, 0, len(rows) - 1)
    jumped = int(np.count_nonzero(np.abs(times[others] - times[rows[before]]) > _LATE_US))
    return Received(rows=rows, left_out=_counts({TIME_JUMPED: jumped}))


def received_positions(time_us: NDArray[np.int64], lat_deg: Array, lon_deg: Array, alt_m: Array) -> Received:
    """The rows of a stream of positions that a vehicle can have sent.

    Left out are places that are not on Earth, times that jump, and positions that no vehicle can have reached
    from the others: of two groups that are too far apart for each other the larger one counts.

    Args:
        time_us: (n,) vehicle time, in the order of arrival.
        lat_deg, lon_deg, alt_m: (n,) each.
    """
    on_earth = (
        (np.abs(lat_deg) <= 90.0) & (np.abs(lon_deg) <= 180.0) & (alt_m >= _ALT_M[0]) & (alt_m <= _ALT_M[1])
    )
    rows = np.flatnonzero(on_earth)
    in_time = received_times(np.asarray(time_us, dtype=np.int64)[rows])
    rows = rows[in_time.rows]
    reached = np.arange(len(rows))
    if len(rows) > 1:
        lat, lon, alt = lat_deg[rows], lon_deg[rows], alt_m[rows]
        frame = LocalFrame(GeodeticPosition(lat_deg=float(lat[0]), lon_deg=float(lon[0]), alt_m=0.0))
        place_m = np.column_stack(frame.ned_from_geodetic(lat, lon, alt))
        reached = _reached(1e-6 * time_us[rows].astype(np.float64), place_m)
    counts = {
        NO_PLACE: int(np.count_nonzero(~on_earth)),
        **in_time.left_out,
        POSITION_JUMPED: len(rows) - len(reached),
    }
    return Received(rows=rows[reached], left_out=_counts(counts))


def gaps_of(time_s: Array, start_s: float = -np.inf, end_s: float = np.inf) -> list[tuple[float, float]]:
    """Begin and end of each gap between increasing times, within a span."""
    found = []
    for row in np.flatnonzero(np.diff(time_s) > GAP_S).tolist():
        begin, end = max(start_s, float(time_s[row])), min(end_s, float(time_s[row + 1]))
        if begin < end:
            found.append((begin, end))
    return found


def not_in_gaps(at_s: Array, time_s: Array) -> NDArray[np.bool_]:
    """Whether each time is within increasing times, and in none of their gaps."""
    if len(time_s) < 2:
        return np.isin(at_s, time_s)
    after = np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1)
    known: NDArray[np.bool_] = (at_s >= time_s[0]) & (at_s <= time_s[-1])
    return known & ((time_s[after] - time_s[after - 1] <= GAP_S) | (time_s[after] == at_s))


def interpolated(at: Array | float, times: Array, values: Array, *, gap: float = GAP_S) -> Array:
    """Values (n,) or (n, k) of increasing times, at other times: NaN where nothing was received.

    Args:
        at: (m,) times or one, in the unit of `times`.
        times: (n,), at least one.
        values: at these times.
        gap: times that are farther apart have nothing between them; beyond the ends the last value holds for
            as long. `GAP_US` for microseconds.
    """
    at = np.asarray(at, dtype=np.float64)
    after = np.clip(np.searchsorted(times, at), 0, len(times) - 1)
    before = np.maximum(after - 1, 0)
    known = (at >= times[0] - gap) & (at <= times[-1] + gap)
    known &= (times[after] - times[before] <= gap) | (times[after] == at) | (at > times[-1])
    columns = [np.interp(at, times, column) for column in np.atleast_2d(values.T)]
    found = np.where(known, columns, np.nan).T
    return np.asarray(found if values.ndim > 1 else found[..., 0])


def broken_at_gaps(time_s: Array, *columns: Array) -> tuple[Array, ...]:
    """Times (n,) and columns (n,) or (n, k) with a row of NaN in each gap, so that no line is drawn there."""
    breaks = np.flatnonzero(np.diff(time_s) > GAP_S) + 1
    return tuple(
        np.insert(np.asarray(column, dtype=np.float64), breaks, np.nan, axis=0)
        for column in (time_s, *columns)
    )


def together(*counts: Mapping[str, int]) -> dict[str, int]:
    """The sums of counts by reason."""
    reasons = sorted({reason for some in counts for reason in some})
    return {reason: sum(some.get(reason, 0) for some in counts) for reason in reasons}


def counted_words(left_out: Mapping[str, int]) -> str:
    """Counts by reason as text."""
    return ", ".join(f"{reason.replace('_', ' ')} {count}" for reason, count in left_out.items())


def _counts(by_reason: Mapping[str, int]) -> dict[str, int]:
    return {reason: count for reason, count in by_reason.items() if count}


def _longest_increasing(times: NDArray[np.int64]) -> Rows:
    """Rows of the longest strictly increasing series, by patience sorting."""
    everything = np.arange(len(times), dtype=np.int64)
    if not np.any(np.diff(times) <= 0):
        return everything
    ends: list[int] = []  # the smallest time with which a series of each length ends, and its row
    rows: list[int] = []
    before = np.full(len(times), -1, dtype=np.int64)
    for row, time in enumerate(times.tolist()):
        length = bisect_left(ends, time)
        before[row] = rows[length - 1] if length else -1
        ends[length : length + 1] = [time]
        rows[length : length + 1] = [row]
    found = []
    row = rows[-1]
    while row >= 0:
        found.append(row)
        row = int(before[row])
    return np.array(found[::-1], dtype=np.int64)


def _reached(time_s: Array, place_m: Array) -> Rows:
    """Rows that can be reached from each other: the largest group, and what is near it in time and place."""

    def apart(a: int, b: int) -> bool:
        reach_m = _CORRECTED_M + _FASTEST_M_S * abs(float(time_s[b] - time_s[a]))
        return float(np.linalg.norm(place_m[b] - place_m[a])) > reach_m

    steps_m = np.linalg.norm(np.diff(place_m, axis=0), axis=1)
    far = np.flatnonzero(steps_m > _CORRECTED_M + _FASTEST_M_S * np.diff(time_s)) + 1
    groups = np.split(np.arange(len(time_s)), far)
    largest = max(range(len(groups)), key=lambda k: len(groups[k]))
    kept = [groups[largest]]
    for group in groups[largest + 1 :]:
        if not apart(int(kept[-1][-1]), int(group[0])):
            kept.append(group)
    for group in reversed(groups[:largest]):
        if not apart(int(group[-1]), int(kept[0][0])):
            kept.insert(0, group)
    return np.concatenate(kept)
