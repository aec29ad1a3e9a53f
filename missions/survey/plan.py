"""The lines of a survey, and the path that an aircraft flies along them; without I/O.

Lines that are nearer to each other than two turn radii are flown with others between: half of a block is
flown up, half down, as on a race track. Every turn is the shortest path of the aircraft's radius (`dubins`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimators.survey.lines import LineKind, LinePlan, SurveyLine
from missions.errors import PlanError
from missions.planning.flyable import FlyablePath
from missions.survey.drape import Drape
from missions.survey.dubins import Arc, Pose, shortest_path
from missions.survey.options import SurveyOptions

__all__ = ["SurveyPath", "check_lines", "line_plan", "survey_path"]

Array = NDArray[np.float64]
Track: TypeAlias = tuple[Array, Array, Array]
"""Points (n, 2), courses and curvatures (n,)."""

_STEP_M: Final = 2.0
_LEVEL_M: Final = 1.0  # waypoints along a line stay within this height of the drape
_DRAPE_STEP_M: Final = 50.0
_TURN_DEVIATION_M: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyPath:
    """The path of a survey.

    Attributes:
        plan: the lines in the order and the direction of flight.
        path: the way over ground, lines with their leads, and turns.
        waypoints_m: (n, 2) north and east.
        heights_m: (n,) height above home of each waypoint; on the legs between, it changes linearly.
        arcs_m: (n,) distance of each waypoint along the path.
        first_line, last_line: numbers of the waypoints at the first line's start and at the last line's end.
    """

    plan: LinePlan
    path: FlyablePath
    waypoints_m: Array
    heights_m: Array
    arcs_m: Array
    first_line: int
    last_line: int


def line_plan(options: SurveyOptions, *, turn_radius_m: float) -> LinePlan:
    """The lines of a survey, in the order of flight.

    Args:
        options: the survey.
        turn_radius_m: of the aircraft.
    """
    across = _places(options.width_m, options.spacing_m)
    lines = [
        _line(options, f"L{k + 1}", LineKind.LINE, (-0.5 * options.height_m, x), (0.5 * options.height_m, x))
        for k, x in enumerate(across)
    ]
    ties = []
    if options.tie_m > 0.0:
        along = _places(options.height_m, options.tie_m)
        ties = [
            _line(options, f"T{k + 1}", LineKind.TIE, (y, -0.5 * options.width_m), (y, 0.5 * options.width_m))
            for k, y in enumerate(along)
        ]
    flown: list[SurveyLine] = []
    for group, spacing_m in ((lines, options.spacing_m), (ties, options.tie_m)):
        ordered = [group[k] for k in _order(len(group), spacing_m, turn_radius_m)]
        if flown and ordered:
            ordered = _beginning_near(flown[-1].end_ne_m, ordered)
        flown += [line if k % 2 == 0 else line.reversed() for k, line in enumerate(ordered)]
    return LinePlan.of(flown)


def survey_path(
    plan: LinePlan, drape: Drape, *, turn_radius_m: float, lead_m: float, run_out_m: float
) -> SurveyPath:
    """The path along the lines of a plan.

    Args:
        plan: the lines in the order of flight.
        drape: height to fly at.
        turn_radius_m: of the turns between the lines.
        lead_m, run_out_m: straight flight before and after each line.
    """
    pieces: list[Track] = []
    waypoints: list[Array] = []
    arcs: list[Array] = []
    length_m = 0.0

    def add(piece: Track, places: Array, along_m: Array) -> None:
        nonlocal length_m
        pieces.append(piece)
        waypoints.append(places)
        arcs.append(length_m + along_m)
        length_m += float(_arc_m(piece[0])[-1])

    for number, line in enumerate(plan.lines):
        entry = _pose(line, -lead_m)
        if number:
            before = _pose(plan.lines[number - 1], plan.lines[number - 1].length_m + run_out_m)
            turn = _followed(before, shortest_path(before, entry, turn_radius_m), turn_radius_m)
            add(turn, *_turn_waypoints(turn, turn_radius_m))
        whole_m = lead_m + line.length_m + run_out_m
        on_line = _along(line, drape)
        along = np.concatenate(([0.0], lead_m + on_line, [whole_m]))
        straight = _followed(entry, (Arc(turn=0, length_m=whole_m),), turn_radius_m)
        c, s = math.cos(line.course_rad), math.sin(line.course_rad)
        add(straight, np.column_stack((entry.north_m + along * c, entry.east_m + along * s)), along)
    last_line = sum(map(len, arcs)) - 2
    points, course, bend = (np.concatenate(columns) for columns in zip(*pieces, strict=True))
    arc = _arc_m(points)
    kept = np.concatenate(([True], np.diff(arc) > 1e-6))
    places = np.concatenate(waypoints)
    return SurveyPath(
        plan=plan,
        path=FlyablePath(
            points_m=points[kept],
            arc_m=arc[kept],
            course_rad=np.unwrap(course[kept]),
            curvature_per_m=bend[kept],
        ),
        waypoints_m=places,
        heights_m=drape.heights_m(places[:, 0], places[:, 1]),
        arcs_m=np.concatenate(arcs),
        first_line=1,
        last_line=last_line,
    )


def _places(span_m: float, spacing_m: float) -> list[float]:
    """Places of parallel lines over a span, centred, apart by the spacing."""
    count = math.floor(span_m / spacing_m + 1e-9) + 1
    return [spacing_m * (k - 0.5 * (count - 1)) for k in range(count)]


def _line(
    options: SurveyOptions, name: str, kind: LineKind, start: tuple[float, float], end: tuple[float, float]
) -> SurveyLine:
    """A line between two places (along, across) of the area."""
    c, s = math.cos(options.direction_rad), math.sin(options.direction_rad)
    ends = [
        (options.area_ne_m[0] + along * c - across * s, options.area_ne_m[1] + along * s + across * c)
        for along, across in (start, end)
    ]
    return SurveyLine(name=name, kind=kind, start_ne_m=ends[0], end_ne_m=ends[1])


def _order(count: int, spacing_m: float, turn_radius_m: float) -> list[int]:
    """Order of lines such that successive ones are two turn radii apart, where there are enough."""
    if not count:
        return []
    skip = max(1, math.ceil(2.0 * turn_radius_m / spacing_m - 1e-9))
    if skip == 1:
        return list(range(count))
    order: list[int] = []
    start = 0
    block = 2 * skip + 1  # the way back from m to 1 is one spacing shorter than from 0 to m
    while start < count:
        size = min(block, count - start)
        if 0 < count - start - size < skip:  # a short rest joins the last block
            size = count - start
        half = (size + 1) // 2
        for k in range(half):
            order.append(start + k)
            if half + k < size:
                order.append(start + half + k)
        start += size
    return order


def _beginning_near(place: tuple[float, float], lines: Sequence[SurveyLine]) -> list[SurveyLine]:
    """The same lines in this order or the reverse, each way round, so that the first begins near a place."""
    ways = [
        ordered
        for base in (list(lines), list(reversed(lines)))
        for ordered in (base, [line.reversed() for line in base])
    ]
    return min(ways, key=lambda ordered: math.dist(place, ordered[0].start_ne_m))


def _pose(line: SurveyLine, along_m: float) -> Pose:
    course = line.course_rad
    return Pose(
        north_m=line.start_ne_m[0] + along_m * math.cos(course),
        east_m=line.start_ne_m[1] + along_m * math.sin(course),
        course_rad=course,
    )


def _followed(start: Pose, arcs: Sequence[Arc], radius_m: float) -> Track:
    """Points (n, 2), courses and curvatures along arcs."""
    north, east, course = start.north_m, start.east_m, start.course_rad
    points, courses, bends = [np.array([(north, east)])], [np.array([course])], [np.array([0.0])]
    for arc in arcs:
        count = max(1, math.ceil(arc.length_m / _STEP_M))
        along = np.linspace(0.0, arc.length_m, count + 1)[1:]
        if arc.turn:
            radius = arc.turn * radius_m
            turned = course + along / radius
            place = np.column_stack(
                (
                    north + radius * (np.sin(turned) - math.sin(course)),
                    east + radius * (math.cos(course) - np.cos(turned)),
                )
            )
        else:
            turned = np.full(count, course)
            place = np.column_stack((north + along * math.cos(course), east + along * math.sin(course)))
        points.append(place)
        courses.append(turned)
        bends.append(np.full(count, arc.turn / radius_m))
        (north, east), course = place[-1].tolist(), float(turned[-1])
    return np.concatenate(points), np.concatenate(courses), np.concatenate(bends)


def _arc_m(points: Array) -> Array:
    return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))


def _turn_waypoints(turn: Track, radius_m: float) -> tuple[Array, Array]:
    """Waypoints inside a turn, so close together that the legs stay near it, and their distances along it."""
    arc = _arc_m(turn[0])
    chord_m = math.sqrt(8.0 * _TURN_DEVIATION_M * radius_m)
    count = max(2, math.ceil(float(arc[-1]) / chord_m))
    at = np.linspace(0.0, float(arc[-1]), count + 1)[1:-1]
    return np.column_stack([np.interp(at, arc, axis) for axis in turn[0].T]), at


def _along(line: SurveyLine, drape: Drape) -> Array:
    """Distances along a line: its ends, and places between such that straight legs follow the drape."""
    along = np.linspace(0.0, line.length_m, max(1, math.ceil(line.length_m / _DRAPE_STEP_M)) + 1)
    c, s = math.cos(line.course_rad), math.sin(line.course_rad)
    heights = drape.heights_m(line.start_ne_m[0] + along * c, line.start_ne_m[1] + along * s)
    return along[_simplified(along, heights, _LEVEL_M)]


def _simplified(along_m: Array, heights_m: Array, within_m: float) -> list[int]:
    """Indices of the fewest points whose straight connections stay near all (Douglas and Peucker 1973)."""
    stack = [(0, len(along_m) - 1)]
    kept = {0, len(along_m) - 1}
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        straight = np.interp(along_m[inner], along_m[[first, last]], heights_m[[first, last]])
        off = np.abs(heights_m[inner] - straight)
        k = int(np.argmax(off))
        if off[k] > within_m:
            kept.add(first + 1 + k)
            stack += [(first, first + 1 + k), (first + 1 + k, last)]
    return sorted(kept)


def check_lines(plan: LinePlan) -> None:
    """Refuse a survey without lines.

    Raises:
        PlanError: the area is too small for two lines.
    """
    if sum(line.kind is LineKind.LINE for line in plan.lines) < 2:
        raise PlanError(
            "the area holds fewer than two lines; ask for a larger `width_m` or a smaller `spacing_m`"
        )
