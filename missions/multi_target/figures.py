"""The entries of `summary.json` about a search, and its verdict."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import GAP_US, interpolated
from estimators.tracking.association import assign
from estimators.tracking.motion import MotionKind
from estimators.tracking.ospa import gospa, ospa
from flightsim.foundation.geodesy import LocalFrame
from missions.flown.targets import true_targets

if TYPE_CHECKING:
    from missions.base.report import Debriefing
    from missions.multi_target.search import SearchState
    from missions.multi_target.team import TargetSearchTeam

__all__ = ["SearchScore", "search_figures", "search_score", "search_verdict"]

Array = NDArray[np.float64]

CUTOFF_M: Final = 10.0
"""Cut-off of OSPA and GOSPA."""

_LATE_SHARE: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchScore:
    """The search over time, against the true targets.

    Attributes:
        time_s: (n,) since the begin of the search.
        found: (n,) number of found targets.
        right: (n,) number of true targets within `match_m` of a found one, each of its own.
        ospa_m, gospa_m: (n,) of all reported targets, with the cut-off `CUTOFF_M`.
        targets_ne_m: (m, 2) true places at the end.
        match_m: largest distance between a found and a true target.
    """

    time_s: Array
    found: NDArray[np.int64]
    right: NDArray[np.int64]
    ospa_m: Array
    gospa_m: Array
    targets_ne_m: Array
    match_m: float


def search_score(team: "TargetSearchTeam", debriefing: "Debriefing") -> SearchScore | None:
    """The score of a search, at the times of which the truth was received; None without truth or without a
    scan.
    """
    origin, search = team.watch.origin, team.search
    states = [state for state in search.states if state.time_us >= search.began_us >= 0]
    if origin is None or not states:
        return None
    truth = true_targets(debriefing.records, LocalFrame(origin))
    if not truth and not debriefing.records.truth(debriefing.flights[0][0].system_id).size:
        return None
    match_m = team.watch.belief.parameters.found_distance_m
    places = np.empty((len(states), len(truth), 2))
    times = np.array([state.time_us for state in states], dtype=np.float64)
    for k, (time_us, place) in enumerate(truth):
        places[:, k] = interpolated(times, time_us, place, gap=GAP_US)
    known = np.isfinite(places).all(axis=(1, 2))
    if not known.any():
        return None
    states, times, places = [states[k] for k in np.flatnonzero(known)], times[known], places[known]
    # of moving targets the reported ones count as found
    moving = team.watch.belief.parameters.motion is not MotionKind.STATIC
    right, apart, apart_general = [], [], []
    for state, true in zip(states, places, strict=True):
        reported = np.array([(t.north_m, t.east_m) for t in state.targets]).reshape(-1, 2)
        counted = [t for t in state.targets if t.found or moving]
        found = np.array([(t.north_m, t.east_m) for t in counted]).reshape(-1, 2)
        right.append(matched(found, true, match_m))
        apart.append(ospa(reported, true, cutoff=CUTOFF_M))
        apart_general.append(gospa(reported, true, cutoff=CUTOFF_M).distance)
    return SearchScore(
        time_s=(times - search.began_us) * 1e-6,
        found=np.array([_found(state) for state in states]),
        right=np.array(right),
        ospa_m=np.array(apart),
        gospa_m=np.array(apart_general),
        targets_ne_m=places[-1],
        match_m=match_m,
    )


def _found(state: "SearchState") -> int:
    return sum(target.found for target in state.targets)


def matched(found: Array, true: Array, match_m: float) -> int:
    """Number of pairs of a found and a true target within a distance, each in one pair."""
    few, many = sorted((found, true), key=len)
    if not len(few):
        return 0
    distance = np.linalg.norm(few[:, None, :] - many[None, :, :], axis=-1)
    cost = np.where(distance <= match_m, distance, 1e6)
    return int(np.count_nonzero(cost[np.arange(len(few)), assign(cost)] < 1e6))


def search_figures(team: "TargetSearchTeam", debriefing: "Debriefing") -> Mapping[str, Any]:
    """Figures of a finished search.

    Args:
        team: the team at the end of the search.
        debriefing: debriefing of the run.
    """
    search, belief = team.search, team.watch.belief
    score = search_score(team, debriefing)
    ended_us = max((searcher.ended_us for searcher in team.searchers), default=-1)
    search_s = max(0, ended_us - search.began_us) * 1e-6 if search.began_us >= 0 else 0.0
    figures: dict[str, Any] = {
        "search_end": search.reason or "not ended",
        "search_s": round(search_s, 3),
        "steps": len(search.steps),
        "step_s_mean": _mean_step_s(team),
        "late_steps": sum(searcher.late_steps for searcher in team.searchers),
        "targets_found": len(belief.found),
        "targets_expected_undetected": round(belief.expected_undetected, 4),
        "targets": [
            {
                "north_m": round(target.north_m, 3),
                "east_m": round(target.east_m, 3),
                "width_m": round(target.width_m, 3),
                "found_s": round((target.time_us - search.began_us) * 1e-6, 3),
            }
            for target in belief.found
        ],
        "estimator_remarks": team.watch.remarks,
        "targets_true": None,
        "targets_found_right": None,
        "match_m": belief.parameters.found_distance_m,
        "ospa_end_m": None,
        "gospa_end_m": None,
        "found_right_s": None,
    }
    if score is not None:
        rises = np.flatnonzero(np.diff(score.right, prepend=0) > 0)
        figures |= {
            "targets_true": len(score.targets_ne_m),
            "targets_found_right": int(score.right[-1]),
            "ospa_end_m": round(float(score.ospa_m[-1]), 3),
            "gospa_end_m": round(float(score.gospa_m[-1]), 3),
            "found_right_s": [[round(float(score.time_s[k]), 3), int(score.right[k])] for k in rises],
        }
    return figures


def _mean_step_s(team: "TargetSearchTeam") -> float | None:
    """Mean time between two decisions of a vehicle."""
    times: dict[int, list[int]] = {}
    for step in team.search.steps:
        times.setdefault(step.vehicle, []).append(step.time_us)
    spans = [(row[-1] - row[0]) * 1e-6 for row in times.values()]
    count = sum(len(row) - 1 for row in times.values())
    return round(sum(spans) / count, 3) if count else None


def search_verdict(team: "TargetSearchTeam", debriefing: "Debriefing") -> str:
    """The reason, from the vehicles' reports, why a search was not flown; "" if it was."""
    search = team.search
    if not search.states:
        return "the search ended without any scan"
    if team.gave_up:
        return f"the search was given up: {team.gave_up} (`sensor_limit_s`)"
    late = sum(searcher.late_steps for searcher in team.searchers)
    if late > _LATE_SHARE * max(len(search.steps), 10):
        return f"the vehicle did not reach {late} of the {len(search.steps)} places that were planned"
    return ""
