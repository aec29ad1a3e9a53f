"""A path as a function of time: position, velocity, acceleration and yaw."""

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import ArcLengthTable, Array, Curve
from missions.patterns.polyline import Polyline
from missions.planning.profile import STEP_S, Profile, speed_profile
from missions.vehicle.limits import MulticopterLimits

_BISECTIONS: Final = 14
_SAME_COURSE_RAD: Final = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class TrajectoryPoint:
    """Commanded state at one time: NED from the pattern's origin, m, m/s, m/s^2, rad, rad/s."""

    position_ned_m: tuple[float, float, float]
    velocity_ned_m_s: tuple[float, float, float]
    acceleration_ned_m_s2: tuple[float, float, float]
    yaw_rad: float
    yaw_rate_rad_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """A trajectory sampled every `step_s`; between the samples it is linear.

    Attributes:
        step_s: time between samples.
        position_ned_m, velocity_ned_m_s, acceleration_ned_m_s2: (n, 3).
        yaw_rad: (n,), continuous (unwrapped).
        yaw_rate_rad_s: (n,).
    """

    step_s: float
    position_ned_m: Array
    velocity_ned_m_s: Array
    acceleration_ned_m_s2: Array
    yaw_rad: Array
    yaw_rate_rad_s: Array

    @property
    def duration_s(self) -> float:
        return (len(self.yaw_rad) - 1) * self.step_s

    @property
    def length_m(self) -> float:
        """Distance along the samples."""
        return float(np.linalg.norm(np.diff(self.position_ned_m, axis=0), axis=1).sum())

    @property
    def max_speed_m_s(self) -> float:
        return float(np.linalg.norm(self.velocity_ned_m_s, axis=1).max())

    @property
    def max_acceleration_m_s2(self) -> float:
        return float(np.linalg.norm(self.acceleration_ned_m_s2, axis=1).max())

    def at(self, time_s: float) -> TrajectoryPoint:
        """The point at a time; before the start the first point, after the end the last."""
        place = min(max(time_s / self.step_s, 0.0), len(self.yaw_rad) - 1.0)
        k = min(int(place), len(self.yaw_rad) - 2)
        f = place - k
        return TrajectoryPoint(
            position_ned_m=_between(self.position_ned_m, k, f),
            velocity_ned_m_s=_between(self.velocity_ned_m_s, k, f),
            acceleration_ned_m_s2=_between(self.acceleration_ned_m_s2, k, f),
            yaw_rad=math.remainder(float(self.yaw_rad[k] * (1.0 - f) + self.yaw_rad[k + 1] * f), math.tau),
            yaw_rate_rad_s=float(self.yaw_rate_rad_s[k] * (1.0 - f) + self.yaw_rate_rad_s[k + 1] * f),
        )


def _between(table: Array, k: int, f: float) -> tuple[float, float, float]:
    a, b = table[k], table[k + 1]
    return (float(a[0] + f * (b[0] - a[0])), float(a[1] + f * (b[1] - a[1])), float(a[2] + f * (b[2] - a[2])))


def plan_trajectory(
    curve: Curve,
    *,
    altitude_m: float,
    speed_m_s: float,
    limits: MulticopterLimits,
    duration_s: float | None = None,
) -> Trajectory:
    """Plan the flight of a curve from rest to rest at constant altitude, with yaw along the path.

    Speed is `speed_m_s` wherever curvature, yaw rate and acceleration allow; at sharp corners and cusps
    the vehicle stops and turns.

    Args:
        curve: pattern around the origin of the local frame.
        altitude_m: height above the origin.
        speed_m_s: commanded ground speed.
        limits: limits of the vehicle.
        duration_s: end at rest after this time (the search time), if the curve is not finished before.

    Raises:
        PlanError: speed or altitude are out of the limits, or the curve extends too far.
    """
    limits.check_speed(speed_m_s)
    limits.check_altitude(altitude_m)
    coarse = curve.points(np.linspace(0.0, curve.end, 1000))
    limits.check_reach(float(np.hypot(*coarse.T).max()))
    table = ArcLengthTable.of(curve)
    pieces = _plan_pieces(table, len(table.arc_m) - 1, speed_m_s, limits)
    if duration_s is not None and _duration_s(pieces) > duration_s:
        pieces = _cut(table, pieces, speed_m_s, limits, duration_s)
    return _assemble(curve, table, pieces, altitude_m)


def line_trajectory(
    start_ned_m: tuple[float, float, float],
    stop_ned_m: tuple[float, float, float],
    *,
    speed_m_s: float,
    limits: MulticopterLimits,
) -> Trajectory:
    """Plan a straight flight between two points, from rest to rest; yaw along the path (0 for a vertical
    climb).
    """
    start, stop = np.array(start_ned_m), np.array(stop_ned_m)
    distance = float(np.linalg.norm(stop - start))
    if distance < 1e-3:
        raise PlanError("a line between two equal points has no length")
    profile = speed_profile(np.array([0.0, distance]), np.zeros(2), min(speed_m_s, limits.speed_m_s), limits)
    along = (stop - start) / distance
    horizontal = math.hypot(along[0], along[1])
    yaw = math.atan2(along[1], along[0]) if horizontal > 1e-3 else 0.0
    return Trajectory(
        step_s=STEP_S,
        position_ned_m=start + profile.arc_m[:, None] * along,
        velocity_ned_m_s=profile.speed_m_s[:, None] * along,
        acceleration_ned_m_s2=profile.acceleration_m_s2[:, None] * along,
        yaw_rad=np.full(len(profile.arc_m), yaw),
        yaw_rate_rad_s=np.zeros(len(profile.arc_m)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Piece:
    """One stretch between stops.

    Attributes:
        profile: distance, speed and acceleration in time.
        first, last: its first and last knot.
        arc_m, course_rad, curvature_per_m: values at these knots, on the inner side of the stretch.
        turn_s: time for the turn on the spot before it.
    """

    profile: Profile
    first: int
    last: int
    arc_m: Array
    course_rad: Array
    curvature_per_m: Array
    turn_s: float


def _plan_pieces(
    table: ArcLengthTable, end: int, speed_m_s: float, limits: MulticopterLimits
) -> list[_Piece]:
    bounds = [0, *(k for k in table.stops if k < end), end]
    pieces: list[_Piece] = []
    for first, last in itertools.pairwise(bounds):
        knots = slice(first, last + 1)
        arc = table.arc_m[knots]
        curvature, course = table.curvature_per_m[knots].copy(), table.course_rad[knots].copy()
        if len(arc) > 2:  # a stop belongs to neither side: its curvature and course are those of the turn
            curvature[0], curvature[-1] = curvature[1], curvature[-2]
            if abs(course[1] - course[0]) > _SAME_COURSE_RAD:
                course[0] = course[1]
            if abs(course[-1] - course[-2]) > _SAME_COURSE_RAD:
                course[-1] = course[-2]
        turn = abs(course[0] - pieces[-1].course_rad[-1]) if pieces else 0.0
        pieces.append(
            _Piece(
                profile=speed_profile(arc, curvature, speed_m_s, limits),
                first=first,
                last=last,
                arc_m=arc,
                course_rad=course,
                curvature_per_m=curvature,
                turn_s=1.5 * turn / limits.yaw_rate_rad_s,
            )
        )
    return pieces


def _duration_s(pieces: list[_Piece]) -> float:
    return sum((len(p.profile.arc_m) - 1) * STEP_S + p.turn_s for p in pieces)


def _cut(
    table: ArcLengthTable,
    pieces: list[_Piece],
    speed_m_s: float,
    limits: MulticopterLimits,
    duration_s: float,
) -> list[_Piece]:
    """The longest plan that ends at rest within the time."""
    kept: list[_Piece] = []
    left = duration_s
    for piece in pieces:
        needs = _duration_s([piece])
        if needs > left:
            break
        kept.append(piece)
        left -= needs
    else:
        return kept
    low, high = piece.first + 1, piece.last
    best: list[_Piece] = []
    for _ in range(_BISECTIONS):
        middle = (low + high) // 2
        tail = _plan_pieces(table, middle, speed_m_s, limits)[-1]
        if _duration_s([tail]) <= left:
            best, low = [tail], middle
        else:
            high = middle
        if high - low <= 1:
            break
    if not kept and not best:
        raise PlanError(
            f"a search time of {duration_s:g} s is too short to fly anything; ask for more `search_time_s`"
        )
    return kept + best


def _assemble(curve: Curve, table: ArcLengthTable, pieces: list[_Piece], altitude_m: float) -> Trajectory:
    positions: list[Array] = []
    velocities: list[Array] = []
    accelerations: list[Array] = []
    yaws: list[Array] = []
    yaw_rates: list[Array] = []
    for piece in pieces:
        if piece.turn_s > 0.0 and positions:
            _append_turn(piece, positions, velocities, accelerations, yaws, yaw_rates)
        arc, speed, push = piece.profile.arc_m, piece.profile.speed_m_s, piece.profile.acceleration_m_s2
        course = np.interp(arc, piece.arc_m, piece.course_rad)
        bend = np.interp(arc, piece.arc_m, piece.curvature_per_m)
        points = curve.points(table.parameter_at(arc))
        along = np.stack((np.cos(course), np.sin(course), np.zeros_like(course)), axis=1)
        across = np.stack((-np.sin(course), np.cos(course), np.zeros_like(course)), axis=1)
        positions.append(np.column_stack((points, np.full(len(points), -altitude_m))))
        velocities.append(speed[:, None] * along)
        accelerations.append(push[:, None] * along + (speed**2 * bend)[:, None] * across)
        yaws.append(course)
        yaw_rates.append(bend * speed)
    return Trajectory(
        step_s=STEP_S,
        position_ned_m=np.concatenate(positions),
        velocity_ned_m_s=np.concatenate(velocities),
        acceleration_ned_m_s2=np.concatenate(accelerations),
        yaw_rad=np.concatenate(yaws),
        yaw_rate_rad_s=np.concatenate(yaw_rates),
    )


def _append_turn(
    piece: _Piece,
    positions: list[Array],
    velocities: list[Array],
    accelerations: list[Array],
    yaws: list[Array],
    yaw_rates: list[Array],
) -> None:
    """Stand still and turn from one course to the next, smoothly (cubic)."""
    count = max(2, math.ceil(piece.turn_s / STEP_S))
    f = np.arange(1, count) / count
    start, stop = yaws[-1][-1], piece.course_rad[0]
    positions.append(np.repeat(positions[-1][-1:], count - 1, axis=0))
    velocities.append(np.zeros((count - 1, 3)))
    accelerations.append(np.zeros((count - 1, 3)))
    yaws.append(start + (stop - start) * f * f * (3.0 - 2.0 * f))
    yaw_rates.append((stop - start) * 6.0 * f * (1.0 - f) / (count * STEP_S))


def flight_curve(curve: Curve, corner_m: float) -> Curve:
    """The curve as it is flown by setpoints: a polyline gets rounded corners."""
    return curve.rounded(corner_m) if isinstance(curve, Polyline) else curve
