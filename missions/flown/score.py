"""Scores of how well a flight followed the commanded path, from the recorded frames.

The reference is the truth (HIL_STATE_QUATERNION from any component of the system) when it is recorded,
otherwise the autopilot's own estimate. The commanded path starts at the true position of the vehicle when it
was armed, because that is the user's "home": a constant error of the receiver at the start moves home and
path by the same amount. The same errors with home as the vehicle reports it are given as `..._absolute_m`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.wire_units import UNKNOWN_UINT16, cdeg_degrees, metres
from estimators.received import GAP_S, broken_at_gaps, gaps_of, not_in_gaps, received_times, together
from estimators.tracking.metrics import rms
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import euler_from_quaternions, quaternions_from_euler
from missions.flown.records import FlightRecords, place_of, positions_ned_m
from missions.flown.track import follow_path, waypoint_misses_m
from missions.vehicle.notes import PATTERN, FlightNotes

Array = NDArray[np.float64]

_BACK_M: Final = 3.0  # distance back along the path within which the nearest point is searched
_AHEAD_M: Final = 15.0
_RESUMED_S: Final = 5.0  # stretch after a gap by which its place on the path is found
_IN_FLIGHT_M: Final = 0.5
_LEVEL_M: Final = 0.01
_TRUTH_ATTITUDE: Final = ("attitude_quaternion",)
_TARGET_ATTITUDE: Final = ("q",)
_EULER_ANGLES: Final = ("roll", "pitch", "yaw")
_SHORTEST_QUATERNION: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """A flown track: vehicle time and NED from a path's origin. In its gaps nothing was received.

    Attributes:
        time_s: (n,), strictly increasing.
        pos_ned_m: (n, 3).
        yaw_rad: (n,).
    """

    time_s: Array
    pos_ned_m: Array
    yaw_rad: Array

    def between(self, start_us: int, end_us: int) -> "Track":
        """The part between two vehicle times."""
        kept = (self.time_s >= start_us * 1e-6) & (self.time_s <= end_us * 1e-6)
        return Track(time_s=self.time_s[kept], pos_ned_m=self.pos_ned_m[kept], yaw_rad=self.yaw_rad[kept])

    def thinned(self, stride: int) -> "Track":
        """Each `stride`-th point of each part between two gaps, and the last one of it."""
        if stride < 2:
            return self
        kept = np.concatenate([np.unique(np.append(part[::stride], part[-1:])) for part in self._parts()])
        return Track(time_s=self.time_s[kept], pos_ned_m=self.pos_ned_m[kept], yaw_rad=self.yaw_rad[kept])

    def drawn(self) -> tuple[Array, Array]:
        """Times and positions with a row of NaN in each gap, so that no line is drawn there."""
        time_s, pos_ned_m = broken_at_gaps(self.time_s, self.pos_ned_m)
        return time_s, pos_ned_m

    def _parts(self) -> list[NDArray[np.int64]]:
        """Rows of each part between two gaps."""
        return np.split(np.arange(len(self.time_s)), np.flatnonzero(np.diff(self.time_s) > GAP_S) + 1)

    @property
    def length_m(self) -> float:
        """Distance flown while positions were received, from at most 10 points a second, so that noise does
        not increase it.
        """
        if len(self.time_s) < 2:
            return 0.0
        step_s = float(np.median(np.diff(self.time_s)))
        stride = max(1, round(0.1 / max(step_s, 1e-3)))
        return sum(
            float(np.linalg.norm(np.diff(self.pos_ned_m[part[::stride]], axis=0), axis=1).sum())
            for part in self._parts()
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightScore:
    """The data of one vehicle's flight for the summary and the picture. None: not measured.

    Attributes:
        truth, estimate: tracks; times strictly increasing.
        error_time_s, error_m: times, and distances of the reference track to the commanded path, during the
            pattern.
        reference: "truth" or "estimate".
        waypoint_misses_m: nearest approach to each waypoint; NaN: it may have been passed in a gap.
        altitude_rms_error_m: error of the height only, along a level pattern.
        gaps_s: begin and end of each gap of the reference in the flight: nothing was received.
        left_out: number of messages that were left out, by reason: attitudes that are not finite (or a
            quaternion of zero length), and positions and times that no vehicle can have.
    """

    truth: Track | None
    estimate: Track | None
    error_time_s: Array
    error_m: Array
    reference: str
    distance_m: float
    path_rms_error_m: float | None
    path_max_error_m: float | None
    path_rms_error_absolute_m: float | None
    path_rms_error_estimate_m: float | None
    max_attitude_error_deg: float | None
    max_attitude_tracking_error_deg: float | None
    waypoint_misses_m: tuple[float, ...]
    altitude_rms_error_m: float | None = None
    gaps_s: tuple[tuple[float, float], ...] = ()
    left_out: Mapping[str, int] = field(default_factory=dict)


def score(records: FlightRecords, notes: FlightNotes) -> FlightScore:
    """Score one vehicle's flight."""
    system_id = notes.system_id
    commanded = notes.commanded
    truth_table, truth_bad = _usable(records.truth(system_id), _TRUTH_ATTITUDE)
    attitude, attitude_bad = _usable(records.table("ATTITUDE", system_id, 1), _EULER_ANGLES)
    target, target_bad = _usable(records.table("ATTITUDE_TARGET", system_id, 1), _TARGET_ATTITUDE)
    attitude, attitude_late = _in_time_order(attitude)
    target, target_late = _in_time_order(target)
    estimate_table = records.positions(system_id)
    origin = commanded.origin if commanded else _first_place(truth_table, estimate_table)
    absolute = _track(truth_table, origin, "time_usec", 1e-6) if origin is not None else None
    estimate = _estimate_track(estimate_table, origin, attitude) if origin is not None else None
    truth, moved = None, np.zeros(3)
    if absolute is not None and notes.phases:
        start = int(np.searchsorted(absolute.time_s, notes.phases[0].start_us * 1e-6))
        moved = absolute.pos_ned_m[min(start, len(absolute.time_s) - 1)].copy()
        truth = Track(time_s=absolute.time_s, pos_ned_m=absolute.pos_ned_m - moved, yaw_rad=absolute.yaw_rad)
    elif absolute is not None:
        truth = absolute
    reference = truth if truth is not None else estimate
    phase = notes.phase(PATTERN)
    nothing = np.zeros(0)
    error_time, error = nothing, nothing
    misses: tuple[float, ...] = ()
    absolute_rms = estimate_rms = altitude_rms = None
    if commanded is not None and phase is not None and reference is not None:
        window = (phase.start_us, phase.end_us)
        pattern = reference.between(*window)
        error_time, error = pattern.time_s, path_errors_m(commanded.points_ned_m, pattern)
        down = commanded.points_ned_m[:, 2]
        if len(down) and np.ptp(down) < _LEVEL_M:
            altitude_rms = _rms(pattern.pos_ned_m[:, 2] - down[0])
        misses = waypoint_misses_m(commanded, pattern.time_s, pattern.pos_ned_m)
        if absolute is not None:
            flat = absolute.between(*window)
            flat = replace(flat, pos_ned_m=flat.pos_ned_m - np.array([0.0, 0.0, moved[2]]))
            absolute_rms = _rms(path_errors_m(commanded.points_ned_m, flat))
        if estimate is not None:
            estimate_rms = _rms(path_errors_m(commanded.points_ned_m, estimate.between(*window)))
    not_finite = truth_bad + attitude_bad + target_bad
    return FlightScore(
        truth=truth,
        estimate=estimate,
        error_time_s=error_time,
        error_m=error,
        reference="truth" if truth is not None else "estimate",
        distance_m=_distance_m(reference, notes),
        path_rms_error_m=_rms(error),
        path_max_error_m=float(error.max()) if len(error) else None,
        path_rms_error_absolute_m=absolute_rms,
        path_rms_error_estimate_m=estimate_rms,
        max_attitude_error_deg=_attitude_error_deg(truth_table, attitude, reference),
        max_attitude_tracking_error_deg=_tracking_error_deg(target, attitude, reference),
        waypoint_misses_m=misses,
        altitude_rms_error_m=altitude_rms,
        gaps_s=_gaps_s(reference, notes),
        left_out=together(
            {"attitude_not_finite": not_finite} if not_finite else {},
            records.left_out(system_id),
            attitude_late,
            target_late,
        ),
    )


def path_errors_m(path_ned_m: Array, track: Track) -> Array:
    """Distance (n,) from each track point to the path, following the path onwards.

    The nearest point is searched near the previous one, from 3 m back to 15 m ahead (more when the error is
    large), so that at a crossing of the path the other branch is not used. After a gap the path is followed
    from where the next 5 s suit it best: how far the vehicle flew meanwhile is not known.
    """
    if len(path_ned_m) < 2 or not len(track.time_s):
        return np.zeros(0)

    errors = np.empty(len(track.time_s))
    resumed = np.zeros(len(track.time_s), dtype=np.int64)
    gaps = np.flatnonzero(np.diff(track.time_s) > GAP_S) + 1
    ends = np.searchsorted(track.time_s, track.time_s[gaps] + _RESUMED_S)
    resumed[gaps] = np.minimum(np.maximum(ends, gaps + 1), np.append(gaps[1:], len(track.time_s)))
    path, points = np.ascontiguousarray(path_ned_m), np.ascontiguousarray(track.pos_ned_m)
    follow_path(path, points, resumed, _BACK_M, _AHEAD_M, errors)
    return errors


def _rms(values: Array) -> float | None:
    return rms(values) if len(values) else None


def _usable(table: NDArray[np.void], names: tuple[str, ...]) -> tuple[NDArray[np.void], int]:
    """Rows with a valid attitude (three angles, or a quaternion), and the number of the other rows."""
    values = np.column_stack([table[name].astype(np.float64) for name in names])
    kept: NDArray[np.bool_] = np.all(np.isfinite(values), axis=1)
    if len(names) == 1:
        kept &= np.linalg.norm(np.where(kept[:, None], values, 0.0), axis=1) > _SHORTEST_QUATERNION
    return table[kept], int(np.count_nonzero(~kept))


def _in_time_order(table: NDArray[np.void]) -> tuple[NDArray[np.void], Mapping[str, int]]:
    """Rows with strictly increasing time, and the number of the others by reason."""
    found = received_times(table["time_boot_ms"].astype(np.int64) * 1000)
    return table[found.rows], found.left_out


def _first_place(*tables: NDArray[np.void]) -> GeodeticPosition | None:
    for table in tables:
        if len(table):
            return place_of(table[0])
    return None


def _track(table: NDArray[np.void], origin: GeodeticPosition, field: str, scale: float) -> Track | None:
    if not len(table):
        return None
    return Track(
        time_s=table[field] * scale,
        pos_ned_m=positions_ned_m(table, LocalFrame(origin)),
        yaw_rad=euler_from_quaternions(table["attitude_quaternion"])[2],
    )


def _estimate_track(
    table: NDArray[np.void], origin: GeodeticPosition, attitude: NDArray[np.void]
) -> Track | None:
    if not len(table):
        return None
    position = positions_ned_m(table, LocalFrame(origin))
    position[:, 2] = -metres(table["relative_alt"])
    time_s = table["time_boot_ms"] * 1e-3
    if len(attitude):
        yaw = np.interp(time_s, attitude["time_boot_ms"] * 1e-3, np.unwrap(attitude["yaw"]))
    else:
        yaw = np.where(table["hdg"] == UNKNOWN_UINT16, 0.0, np.radians(cdeg_degrees(table["hdg"])))
    return Track(time_s=time_s, pos_ned_m=position, yaw_rad=yaw)


def _distance_m(track: Track | None, notes: FlightNotes) -> float:
    if track is None or not notes.phases:
        return 0.0
    return track.between(notes.phases[0].start_us, notes.phases[-1].end_us).length_m


def _gaps_s(track: Track | None, notes: FlightNotes) -> tuple[tuple[float, float], ...]:
    """Gaps of a track in the flight, also before its first and after its last position."""
    if track is None or not notes.phases:
        return ()
    span_s = notes.phases[0].start_us * 1e-6, notes.phases[-1].end_us * 1e-6
    inside = track.time_s[(track.time_s > span_s[0]) & (track.time_s < span_s[1])]
    return tuple(gaps_of(np.concatenate((span_s[:1], inside, span_s[1:]))))


def _airborne(times_s: Array, track: Track | None) -> NDArray[np.bool_]:
    if track is None:
        return np.ones(len(times_s), dtype=bool)
    height = -np.interp(times_s, track.time_s, track.pos_ned_m[:, 2])
    return height > _IN_FLIGHT_M


def _quaternions(attitude: NDArray[np.void]) -> Array:
    """q_ned_from_frd (n, 4) of ATTITUDE messages."""
    return quaternions_from_euler(*(attitude[name].astype(np.float64) for name in ("roll", "pitch", "yaw")))


def _largest_angle_deg(
    times_s: Array, q: Array, other_times_s: Array, other_q: Array, track: Track | None
) -> float | None:
    """Largest angle between two attitude histories in flight; the second is interpolated."""
    kept = _airborne(times_s, track) & not_in_gaps(times_s, other_times_s)
    if not kept.any():
        return None
    signs = np.concatenate(
        ([1.0], np.cumprod(np.where((other_q[1:] * other_q[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)))
    )
    continuous = other_q * signs[:, None]
    at = np.column_stack([np.interp(times_s[kept], other_times_s, c) for c in continuous.T])
    at /= np.linalg.norm(at, axis=1)[:, None]
    dot = np.clip(np.abs((at * q[kept]).sum(axis=1)), 0.0, 1.0)
    return float(np.degrees(2.0 * np.arccos(dot)).max())


def _attitude_error_deg(
    truth: NDArray[np.void], attitude: NDArray[np.void], track: Track | None
) -> float | None:
    """Largest angle between the autopilot's attitude and the true one, in flight."""
    if len(truth) < 2 or len(attitude) < 2:
        return None
    return _largest_angle_deg(
        attitude["time_boot_ms"] * 1e-3,
        _quaternions(attitude),
        truth["time_usec"] * 1e-6,
        truth["attitude_quaternion"].astype(np.float64),
        track,
    )


def _tracking_error_deg(
    target: NDArray[np.void], attitude: NDArray[np.void], track: Track | None
) -> float | None:
    """Largest angle between the controller's attitude setpoint and the autopilot's attitude, in flight."""
    if len(target) < 2 or len(attitude) < 2:
        return None
    return _largest_angle_deg(
        target["time_boot_ms"] * 1e-3,
        target["q"].astype(np.float64),
        attitude["time_boot_ms"] * 1e-3,
        _quaternions(attitude),
        track,
    )
