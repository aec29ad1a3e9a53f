"""Shortest paths of bounded curvature between two places with courses (Dubins 1957, "On curves of minimal
length with a constraint on average curvature", American Journal of Mathematics 79).

The turns between survey lines: a half circle between lines two radii apart, wider where they are farther
apart, and a bulb where they are nearer. The six words are those of Shkel and Lumelsky 2001 ("Classification
of the Dubins set", Robotics and Autonomous Systems 34).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["Arc", "Pose", "shortest_path"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A place and a course.

    Attributes:
        north_m, east_m: place.
        course_rad: clockwise from north.
    """

    north_m: float
    east_m: float
    course_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Arc:
    """A piece of a path.

    Attributes:
        turn: 1 right, -1 left, 0 straight on.
        length_m: its length.
    """

    turn: int
    length_m: float


def shortest_path(start: Pose, end: Pose, radius_m: float) -> tuple[Arc, ...]:
    """The shortest path with turns of a radius; pieces without length are left out."""
    north, east = (end.north_m - start.north_m) / radius_m, (end.east_m - start.east_m) / radius_m
    distance, bearing = math.hypot(north, east), math.atan2(east, north)
    # courses relative to the line between the places; right turns are positive
    alpha = math.remainder(start.course_rad - bearing, math.tau)
    beta = math.remainder(end.course_rad - bearing, math.tau)
    words = [word for word in _words(alpha, beta, distance) if word is not None]
    turns, lengths = min(words, key=lambda word: math.fsum(word[1]))
    return tuple(
        Arc(turn=turn, length_m=length * radius_m)
        for turn, length in zip(turns, lengths, strict=True)
        if length * radius_m > 1e-6
    )


_Word = tuple[tuple[int, int, int], tuple[float, float, float]]


def _words(alpha: float, beta: float, d: float) -> Iterator[_Word | None]:
    """Turns and lengths (radius 1) of each word that exists."""
    for first in (1, -1):  # a left turn is the mirror image of a right one
        a, b = first * alpha, first * beta
        yield _same(first, a, b, d)
        yield _opposite(first, a, b, d)
        yield _three(first, a, b, d)


def _same(first: int, a: float, b: float, d: float) -> _Word | None:
    """Two turns to the same side with a straight piece between."""
    # centres one radius to the turning side of the start and of the end
    x, y = d - math.sin(b) + math.sin(a), math.cos(b) - math.cos(a)
    heading = math.atan2(y, x)
    return (first, 0, first), (_turn(heading - a), math.hypot(x, y), _turn(b - heading))


def _opposite(first: int, a: float, b: float, d: float) -> _Word | None:
    """Two turns to different sides with a straight piece between."""
    x, y = d + math.sin(b) + math.sin(a), -math.cos(b) - math.cos(a)
    squared = x * x + y * y
    if squared < 4.0:
        return None
    straight = math.sqrt(squared - 4.0)
    heading = math.atan2(y, x) + math.atan2(2.0, straight)
    return (first, 0, -first), (_turn(heading - a), straight, _turn(heading - b))


def _three(first: int, a: float, b: float, d: float) -> _Word | None:
    """Three turns, the middle one to the other side."""
    x, y = d - math.sin(b) + math.sin(a), math.cos(b) - math.cos(a)
    apart = math.hypot(x, y)
    if apart > 4.0:
        return None
    middle = math.tau - 2.0 * math.asin(0.25 * apart)
    # halfway round the middle circle the course is along the line of the two centres
    first_turn = _turn((math.atan2(y, x) if apart else a) + 0.5 * middle - a)
    return (first, -first, first), (first_turn, middle, _turn(b - a - first_turn + middle))


def _turn(angle: float) -> float:
    """An angle in 0..2 pi; a whole turn by rounding is none."""
    turned = angle % math.tau
    return 0.0 if math.tau - turned < 1e-9 else turned
