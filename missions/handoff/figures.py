"""The entries of `summary.json` about a handoff, its verdict, and what its picture is made from."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.handoff import HandoffEstimate
from estimators.received import GAP_US, interpolated
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.vectors import euler_from_quaternions
from missions.base.report import Debriefing
from missions.flown.records import FlightRecords, place_of, positions_ned_m
from missions.flown.targets import true_targets
from missions.handoff.team import HandoffTeam

__all__ = ["HandoffTruth", "handoff_figures", "handoff_truth", "handoff_verdict"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandoffTruth:
    """Both aircraft and all targets as they truly were, from the home of the first aircraft.

    Attributes:
        time_us: (n,) times of the first aircraft's truth.
        aircraft: of each aircraft, (n, 3): north, east, yaw (not wrapped).
        targets: (m, n, 2) north and east.
    """

    time_us: Array
    aircraft: tuple[Array, Array]
    targets: Array

    def at(self, time_us: float, columns: Array) -> Array:
        """Columns (n, k) at a time; NaN: not received."""
        return interpolated(time_us, self.time_us, columns, gap=GAP_US)

    def placed(self, index: int, estimates: Sequence[HandoffEstimate]) -> Array:
        """North and east (n, 2) of the targets of estimates, by true place and heading of the aircraft."""
        found = np.full((len(estimates), 2), np.nan)
        for row, estimate in enumerate(estimates):
            north, east, yaw = self.at(estimate.time_us, self.aircraft[index]).tolist()
            c, s = math.cos(yaw), math.sin(yaw)
            x, y = estimate.target_m
            found[row] = north + c * x - s * y, east + s * x + c * y
        return found

    def nearest(self, time_us: float, place_ne_m: Array) -> tuple[int, float] | None:
        """The target nearest to a place, and its distance; None: there is no target or no place, or the place
        of a target is not known.
        """
        if not len(self.targets) or not np.isfinite(place_ne_m).all():
            return None
        places = np.array([self.at(time_us, target) for target in self.targets])
        off = np.hypot(*(places - place_ne_m).T)
        return (int(off.argmin()), float(off.min())) if np.isfinite(off).all() else None


def handoff_truth(records: FlightRecords, system_ids: Sequence[int]) -> HandoffTruth | None:
    """The truth in the records; None without it."""
    tables = [records.truth(system_id) for system_id in system_ids]
    if any(len(table) < 2 for table in tables):
        return None
    own = tables[0]
    frame = LocalFrame(place_of(own[0]))
    time_us = own["time_usec"].astype(np.float64)
    aircraft = []
    for table in tables:
        yaw = np.unwrap(
            euler_from_quaternions(np.array(table["attitude_quaternion"].tolist(), dtype=np.float64))[2]
        )
        columns = (*positions_ned_m(table, frame).T[:2], yaw)
        times = table["time_usec"].astype(np.float64)
        aircraft.append(interpolated(time_us, times, np.column_stack(columns), gap=GAP_US))
    targets = [
        interpolated(time_us, times, places, gap=GAP_US) for times, places in true_targets(records, frame)
    ]
    return HandoffTruth(
        time_us=time_us,
        aircraft=(aircraft[0], aircraft[1]),
        targets=np.array(targets).reshape(len(targets), len(time_us), 2),
    )


def _is_right(team: HandoffTeam, truth: HandoffTruth | None) -> tuple[bool | None, float | None]:
    """Whether both aircraft have the same target when the decision is made, and how far their places of it
    are apart; None: not known.
    """
    moment = next((moment for moment in team.watch.moments if moment.estimate.decided), None)
    if truth is None or moment is None or moment.tracker is None:
        return None, None
    places = [
        truth.placed(index, [estimate])[0] for index, estimate in enumerate((moment.estimate, moment.tracker))
    ]
    found = [truth.nearest(moment.time_us, place) for place in places]
    if found[0] is None or found[1] is None:
        return None, None
    return found[0][0] == found[1][0], float(np.hypot(*(places[0] - places[1])))


def handoff_figures(team: HandoffTeam, debriefing: Debriefing) -> dict[str, Any]:
    """Entries of `summary.json`."""
    watch, options = team.watch, team.options
    taker, keeper = watch.estimators
    notes = debriefing.flights[0][0]
    decision = taker.decision
    truth = handoff_truth(debriefing.records, [flight[0].system_id for flight in debriefing.flights])
    correct, apart_m = _is_right(team, truth)
    decided = decision is not None and decision.decided
    converged = next((moment.time_us for moment in watch.moments if moment.estimate.converged), None)
    lost_us = team.run.gps_lost_us
    return {
        "decided": decided,
        "correct": correct,
        "probability": decision.probability if decision is not None and decided else None,
        "decided_after_s": _rounded(notes.marks.get("decided_after_s")),
        "handed_over_after_s": _rounded(notes.marks.get("handed_over_after_s")),
        "released": keeper.released,
        "converged_after_s": None
        if converged is None or lost_us is None
        else _rounded((converged - lost_us) * 1e-6),
        "places_apart_m": _rounded(apart_m),
        "identity": keeper.designation.probability,
        "resets": taker.process.pose.resets,
        "link": dict(watch.link.counts),
        "handoff_aircraft": watch.remarks(0),
        "tracker": watch.remarks(1),
        "timeout_s": options.timeout_s,
    }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)


def handoff_verdict(team: HandoffTeam, debriefing: Debriefing) -> str:
    """Why the target was not handed over, by the messages of the aircraft alone; "" if it was."""
    taker, keeper = team.watch.estimators
    if taker.decision is None or not taker.decision.decided:
        return f"no track was decided for within {team.options.timeout_s:g} s"
    if not keeper.released:
        return "the decision was not received by the tracker, or was about another of its tracks"
    return ""


def marks_of(team: HandoffTeam, debriefing: Debriefing) -> Mapping[str, float]:
    """Times of the flight for the picture, s of vehicle time."""
    marks = debriefing.flights[0][0].marks
    found = {}
    if "gps_lost_at_s" in marks:
        lost_s = marks["gps_lost_at_s"]
        found["GPS lost"] = lost_s
        for name, mark in (("decided", "decided_after_s"), ("handed over", "handed_over_after_s")):
            if mark in marks:
                found[name] = lost_s + marks[mark]
    return found
