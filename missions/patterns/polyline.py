"""Patterns of straight legs, and their form with rounded corners for a vehicle that doesn't stop at each."""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import Array, knots_by_length

# Quintic Bezier corner: control points on the two legs at these fractions of the blend length from the
# corner. Three on each leg make curvature zero where the blend meets the leg, so the path is
# curvature-continuous.
_CONTROL: Final = (1.0, 0.7, 0.25)
_BERNSTEIN: Final = np.array(  # power-basis coefficients (rows: powers 0..5) of the control points
    [
        [1, 0, 0, 0, 0, 0],
        [-5, 5, 0, 0, 0, 0],
        [10, -20, 10, 0, 0, 0],
        [-10, 30, -30, 10, 0, 0],
        [5, -20, 30, -20, 5, 0],
        [-1, 5, -10, 10, -5, 1],
    ],
    dtype=np.float64,
)


class _Pieces:
    """A chain of plane quintics; piece k is flown while the parameter runs from k to k + 1."""

    def __init__(self, coefficients: Array) -> None:
        """coefficients (pieces, 6, 2): power basis, north and east."""
        self._coefficients = coefficients
        powers = np.arange(6.0)[None, :, None]
        self._first = (coefficients * powers)[:, 1:]
        self._second = (self._first * powers[:, :5])[:, 1:]

    @property
    def count(self) -> int:
        return len(self._coefficients)

    def evaluate(self, u: Array, order: int) -> Array:
        table = (self._coefficients, self._first, self._second)[order]
        piece = np.clip(np.floor(u).astype(np.intp), 0, self.count - 1)
        t = (u - piece)[:, None]
        value = table[piece, -1]
        for power in range(table.shape[1] - 2, -1, -1):
            value = value * t + table[piece, power]
        return value


@dataclass(frozen=True, slots=True)
class Polyline:
    """Straight legs through vertices, (north, east) in metres; a curve whose corners are sharp.

    Attributes:
        vertices_m: the corners in order, at least two; consecutive ones differ.
    """

    vertices_m: tuple[tuple[float, float], ...]
    _pieces: _Pieces = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.vertices_m) < 2:
            raise PlanError(
                "a pattern of fewer than two points is empty; make the area larger or the spacing smaller"
            )
        vertices = np.asarray(self.vertices_m, dtype=np.float64)
        if not np.isfinite(vertices).all():
            raise PlanError("the pattern has a point that is not finite")
        legs = np.diff(vertices, axis=0)
        if (np.hypot(legs[:, 0], legs[:, 1]) < 1e-6).any():
            raise PlanError("the pattern has a leg of no length; make the area larger or the spacing smaller")
        coefficients = np.zeros((len(legs), 6, 2))
        coefficients[:, 0] = vertices[:-1]
        coefficients[:, 1] = legs
        object.__setattr__(self, "_pieces", _Pieces(coefficients))

    @property
    def end(self) -> float:
        return float(self._pieces.count)

    @property
    def closed(self) -> bool:
        return math.dist(self.vertices_m[0], self.vertices_m[-1]) < 1e-6

    @property
    def leg_lengths_m(self) -> tuple[float, ...]:
        """Length of each leg in order."""
        return tuple(math.dist(a, b) for a, b in zip(self.vertices_m, self.vertices_m[1:], strict=False))

    @property
    def length_m(self) -> float:
        return math.fsum(self.leg_lengths_m)

    def points(self, u: Array) -> Array:
        return self._pieces.evaluate(u, 0)

    def derivatives(self, u: Array) -> tuple[Array, Array]:
        return self._pieces.evaluate(u, 1), self._pieces.evaluate(u, 2)

    def knots(self, spacing_m: float) -> Array:
        return knots_by_length(self, spacing_m, np.arange(self._pieces.count + 1.0))

    def then(self, other: "Polyline") -> "Polyline":
        """This polyline followed by the other; a leg joins them if they don't touch."""
        first = (
            other.vertices_m[1:]
            if math.dist(self.vertices_m[-1], other.vertices_m[0]) < 1e-6
            else other.vertices_m
        )
        return Polyline(self.vertices_m + first)

    def reversed(self) -> "Polyline":
        """The same legs in reverse order."""
        return Polyline(self.vertices_m[::-1])

    def rotated(self, angle_rad: float) -> "Polyline":
        """The polyline turned to the right (north towards east) around the centre."""
        c, s = math.cos(angle_rad), math.sin(angle_rad)
        return Polyline(tuple((n * c - e * s, n * s + e * c) for n, e in self.vertices_m))

    def rounded(self, corner_m: float) -> "RoundedPolyline":
        """The polyline with every corner rounded; the path is at most `corner_m` from the corner."""
        return RoundedPolyline(self, corner_m)


@dataclass(frozen=True, slots=True)
class RoundedPolyline:
    """A polyline whose corners are curvature-continuous blends, each within `corner_m` of its corner.

    Attributes:
        polyline: the sharp pattern.
        corner_m: largest distance from a corner to the path, > 0. A blend takes less than half of either leg.
    """

    polyline: Polyline
    corner_m: float
    _pieces: _Pieces = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.corner_m > 0.0:
            raise PlanError(f"corner distance {self.corner_m} m is not possible; ask for more than 0 m")
        object.__setattr__(self, "_pieces", _Pieces(np.array(_rounded_pieces(self.polyline, self.corner_m))))

    @property
    def end(self) -> float:
        return float(self._pieces.count)

    @property
    def closed(self) -> bool:
        """False even if the ends meet, because the path has a corner or a stop there."""
        return False

    def points(self, u: Array) -> Array:
        return self._pieces.evaluate(u, 0)

    def derivatives(self, u: Array) -> tuple[Array, Array]:
        return self._pieces.evaluate(u, 1), self._pieces.evaluate(u, 2)

    def knots(self, spacing_m: float) -> Array:
        return knots_by_length(
            self, min(spacing_m, 0.25 * self.corner_m), np.arange(self._pieces.count + 1.0)
        )


def _rounded_pieces(polyline: Polyline, corner_m: float) -> list[Array]:
    vertices = np.asarray(polyline.vertices_m, dtype=np.float64)
    legs = np.diff(vertices, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    directions = legs / lengths[:, None]
    pieces: list[Array] = []
    start = vertices[0]
    for k in range(1, len(vertices) - 1):
        before, after = directions[k - 1], directions[k]
        half_turn = 0.5 * math.atan2(abs(before[0] * after[1] - before[1] * after[0]), float(before @ after))
        if half_turn < 1e-6:
            continue  # no turn
        if math.pi / 2 - half_turn < 1e-3:  # reversal: it cannot be rounded; the vehicle stops and turns
            pieces.append(_line(start, vertices[k]))
            start = vertices[k]
            continue
        # distance of the blend's middle from the corner, per blend length, by the control points' weights at
        # t = 1/2
        weight = (_CONTROL[0] + 5.0 * _CONTROL[1] + 10.0 * _CONTROL[2]) / 16.0
        blend_m = min(corner_m / (weight * math.sin(half_turn)), 0.48 * lengths[k - 1], 0.48 * lengths[k])
        corner = vertices[k]
        controls = [corner - f * blend_m * before for f in _CONTROL] + [
            corner + f * blend_m * after for f in reversed(_CONTROL)
        ]
        pieces.append(_line(start, controls[0]))
        pieces.append(_BERNSTEIN @ np.array(controls))
        start = controls[-1]
    pieces.append(_line(start, vertices[-1]))
    return pieces


def _line(start: Array, stop: Array) -> Array:
    coefficients = np.zeros((6, 2))
    coefficients[0] = start
    coefficients[1] = stop - start
    return coefficients
