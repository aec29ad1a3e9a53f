"""Decides from the vehicle's own messages whether a flight has followed the commanded path.

A vehicle that reports the end of a mission may have flown something else. The check therefore uses the track
of GLOBAL_POSITION_INT, which a mission receives from every vehicle; the truth is used only for the score.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import GAP_S
from missions.flown.score import FlightScore, Track, path_errors_m
from missions.kind import VehicleKind
from missions.vehicle.notes import PATTERN, CutShort, FlightNotes, Phase

Array = NDArray[np.float64]

PATH_BOUND_M: Final = {VehicleKind.MULTICOPTER: 10.0, VehicleKind.FIXED_WING: 40.0}
"""Largest distance from the commanded path, by class of vehicle."""
WAYPOINT_SLACK_M: Final = {VehicleKind.MULTICOPTER: 3.0, VehicleKind.FIXED_WING: 15.0}
"""Distance beyond the acceptance radius at which an approach to a waypoint still counts as a pass."""

_AROUND_US: Final = 1_000_000  # before and after the phase: positions arrive at some Hz
_PLACES: Final = 100
_NAMED: Final = 3


def path_verdict(notes: FlightNotes, score: FlightScore, max_error_m: float | None = None) -> str:
    """The reason why the commanded path was not flown; "" if it was flown or none was commanded.

    The track must stay within a bound of the path, and pass every waypoint (of a path without waypoints: 100
    places along it), in order. Positions that were not received do not count against the flight.

    Args:
        notes, score: notes and score of one vehicle.
        max_error_m: the user's bound in place of `PATH_BOUND_M`; it also applies to waypoints.
    """

    commanded = notes.commanded
    if commanded is None:
        return ""
    phase = notes.phase(PATTERN)
    if phase is None:
        # a target may be found on the way to the pattern
        return "" if notes.cut_short is CutShort.FOUND else "the commanded path was not begun"
    track = flown_track(score, phase)
    if track is None:
        return NO_TRACK
    kind = VehicleKind(notes.kind)
    bound_m = PATH_BOUND_M[kind] if max_error_m is None else max_error_m
    points = commanded.points_ned_m
    error_m = float(path_errors_m(points, track.between(phase.start_us, phase.end_us)).max(initial=0.0))
    if max_error_m is None and error_m > bound_m:  # the user's own bound is checked separately
        return (
            f"the vehicle was up to {error_m:.1f} m off the commanded path by its own position; accepted: "
            f"{bound_m:g} m (`max_error_m`)"
        )
    if len(commanded.waypoints_ned_m):
        near_m = max(commanded.acceptance_m + WAYPOINT_SLACK_M[kind], max_error_m or 0.0)
        return waypoint_verdict(track, commanded.waypoints_ned_m, near_m, notes.cut_short)
    places = points[np.unique(np.linspace(0, len(points) - 1, _PLACES).astype(np.int64))]
    missed = missed_places(track, places, bound_m, notes.cut_short)
    if not missed:
        return ""
    return (
        f"{len(missed)} % of the commanded path were not flown: the vehicle's own position did not come "
        f"within {bound_m:g} m of them (`max_error_m`)"
    )


NO_TRACK: Final = "no position (GLOBAL_POSITION_INT) was received along the commanded path"


def flown_track(score: FlightScore, phase: Phase) -> Track | None:
    """The vehicle's own track during a phase; None: there is none."""
    if score.estimate is None:
        return None
    track = score.estimate.between(phase.start_us - _AROUND_US, phase.end_us + _AROUND_US)
    return track if len(track.time_s) > 1 else None


def waypoint_verdict(track: Track, waypoints_ned_m: Array, near_m: float, cut_short: CutShort | None) -> str:
    """The reason why not all waypoints were flown; "" if they were."""
    missed = missed_places(track, waypoints_ned_m, near_m, cut_short)
    if not missed:
        return ""
    shown = ", ".join(f"{k + 1} ({miss_m:.1f} m)" for k, miss_m in missed[:_NAMED])
    more = "" if len(missed) <= _NAMED else f" and {len(missed) - _NAMED} more"
    return (
        f"{len(missed)} of {len(waypoints_ned_m)} waypoints were not passed within {near_m:g} m by the "
        f"vehicle's own position: number {shown}{more}"
    )


def missed_places(
    track: Track, places_ned_m: Array, near_m: float, cut_short: CutShort | None
) -> list[tuple[int, float]]:
    """Places (index, nearest approach) that a track did not pass in order.

    Places that may have been passed while no position was received are left out. In a flight that was cut
    short, so are those after the last pass; without any pass all were missed, unless the target was found
    before the first.
    """
    distances = [_distances_m(place, track.pos_ned_m) for place in places_ned_m]
    chosen = _passed_in_order([_stays(distance <= near_m) for distance in distances])
    gaps = np.nonzero(np.diff(track.time_s) > GAP_S)[0]
    excused_after = len(places_ned_m)
    if cut_short is not None and (chosen or cut_short is CutShort.FOUND):
        excused_after = max(chosen, default=-1)
    missed = []
    for k, distance in enumerate(distances):
        if k in chosen or k > excused_after:
            continue
        before = max((leg for j, leg in chosen.items() if j < k), default=0)
        after = min((leg for j, leg in chosen.items() if j > k), default=len(distance) - 1)
        if not any(before <= gap <= after for gap in gaps):
            missed.append((k, float(distance[before : after + 1].min())))
    return missed


def _distances_m(place_ned_m: Array, track_ned_m: Array) -> Array:
    """Distance (n - 1,) of a place from each leg of a track."""
    starts, legs = track_ned_m[:-1], np.diff(track_ned_m, axis=0)
    offset = place_ned_m - starts
    squared = np.maximum((legs**2).sum(axis=1), 1e-12)
    along = np.clip(np.einsum("ij,ij->i", offset, legs) / squared, 0.0, 1.0)
    distance: Array = np.linalg.norm(offset - along[:, None] * legs, axis=1)
    return distance


def _stays(near: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last leg of each stretch of a track that is near a place."""
    within = np.nonzero(near)[0]
    if not len(within):
        return []
    parts = np.split(within, np.nonzero(np.diff(within) > 1)[0] + 1)
    return [(int(part[0]), int(part[-1])) for part in parts]


def _passed_in_order(stays: list[list[tuple[int, int]]]) -> dict[int, int]:
    """Assign legs to as many places as possible, in non-decreasing order, each within a stay at its place.

    This is the longest chain: `chains[n]` is the chain of n + 1 places that ends at the earliest leg.
    """
    chains: list[_Pass] = []
    for k, own in enumerate(stays):
        longer = list(chains)
        for n in range(len(chains), -1, -1):
            before = chains[n - 1] if n else None
            from_leg = before.leg if before is not None else 0
            leg = min((max(from_leg, first) for first, last in own if last >= from_leg), default=None)
            if leg is not None and (n == len(chains) or leg < chains[n].leg):
                longer[n : n + 1] = [_Pass(place=k, leg=leg, before=before)]
            if n and n == len(chains) and leg is not None and len(chains) == k:
                break  # all places so far were passed: a shorter chain is not needed
        chains = longer
    chosen: dict[int, int] = {}
    link = chains[-1] if chains else None
    while link is not None:
        chosen[link.place] = link.leg
        link = link.before
    return chosen


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pass:
    """The last place of a chain of passes, its leg of the track, and the previous pass."""

    place: int
    leg: int
    before: "_Pass | None"
