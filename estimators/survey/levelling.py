"""Levelling of survey lines by tie lines.

Where a tie line crosses a survey line, both measured the same place; the difference of their residuals is the
difference of their level errors: the daily variation, the sensor's drift, what compensation has left. A level
for each line is estimated by least squares from all crossings (Luyendyk 1997, "Processing of airborne
magnetic data", AGSO Journal 17, section on tie-line levelling). The sum of the levels is not observable, and
set to 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from estimators.survey.lines import LineKind, SurveyLine

__all__ = ["Crossing", "Levelling", "crossings", "levelled"]

Array = NDArray[np.float64]

_NEAR_M: Final = 100.0  # readings within this distance of a crossing are used
_END_M: Final = 10.0  # a line may end so far from a crossing
_LEAST_READINGS: Final = 5
_DAMPING: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """Where two lines cross.

    Attributes:
        line, tie: numbers of the two lines.
        north_m, east_m: place.
        misclosure_nt: residual of the survey line less that of the tie line.
    """

    line: int
    tie: int
    north_m: float
    east_m: float
    misclosure_nt: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Levelling:
    """Levels of the lines.

    Attributes:
        level_nt: (lines,) to be subtracted from the readings of each line; NaN-free, 0 for lines without a
            crossing.
        before_nt: root mean square of the misclosures before levelling; NaN without crossings.
        after_nt: standard deviation of the misclosures after levelling: their squares over the crossings less
            the free levels; NaN if the levels explain all crossings exactly, as with a single tie line.
        crossings: number of crossings.
    """

    level_nt: Array
    before_nt: float
    after_nt: float
    crossings: int


def crossings(
    lines: Sequence[SurveyLine], line_of: NDArray[np.int64], north_m: Array, east_m: Array, residual_nt: Array
) -> list[Crossing]:
    """The crossings of survey lines with tie lines that both have readings near the place.

    Args:
        lines: the lines.
        line_of: (n,) number of each reading's line; -1: none.
        north_m, east_m, residual_nt: (n,) places, and readings less map or main field.
    """
    own = [np.nonzero(line_of == number)[0] for number in range(len(lines))]
    found = []
    for i, line in enumerate(lines):
        if line.kind is not LineKind.LINE:
            continue
        for j, tie in enumerate(lines):
            place = _intersection(line, tie) if tie.kind is LineKind.TIE else None
            if place is None:
                continue
            at = [_value_at(place, north_m[k], east_m[k], residual_nt[k]) for k in (own[i], own[j])]
            if not any(map(math.isnan, at)):
                found.append(
                    Crossing(line=i, tie=j, north_m=place[0], east_m=place[1], misclosure_nt=at[0] - at[1])
                )
    return found


def levelled(count: int, found: Sequence[Crossing]) -> Levelling:
    """Estimate the levels of so many lines from their crossings."""
    if not found:
        return Levelling(level_nt=np.zeros(count), before_nt=math.nan, after_nt=math.nan, crossings=0)
    rows = np.arange(len(found))
    design = np.zeros((len(found), count))
    design[rows, [c.line for c in found]] = 1.0
    design[rows, [c.tie for c in found]] = -1.0
    misclosure = np.array([c.misclosure_nt for c in found])
    # a single large misclosure, over an anomaly or a fence, has to count less: Huber's weights
    weight = np.ones(len(found))
    level = np.zeros(count)
    for _ in range(10):
        normal = design.T @ (weight[:, None] * design) + _DAMPING * np.eye(count)
        level = np.linalg.solve(normal, design.T @ (weight * misclosure))
        left = np.abs(misclosure - design @ level)
        scale = 1.4826 * float(np.median(left)) * 1.345 + 1e-9
        weight = np.minimum(1.0, scale / np.maximum(left, 1e-12))
    spare = len(found) - _free_levels(found)
    left = misclosure - design @ level
    return Levelling(
        level_nt=level,
        before_nt=float(np.sqrt(np.mean(misclosure**2))),
        after_nt=math.sqrt(float(left @ left) / spare) if spare else math.nan,
        crossings=len(found),
    )


def _free_levels(found: Sequence[Crossing]) -> int:
    """Number of levels that crossings determine: one less than the lines of each connected net of lines."""
    numbers = np.array([(c.line, c.tie) for c in found])
    count = int(numbers.max()) + 1
    net = coo_array((np.ones(len(found)), (numbers[:, 0], numbers[:, 1])), shape=(count, count))
    nets, _ = connected_components(net, directed=False)
    return count - int(nets)  # a line without a crossing is a net of its own


def _intersection(a: SurveyLine, b: SurveyLine) -> tuple[float, float] | None:
    """Where two lines cross within both; None: nowhere."""
    p, q = np.array(a.start_ne_m), np.array(b.start_ne_m)
    r, s = np.array(a.end_ne_m) - p, np.array(b.end_ne_m) - q
    cross = float(r[0] * s[1] - r[1] * s[0])
    if abs(cross) < 1e-6 * a.length_m * b.length_m:
        return None
    gap = q - p
    t = float(gap[0] * s[1] - gap[1] * s[0]) / cross
    u = float(gap[0] * r[1] - gap[1] * r[0]) / cross
    if not (0.0 <= t <= 1.0 and 0.0 <= u <= 1.0):
        return None
    north, east = (p + t * r).tolist()
    return north, east


def _value_at(place: tuple[float, float], north_m: Array, east_m: Array, residual_nt: Array) -> float:
    """Residual at a place of one line, by a straight line through the readings near it; NaN: too few."""
    distance = np.hypot(north_m - place[0], east_m - place[1])
    near = distance <= _NEAR_M
    if int(near.sum()) < _LEAST_READINGS:
        return math.nan
    # signed distance along the track
    course = math.atan2(east_m[near][-1] - east_m[near][0], north_m[near][-1] - north_m[near][0])
    along = (north_m[near] - place[0]) * math.cos(course) + (east_m[near] - place[1]) * math.sin(course)
    if not along.min() - _END_M <= 0.0 <= along.max() + _END_M:
        return math.nan
    fit = np.polynomial.Polynomial.fit(along, residual_nt[near], 1)
    return float(fit(0.0))
