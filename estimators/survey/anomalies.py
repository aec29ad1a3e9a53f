"""Anomalies on survey lines: matched filters along each line, and what neighbouring lines have seen together.

The differential measurement of a line is whitened by the covariance of noise, map error and an unknown level,
and compared with bumps of several widths, and with their slopes, for sources whose field is one-sided or not
(Kay, Fundamentals of Statistical Signal Processing II, section 4.4; as `estimators.occupancy.significance`
does for one pass). Peaks of neighbouring lines are one anomaly, explained by one dipole where possible.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.survey.gridding import block_means
from estimators.survey.sources import DipoleSource, fitted_dipole

__all__ = ["LEAST_RATIO", "LinePeak", "Search", "SurveyAnomaly", "line_peaks", "survey_anomalies"]

Array = NDArray[np.float64]

LEAST_RATIO: Final = 5.5
"""Smallest signal-to-noise ratio of a peak: the filters of a hundred kilometres of lines make ten thousand
independent comparisons, and noise exceeds it in one of two thousand such surveys.
"""

_POINT_M: Final = 10.0  # of track, over which readings are averaged
_WIDTHS_M: Final = (60.0, 90.0, 130.0, 180.0, 260.0)  # bumps (1 + r^2 / w^2)^(-5/2): a dipole's decay
_MOST: Final = 200  # anomalies of a survey
_LEAST_REACH_M: Final = 150.0
_REACH: Final = 1.5  # in widths: peaks of other lines within it are of the same anomaly
_TOUCHED_M: Final = 1000.0  # from a source: lines within it are searched again without its field
_REMAINDER: Final = 0.1  # of the ratio of a source, that may be left of it
_FIT_M: Final = 350.0
_FIT: Final = 3.0  # in widths: readings that a dipole is fitted to
_WINDOW: Final = 300  # points whitened together
_OVERLAP: Final = 100
_LEAST_POINTS: Final = 10
_UNKNOWN_LEVEL: Final = 30.0  # standard deviation of the level, in multiples of a point's error
_DRIFT_M: Final = 10_000.0  # along which the level may change by one point's error


@dataclass(frozen=True, slots=True, kw_only=True)
class LinePeak:
    """An anomaly on one line.

    Attributes:
        line: number of the line.
        time_s: vehicle time.
        north_m, east_m: place.
        peak_nt: largest differential measurement near it, with its sign.
        ratio: signal-to-noise ratio of the matched filter.
        width_m: width of the bump that fits best.
    """

    line: int
    time_s: float
    north_m: float
    east_m: float
    peak_nt: float
    ratio: float
    width_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyAnomaly:
    """An anomaly of a survey, seen on one line or on several.

    Attributes:
        north_m, east_m: place of its source, or of its strongest peak where no dipole explains it.
        peak_nt, ratio, width_m, time_s: of its strongest peak.
        lines: numbers of the lines with a peak.
        source: the dipole that explains it; None: none does.
    """

    north_m: float
    east_m: float
    peak_nt: float
    ratio: float
    width_m: float
    time_s: float
    lines: tuple[int, ...]
    source: DipoleSource | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Search:
    """The readings that are searched; arrays (n,).

    Attributes:
        lines: numbers of the lines.
        line_of: number of each reading's line; -1: none.
        north_m, east_m, height_m: places.
        differential_nt: readings less map; NaN off the lines.
        direction_ned: (3,) direction of the Earth's field.
    """

    lines: Sequence[int]
    line_of: NDArray[np.int64]
    north_m: Array
    east_m: Array
    height_m: Array
    differential_nt: Array
    direction_ned: Array

    def dipole_at(self, peak: LinePeak, left_nt: Array) -> DipoleSource | None:
        """The dipole that explains a peak in what is left of the differential measurements."""
        reach_m = max(_FIT_M, _FIT * peak.width_m)
        own = (np.hypot(self.north_m - peak.north_m, self.east_m - peak.east_m) <= reach_m) & (
            self.line_of >= 0
        )
        number = self.line_of[own]
        blocks = [
            _blocks(
                np.column_stack((self.north_m, self.east_m, self.height_m, left_nt))[own][number == line],
                line,
            )
            for line in np.unique(number).tolist()
        ]
        table = np.concatenate(blocks)
        return fitted_dipole(
            table[:, :3],
            table[:, 3],
            table[:, 4].astype(np.int64),
            near_ne_m=(peak.north_m, peak.east_m),
            direction_ned=self.direction_ned,
        )

    def field_of(self, source: DipoleSource) -> Array:
        """Field (n,) of a source at all readings."""
        return source.field_nt(self.north_m, self.east_m, self.height_m, self.direction_ned)

    def lines_near(self, north_m: float, east_m: float, within_m: float) -> list[int]:
        """Lines with readings near a place."""
        near = np.hypot(self.north_m - north_m, self.east_m - east_m) <= within_m
        return [line for line in np.unique(self.line_of[near]).tolist() if line >= 0]


def line_peaks(
    line: int,
    time_s: Array,
    north_m: Array,
    east_m: Array,
    difference_nt: Array,
    *,
    noise_nt: float,
    map_error_nt: float = 0.0,
    correlation_m: float = 100.0,
) -> list[LinePeak]:
    """Peaks of one line.

    Args:
        line: its number.
        time_s, north_m, east_m, difference_nt: (n,) readings of the line less the map.
        noise_nt: standard deviation of a reading, white.
        map_error_nt, correlation_m: error of the map, and its correlation distance (exponential).
    """
    if len(time_s) < _LEAST_POINTS:
        return []
    points, values = block_means(np.column_stack((north_m, east_m)), difference_nt, _POINT_M)
    _, times = block_means(np.column_stack((north_m, east_m)), time_s, _POINT_M)
    flown_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    # at even distances the filters of all lines are the same
    along = np.arange(0.0, flown_m[-1], _POINT_M)
    if len(along) < _LEAST_POINTS:
        return []
    columns = (*points.T, times, values)
    north, east, time, value = (np.interp(along, flown_m, column) for column in columns)
    error_nt = max(noise_nt, 1e-6) / math.sqrt(max(1, round(len(time_s) / len(along))))
    found: list[LinePeak] = []
    start = 0
    while True:
        part = slice(max(0, min(start, len(along) - _WINDOW)), min(len(along), start + _WINDOW))
        count = part.stop - part.start
        ratios, widths = _ratios(value[part], _filters(count, error_nt, map_error_nt, correlation_m))
        for k, ratio, width_m in _peaks(along[part], ratios, widths):
            near = np.abs(along[part] - along[part][k]) <= width_m
            level = value[part] - np.median(value[part])
            found.append(
                LinePeak(
                    line=line,
                    time_s=float(time[part][k]),
                    north_m=float(north[part][k]),
                    east_m=float(east[part][k]),
                    peak_nt=float(level[near][np.argmax(np.abs(level[near]))]),
                    ratio=ratio,
                    width_m=width_m,
                )
            )
        if part.stop == len(along):
            return found
        start += _WINDOW - _OVERLAP


def survey_anomalies(search: Search, find: Callable[[int, Array], Sequence[LinePeak]]) -> list[SurveyAnomaly]:
    """The anomalies of all lines, the strongest first.

    The strongest peak is explained by a dipole where one fits, its field is taken out of all readings, and
    the lines are searched again, until no peak is left. Peaks that remain beside an anomaly are part of it.

    Args:
        search: the readings.
        find: the peaks of a line (number, differential measurements of all readings).
    """
    left = search.differential_nt.copy()
    peaks = {line: list(find(line, left)) for line in search.lines}
    found: list[SurveyAnomaly] = []
    while len(found) < _MOST:
        free = [peak for own in peaks.values() for peak in own if not _part_of(peak, found)]
        if not free:
            break
        first = max(free, key=lambda peak: peak.ratio)
        reach_m = max(_LEAST_REACH_M, _REACH * first.width_m)
        near = [p for p in free if math.dist((p.north_m, p.east_m), (first.north_m, first.east_m)) <= reach_m]
        source = search.dipole_at(first, left)
        if source is not None:
            left -= search.field_of(source)
            touched = search.lines_near(source.north_m, source.east_m, _TOUCHED_M)
            peaks |= {line: list(find(line, left)) for line in touched}
        found.append(
            SurveyAnomaly(
                north_m=first.north_m if source is None else source.north_m,
                east_m=first.east_m if source is None else source.east_m,
                peak_nt=first.peak_nt,
                ratio=first.ratio,
                width_m=first.width_m,
                time_s=first.time_s,
                lines=tuple(sorted({p.line for p in near})),
                source=source,
            )
        )
    return found


def _part_of(peak: LinePeak, found: Sequence[SurveyAnomaly]) -> bool:
    """Whether a peak is what is left of a stronger anomaly beside it: no source is exactly a dipole."""
    return any(
        math.dist((peak.north_m, peak.east_m), (anomaly.north_m, anomaly.east_m))
        <= max(_LEAST_REACH_M, _REACH * anomaly.width_m)
        or (
            peak.ratio < _REMAINDER * anomaly.ratio
            and math.dist((peak.north_m, peak.east_m), (anomaly.north_m, anomaly.east_m)) <= _TOUCHED_M
        )
        for anomaly in found
    )


def _blocks(table: Array, line: int) -> Array:
    """Means of successive readings (n, columns) over some metres of track, with the line's number."""
    columns = [block_means(table[:, :2], values, _POINT_M) for values in table[:, 2:].T]
    count = len(columns[0][1])
    return np.column_stack((columns[0][0], *(values for _, values in columns), np.full(count, float(line))))


@lru_cache(maxsize=16)
def _filters(count: int, error_nt: float, map_error_nt: float, correlation_m: float) -> Array:
    """Matched filters (shapes, count, count): each row gives the signal-to-noise ratio of a bump, or of its
    slope, at one point of so many.
    """
    along_m = _POINT_M * np.arange(count)
    apart = np.abs(along_m[:, None] - along_m)
    level_nt = _UNKNOWN_LEVEL * math.hypot(error_nt, map_error_nt)
    covariance = (
        level_nt**2
        + map_error_nt**2 * np.exp(-apart / correlation_m)
        + _UNKNOWN_LEVEL * error_nt**2 * np.exp(-apart / _DRIFT_M)
    )
    covariance[np.diag_indices_from(covariance)] += error_nt**2
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    offset = (along_m[:, None] - along_m[None, :])[None] / np.array(_WIDTHS_M)[:, None, None]
    bump = (1.0 + offset**2) ** -2.5
    slope = offset * (1.0 + offset**2) ** -3.5
    templates = np.concatenate((bump, slope)).transpose(0, 2, 1).reshape(-1, count)
    white = templates @ whitener.T
    size = np.linalg.norm(white, axis=1, keepdims=True)
    found: Array = (white / np.maximum(size, 1e-12) @ whitener).reshape(-1, count, count)
    return found


def _ratios(values_nt: Array, filters: Array) -> tuple[Array, Array]:
    """Largest signal-to-noise ratio (n,) of a bump at each point, and its width."""
    ratio = np.abs(filters @ (values_nt - values_nt.mean()))
    best = np.argmax(ratio, axis=0)
    return ratio[best, np.arange(len(values_nt))], np.array(_WIDTHS_M)[best % len(_WIDTHS_M)]


def _peaks(along_m: Array, ratios: Array, widths_m: Array) -> list[tuple[int, float, float]]:
    """Index, ratio and width of the points that are the strongest within two widths."""
    left = ratios.copy()
    found = []
    while len(left) and left.max() >= LEAST_RATIO:
        k = int(np.argmax(left))
        found.append((k, float(ratios[k]), float(widths_m[k])))
        left[np.abs(along_m - along_m[k]) <= 3.0 * widths_m[k]] = 0.0
    return found
