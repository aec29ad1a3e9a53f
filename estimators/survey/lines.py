"""The lines of a survey: as planned, or as found in a track, and which readings belong to which.

Survey lines are parallel; tie lines cross them, and the differences at the crossings show the level errors of
the lines (`levelling`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from flightsim.foundation.file_content import FileError, read_text

__all__ = ["LineKind", "LinePlan", "SurveyLine", "detected_lines", "load_lines"]

Array = NDArray[np.float64]

HEADER: Final = "name,kind,start_north_m,start_east_m,end_north_m,end_east_m"
"""First line of a file of lines."""

_COURSE_RAD: Final = math.radians(20.0)  # readings on another course are of a turn
_STRAIGHT_RAD: Final = math.radians(8.0)  # of a detected line's course, either side
_DECIMALS: Final = 2  # of places in a file of lines, m
_TIE_RAD: Final = math.radians(45.0)
_GAP_M: Final = 100.0  # a detected line ends where places are missing
_CORRIDOR_M: Final = 50.0
_CORRIDOR_SPACINGS: Final = 0.4


class LineKind(StrEnum):
    """Kinds of lines."""

    LINE = "line"
    TIE = "tie"


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyLine:
    """A straight line, flown from its start to its end.

    Attributes:
        name: such as "L3" or "T1".
        kind: survey line or tie line.
        start_ne_m, end_ne_m: ends, north and east of the origin of the plan.
    """

    name: str
    kind: LineKind
    start_ne_m: tuple[float, float]
    end_ne_m: tuple[float, float]

    def __post_init__(self) -> None:
        if not (math.isfinite(self.length_m) and self.length_m > 0.0):
            raise EstimatorError(
                f"line {self.name} from {self.start_ne_m} to {self.end_ne_m} has no length; give two places"
            )

    @property
    def length_m(self) -> float:
        return math.dist(self.start_ne_m, self.end_ne_m)

    @property
    def course_rad(self) -> float:
        """Direction of flight, clockwise from north."""
        return math.atan2(self.end_ne_m[1] - self.start_ne_m[1], self.end_ne_m[0] - self.start_ne_m[0])

    def reversed(self) -> "SurveyLine":
        """The same line, flown the other way."""
        return SurveyLine(name=self.name, kind=self.kind, start_ne_m=self.end_ne_m, end_ne_m=self.start_ne_m)

    def along_across_m(self, north_m: Array, east_m: Array) -> tuple[Array, Array]:
        """Distance along the line from its start, and to the right of it, of places (n,)."""
        c, s = math.cos(self.course_rad), math.sin(self.course_rad)
        north, east = north_m - self.start_ne_m[0], east_m - self.start_ne_m[1]
        return north * c + east * s, east * c - north * s


@dataclass(frozen=True, slots=True, kw_only=True)
class LinePlan:
    """The lines of a survey.

    Attributes:
        lines: in the order of flight.
        spacing_m: distance of the survey lines; None: not known.
    """

    lines: tuple[SurveyLine, ...]
    spacing_m: float | None = None

    @classmethod
    def of(cls, lines: Sequence[SurveyLine]) -> "LinePlan":
        """The plan of commanded lines, with the distance that they have: the median between neighbours; None
        with fewer than two survey lines.
        """
        survey = [line for line in lines if line.kind is LineKind.LINE]
        middles = (
            np.array([(line.start_ne_m, line.end_ne_m) for line in survey]).reshape(-1, 2, 2).mean(axis=1)
        )
        gaps = np.zeros(0)
        if len(survey) > 1:
            _, across = survey[0].along_across_m(*middles.T)
            gaps = np.round(np.diff(np.sort(across)), _DECIMALS)
            gaps = gaps[gaps > 0.0]  # a line that was flown again
        return cls(lines=tuple(lines), spacing_m=float(np.median(gaps)) if len(gaps) else None)

    @property
    def corridor_m(self) -> float:
        """Readings farther from a line do not belong to it: 0.4 line spacings, 50 m at most."""
        return (
            _CORRIDOR_M if self.spacing_m is None else min(_CORRIDOR_M, _CORRIDOR_SPACINGS * self.spacing_m)
        )

    def line_of(self, north_m: Array, east_m: Array) -> NDArray[np.int64]:
        """Number of the line (n,) that each reading belongs to, in the order of flight; -1: to none.

        Args:
            north_m, east_m: (n,) places of the readings in the order of time.
        """
        found = np.full(len(north_m), -1, dtype=np.int64)
        if len(north_m) < 3:
            return found
        course = np.arctan2(np.gradient(east_m), np.gradient(north_m))
        for number, line in enumerate(self.lines):
            along, across = line.along_across_m(north_m, east_m)
            turned = np.abs(np.remainder(course - line.course_rad + math.pi / 2.0, math.pi) - math.pi / 2.0)
            on = (along >= 0.0) & (along <= line.length_m) & (np.abs(across) <= self.corridor_m)
            found[_longest(on & (turned < _COURSE_RAD) & (found < 0), along)] = number
        return found

    def to_csv(self) -> str:
        """The lines as a table."""
        rows = (
            f"{line.name},{line.kind},"
            + ",".join(f"{value:.{_DECIMALS}f}" for value in (*line.start_ne_m, *line.end_ne_m))
            for line in self.lines
        )
        return "\n".join((HEADER, *rows)) + "\n"


def load_lines(path: Path) -> LinePlan:
    """Read a table that `LinePlan.to_csv` has made.

    Raises:
        EstimatorError: it can't be read, or a row is no line.
    """
    try:
        text = read_text(path)
    except FileError as error:
        raise EstimatorError(f"lines_file {error}") from None
    first = text.partition("\n")[0].strip()
    if first != HEADER:
        raise EstimatorError(f"lines_file {path} begins with {first[:60]!r}; accepted is {HEADER!r}")
    lines = []
    for number, row in enumerate(text.splitlines()[1:], 2):
        if not row:
            continue
        try:
            lines.append(_line_of(row.split(",")))
        except EstimatorError as error:
            raise EstimatorError(f"lines_file {path}, line {number}: {error}") from None
    if not lines:
        raise EstimatorError(f"lines_file {path} has a header and no lines")
    return LinePlan.of(lines)


def _line_of(cells: Sequence[str]) -> SurveyLine:
    """The line of a row of the table.

    Raises:
        EstimatorError: a cell is missing, or has a value that is not accepted.
    """
    columns = HEADER.split(",")
    if len(cells) != len(columns):
        raise EstimatorError(f"{len(cells)} values; accepted are {len(columns)}: {HEADER}")
    name, kind, *places = cells
    if kind not in list(LineKind):
        raise EstimatorError(f"kind {kind[:40]!r} is not accepted; there are {', '.join(LineKind)}")
    numbers = []
    for column, text in zip(columns[2:], places, strict=True):
        try:
            numbers.append(float(text))
        except ValueError:
            raise EstimatorError(f"{column} {text[:40]!r} is not a number; give metres") from None
    north_m, east_m, end_north_m, end_east_m = numbers
    return SurveyLine(
        name=name, kind=LineKind(kind), start_ne_m=(north_m, east_m), end_ne_m=(end_north_m, end_east_m)
    )


def detected_lines(north_m: Array, east_m: Array, *, least_length_m: float = 500.0) -> LinePlan:
    """The straight stretches of a track, as lines; those across the direction of most track are tie lines.

    Args:
        north_m, east_m: (n,) places in the order of time, some 25 m apart or less.
        least_length_m: shorter stretches are no lines.
    """
    lines: list[SurveyLine] = []
    if len(north_m) >= 3:
        course = np.unwrap(np.arctan2(np.gradient(east_m), np.gradient(north_m)))
        first = 0
        for k in range(1, len(course) + 1):
            straight = (
                k < len(course)
                and abs(course[k] - np.median(course[first:k])) < _STRAIGHT_RAD
                and math.hypot(north_m[k] - north_m[k - 1], east_m[k] - east_m[k - 1]) < _GAP_M
            )
            if straight:
                continue
            start, end = (
                (float(north_m[first]), float(east_m[first])),
                (float(north_m[k - 1]), float(east_m[k - 1])),
            )
            if math.dist(start, end) >= least_length_m:
                name = f"L{len(lines) + 1}"
                lines.append(SurveyLine(name=name, kind=LineKind.LINE, start_ne_m=start, end_ne_m=end))
            first = k
    return LinePlan(lines=_with_ties(lines))


def _with_ties(lines: list[SurveyLine]) -> tuple[SurveyLine, ...]:
    if not lines:
        return ()
    doubled = sum(line.length_m * np.exp(2j * line.course_rad) for line in lines)
    main_rad = 0.5 * float(np.angle(doubled))
    found: list[SurveyLine] = []
    for line in lines:
        off_rad = abs(math.remainder(line.course_rad - main_rad, math.pi))
        kind = LineKind.TIE if off_rad > _TIE_RAD else LineKind.LINE
        letter = "T" if kind is LineKind.TIE else "L"
        number = 1 + sum(other.kind is kind for other in found)
        found.append(
            SurveyLine(
                name=f"{letter}{number}", kind=kind, start_ne_m=line.start_ne_m, end_ne_m=line.end_ne_m
            )
        )
    return tuple(found)


def _longest(on: NDArray[np.bool_], along: Array) -> NDArray[np.int64]:
    """Places of the run of True that covers most of a line: a line counts once, also where the way in crosses
    its corridor, and where the vehicle has stood on it before the takeoff.
    """
    within = np.nonzero(on)[0]
    if not len(within):
        return within
    runs = np.split(within, np.nonzero(np.diff(within) > 1)[0] + 1)
    return max(runs, key=lambda run: float(np.ptp(along[run])))
