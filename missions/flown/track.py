"""A track against its path: which waypoints it has passed and how near, and its distance (compiled)."""

import math
from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray

from estimators.received import GAP_S
from flightsim.foundation.kernels import kernel
from missions.vehicle.notes import CommandedPath

Array = NDArray[np.float64]


def waypoint_misses_m(commanded: CommandedPath, time_s: Array, track_ned_m: Array) -> tuple[float, ...]:
    """Smallest distance of the track from each waypoint; between two samples the track is straight. NaN: it
    may have been passed in a gap, in which nothing was received.

    Waypoints count in order: of all assignments of passes (within the acceptance radius) to waypoints, the
    one with the most passes is used. A waypoint that was missed, and that the track crosses later, therefore
    does not affect others. For a waypoint without a pass the distance is that between its neighbours' passes.

    Args:
        commanded: path with waypoints and acceptance radius.
        time_s, track_ned_m: track, (n,) and (n, 3).
    """
    points = track_ned_m
    if len(points) < 2:
        return ()
    legs = np.diff(points, axis=0)
    squared = np.maximum((legs**2).sum(axis=1), 1e-12)
    gap = np.diff(time_s) > GAP_S

    def distances(waypoint: Array) -> Array:
        offset = waypoint - points[:-1]
        along = np.clip(np.einsum("ij,ij->i", offset, legs) / squared, 0.0, 1.0)
        nearest: Array = np.linalg.norm(offset - along[:, None] * legs, axis=1)
        return np.where(gap, np.inf, nearest)

    waypoints = commanded.waypoints_ned_m
    chosen = _passes_in_order([_passes(distances(w), commanded.acceptance_m) for w in waypoints])
    misses: list[float] = []
    for k, waypoint in enumerate(waypoints):
        distance = distances(waypoint)
        if k in chosen:
            misses.append(float(distance[chosen[k]]))
            continue
        before = max((leg for j, leg in chosen.items() if j < k), default=0)
        after = min((leg for j, leg in chosen.items() if j > k), default=len(distance) - 1)
        seen = not gap[before : after + 1].any()
        misses.append(float(distance[before : after + 1].min()) if seen else math.nan)
    return tuple(misses)


def _passes(distance: Array, radius_m: float) -> list[int]:
    """The leg of the track with the closest approach of each pass, in order."""
    within = np.nonzero(distance <= radius_m)[0]
    if not len(within):
        return []
    parts = np.split(within, np.nonzero(np.diff(within) > 1)[0] + 1)
    return [int(part[0] + distance[part].argmin()) for part in parts]


def _passes_in_order(passes: list[list[int]]) -> dict[int, int]:
    """Assign legs to as many waypoints as possible, in non-decreasing order; early legs are preferred.

    This is the longest chain, by patience sorting: `last[n]` is the earliest leg at which a chain of n + 1
    can end.
    """
    last: list[int] = []
    ends: list[tuple[int, int]] = []
    before: dict[tuple[int, int], tuple[int, int] | None] = {}
    for k, legs in enumerate(passes):
        for leg in reversed(legs):  # the latest first, so that no chain takes two legs of one waypoint
            n = bisect_right(last, leg)
            before[k, leg] = ends[n - 1] if n else None
            last[n : n + 1] = [leg]
            ends[n : n + 1] = [(k, leg)]
    chosen: dict[int, int] = {}
    link = ends[-1] if ends else None
    while link is not None:
        chosen[link[0]] = link[1]
        link = before[link]
    return chosen


@kernel
def follow_path(
    path: Array, track: Array, resumed: NDArray[np.int64], back_m: float, ahead_m: float, errors: Array
) -> None:
    """Write the distance of track[k] from the path (m, 3) to errors[k], searched near the place found for
    track[k - 1].

    Legs are searched from `back_m` before that place to `ahead_m` plus the last error after it. Where nothing
    was received before track[k], `resumed[k]` is the end of a stretch of the track from k on, else 0: of all
    places onwards that are near track[k], the path is followed from the one that suits the stretch best.
    """
    first = 0  # leg of the place that was found last
    along_m = 0.0  # distance of that place from the leg's start
    last_error = ahead_m
    for k in range(track.shape[0]):
        if resumed[k] > k:
            stretch = track[k : resumed[k]]
            first, along_m, last_error = _resumed_place(path, stretch, first, along_m, back_m, ahead_m)
        last_error, first, along_m = _nearest(path, track[k], first, along_m, back_m, ahead_m + last_error)
        errors[k] = last_error


@kernel
def _nearest(
    path: Array, point: Array, first: int, along_m: float, back_m: float, ahead_m: float
) -> tuple[float, int, float]:
    """Distance of a point from the path near a place on it; leg of the nearest place, and how far along."""
    leg = first
    behind = along_m
    while leg > 0 and behind < back_m:
        leg -= 1
        behind += _leg_length(path, leg)
    ahead = -behind
    best, best_leg, best_along = math.inf, first, along_m
    while leg < path.shape[0] - 1 and ahead <= ahead_m:
        distance, along = _from_leg(path, leg, point)
        if distance < best:
            best, best_leg, best_along = distance, leg, along
        length = _leg_length(path, leg)
        ahead += length
        leg += 1
    return best, best_leg, best_along


@kernel
def _resumed_place(
    path: Array, stretch: Array, first: int, along_m: float, back_m: float, ahead_m: float
) -> tuple[int, float, float]:
    """Leg, distance along it, and distance of the place onwards of a place from which a stretch of a track
    suits the path best.
    """
    nearest, _, _ = _nearest(path, stretch[0], first, along_m, back_m, math.inf)
    least = math.inf
    best_leg, best_along, best_error = first, along_m, nearest
    before = math.inf
    leg = max(0, first)
    while leg < path.shape[0] - 1:
        distance, along = _from_leg(path, leg, stretch[0])
        after = math.inf
        if leg + 2 < path.shape[0]:
            after, _ = _from_leg(path, leg + 1, stretch[0])
        if distance <= nearest + ahead_m and distance <= before and distance < after:
            squares, error, at_leg, at_along = 0.0, distance, leg, along
            for k in range(stretch.shape[0]):
                error, at_leg, at_along = _nearest(
                    path, stretch[k], at_leg, at_along, back_m, ahead_m + error
                )
                squares += error * error
            if squares < least:
                least = squares
                best_leg, best_along, best_error = leg, along, distance
        before = distance
        leg += 1
    return best_leg, best_along, best_error


@kernel
def _from_leg(path: Array, leg: int, point: Array) -> tuple[float, float]:
    """Distance of a point from a leg of the path, and the nearest place's distance along the leg."""
    length = _leg_length(path, leg)
    dx = path[leg + 1, 0] - path[leg, 0]
    dy = path[leg + 1, 1] - path[leg, 1]
    dz = path[leg + 1, 2] - path[leg, 2]
    ox = point[0] - path[leg, 0]
    oy = point[1] - path[leg, 1]
    oz = point[2] - path[leg, 2]
    f = 0.0
    if length > 0.0:
        f = min(1.0, max(0.0, (ox * dx + oy * dy + oz * dz) / (length * length)))
    return math.sqrt((ox - f * dx) ** 2 + (oy - f * dy) ** 2 + (oz - f * dz) ** 2), f * length


@kernel
def _leg_length(path: Array, leg: int) -> float:
    dx = path[leg + 1, 0] - path[leg, 0]
    dy = path[leg + 1, 1] - path[leg, 1]
    dz = path[leg + 1, 2] - path[leg, 2]
    return math.sqrt(dx * dx + dy * dy + dz * dz)
