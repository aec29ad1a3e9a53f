"""The interface of all patterns: a plane curve, and its arc length."""

import itertools
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from missions.errors import PlanError

Array = NDArray[np.float64]

_CUSP_SPEED: Final = 1e-9
_FINE_TURN_RAD: Final = 0.1
_REFINEMENTS: Final = 3  # each divides by four: knots from 0.25 m to 4 mm apart
_SHARPEST_RAD: Final = 0.6  # turn between two knots; a larger one counts as a corner, even if it is round
_MAX_CURVATURE_PER_M: Final = 1e3  # larger at a cusp or a sharp corner, where any vehicle turns on the spot


class Curve(Protocol):
    """A plane curve: a point for each parameter in 0..end, in metres north and east of the pattern's
    centre.
    """

    @property
    def end(self) -> float:
        """The parameter's last value; it starts at 0."""
        ...

    @property
    def closed(self) -> bool:
        """Whether the curve ends at its start in the same direction, so that it can be flown repeatedly."""
        ...

    def points(self, u: Array) -> Array:
        """Points (n, 2) at parameters (n,): north, east, m."""
        ...

    def derivatives(self, u: Array) -> tuple[Array, Array]:
        """First and second derivatives with respect to the parameter, (n, 2) each."""
        ...

    def knots(self, spacing_m: float) -> Array:
        """Increasing parameters from 0 to end, at most about `spacing_m` of path apart, including every
        joint.
        """
        ...


def curvature_per_m(first: Array, second: Array) -> Array:
    """Signed curvature (n,), 1/m, positive turning right (north towards east), from derivatives (n, 2).

    At a cusp, where the first derivative vanishes, it is limited to 1000 per metre: a turn on the spot.
    """
    speed = np.hypot(first[:, 0], first[:, 1])
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    curvature = cross / np.maximum(speed, _CUSP_SPEED) ** 3
    return np.clip(curvature, -_MAX_CURVATURE_PER_M, _MAX_CURVATURE_PER_M)


def knots_by_length(curve: Curve, spacing_m: float, pieces: Array) -> Array:
    """Knots of a curve with smooth pieces between the parameters `pieces`: equal parts in each piece."""
    parts = [pieces[:1]]
    for start, stop in itertools.pairwise(pieces):
        coarse = curve.points(np.linspace(start, stop, 17))
        length_m = float(np.hypot(*np.diff(coarse, axis=0).T).sum())
        count = max(2, int(np.ceil(length_m / spacing_m)))
        parts.append(np.linspace(start, stop, count + 1)[1:])
    return np.concatenate(parts)


@dataclass(frozen=True, slots=True, kw_only=True)
class ArcLengthTable:
    """A curve as a function of the distance along it, on a fine grid.

    Attributes:
        u: parameters (n,).
        arc_m: distance along the curve (n,), from 0, increasing.
        points_m: north, east (n, 2).
        course_rad: direction of travel (n,), continuous (unwrapped), 0 north, positive to the east.
        curvature_per_m: signed curvature (n,).
        stops: indices where the direction of travel jumps (a sharp corner, a cusp): a vehicle must stop
            there.
        closed: whether the curve is closed.
    """

    u: Array
    arc_m: Array
    points_m: Array
    course_rad: Array
    curvature_per_m: Array
    stops: tuple[int, ...]
    closed: bool

    @classmethod
    def of(cls, curve: Curve, spacing_m: float = 0.25) -> "ArcLengthTable":
        """Table of a whole curve with knots `spacing_m` apart; lengths by Simpson's rule on each interval."""
        u = _refined(curve, curve.knots(spacing_m))
        first, second = curve.derivatives(u)
        middle_first, _ = curve.derivatives(0.5 * (u[:-1] + u[1:]))
        speed = np.hypot(first[:, 0], first[:, 1])
        middle_speed = np.hypot(middle_first[:, 0], middle_first[:, 1])
        inner_edge = np.hypot(*_inner_edges(curve, u))
        pieces = np.diff(u) / 6.0 * (inner_edge[0] + 4.0 * middle_speed + inner_edge[1])
        keep = np.concatenate(([True], pieces > 1e-9))
        arc = np.concatenate(([0.0], np.cumsum(np.maximum(pieces, 0.0))))
        if arc[-1] <= 0.0:
            raise PlanError("the pattern has no length: give it a size above zero")
        course = np.arctan2(first[:, 1], first[:, 0])
        slow = speed < 1e-6
        if slow.any():  # at a cusp the direction of travel is that of the second derivative
            course[slow] = np.arctan2(second[slow, 1], second[slow, 0])
        course = np.unwrap(course[keep])
        curvature = curvature_per_m(first, second)[keep]
        return cls(
            u=u[keep],
            arc_m=arc[keep],
            points_m=curve.points(u)[keep],
            course_rad=course,
            curvature_per_m=curvature,
            stops=_stops(course, curvature, arc[keep]),
            closed=curve.closed,
        )

    @property
    def length_m(self) -> float:
        """Length of one pass along the curve."""
        return float(self.arc_m[-1])

    def parameter_at(self, arc_m: Array) -> Array:
        """Parameters at distances along the curve, 0..length."""
        return np.interp(arc_m, self.arc_m, self.u)


def _refined(curve: Curve, u: Array) -> Array:
    """Knots with additional ones where the curve turns by more than 0.1 rad between two, as in a hairpin."""
    for _ in range(_REFINEMENTS):
        first, _second = curve.derivatives(u)
        course = np.arctan2(first[:, 1], first[:, 0])
        turn = np.abs(np.angle(np.exp(1j * np.diff(course))))
        wide = np.nonzero(turn > _FINE_TURN_RAD)[0]
        if not len(wide):
            break
        extra = [u[wide] + f * (u[wide + 1] - u[wide]) for f in (0.25, 0.5, 0.75)]
        u = np.union1d(u, np.concatenate(extra))
    return u


def _stops(course: Array, curvature: Array, arc: Array) -> tuple[int, ...]:
    """Knots at which the course changes far more than the curvature on either side explains."""
    size = np.abs(curvature)
    size = np.where(size >= _MAX_CURVATURE_PER_M, 0.0, size)
    explained = np.maximum(size[:-1], size[1:]) * np.diff(arc)
    turn = np.abs(np.diff(course))
    jumps = np.nonzero((turn > 3.0 * explained + 0.05) | (turn > _SHARPEST_RAD))[0] + 1
    cusps = np.nonzero(np.abs(curvature) >= _MAX_CURVATURE_PER_M)[0]
    inner = set(jumps.tolist()) | set(cusps.tolist())
    # a cusp appears in both intervals next to it: keep the first of neighbouring ones
    return tuple(k for k in sorted(inner) if k - 1 not in inner and 0 < k < len(course) - 1)


def _inner_edges(curve: Curve, u: Array) -> Array:
    """Derivatives just inside both ends of every interval (2, 2, n-1); at joints they differ."""
    nudge = 1e-9 * np.diff(u)
    start, _ = curve.derivatives(u[:-1] + nudge)
    stop, _ = curve.derivatives(u[1:] - nudge)
    return np.stack((start.T, stop.T), axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lap:
    """A closed curve flown several times from a given place; it is itself a curve.

    Attributes:
        curve: the closed curve.
        laps: number of laps, > 0.
        start: start of the flight, as a fraction of the parameter, 0..1 (a team's phase offset).
    """

    curve: Curve
    laps: float = 1.0
    start: float = 0.0

    def __post_init__(self) -> None:
        if not self.laps > 0.0:
            raise PlanError(f"{self.laps} laps can't be flown; ask for more than 0")
        if not self.curve.closed:
            raise PlanError("only a closed pattern can be flown in laps")

    @property
    def end(self) -> float:
        return self.curve.end * self.laps

    @property
    def closed(self) -> bool:
        return float(self.laps).is_integer()

    def _wrapped(self, u: Array) -> Array:
        return np.mod(u + self.start * self.curve.end, self.curve.end)

    def points(self, u: Array) -> Array:
        return self.curve.points(self._wrapped(u))

    def derivatives(self, u: Array) -> tuple[Array, Array]:
        return self.curve.derivatives(self._wrapped(u))

    def knots(self, spacing_m: float) -> Array:
        once = self.curve.knots(spacing_m)
        period = self.curve.end
        shifted = np.concatenate([once[:-1] + k * period for k in range(int(np.ceil(self.laps)) + 1)])
        inside = shifted - self.start * period
        inside = inside[(inside > 1e-9 * period) & (inside < self.end - 1e-9 * period)]
        return np.concatenate(([0.0], inside, [self.end]))
