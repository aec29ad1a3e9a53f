"""The entries of `summary.json` about a search, and its verdict."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.estimate import TargetRow
from estimators.multi_target.parameters import MultiTargetParameters
from estimators.received import GAP_US, interpolated
from estimators.tracking.association import assign
from estimators.tracking.motion import MotionKind
from estimators.tracking.ospa import Gospa, gospa, ospa
from flightsim.foundation.geodesy import LocalFrame
from missions.base.report import Debriefing
from missions.flown.targets import true_targets
from missions.multi_target.team import TargetSearchTeam

__all__ = ["SearchScore", "score_figures", "scored", "search_figures", "search_score", "search_verdict"]

Array = NDArray[np.float64]

CUTOFF_M: Final = 10.0
"""Cut-off of OSPA and GOSPA."""

_LATE_SHARE: Final = 0.1
_NO_PAIR: Final = 1e6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchScore:
    """The search over time, against the true targets.

    Attributes:
        time_s: (n,) since the begin of the search.
        found: (n,) number of found targets.
        right: (n,) number of true targets within `match_m` of a found one, each of its own.
        ospa_m: (n,) of all reported targets, with the cut-off `CUTOFF_M`.
        gospa: n, likewise, with its parts.
        targets_ne_m: (m, 2) true places at the end.
        reported: the targets that are reported at the end.
        errors_m: of each of them, distance from its own true target; infinite: none is within `match_m`.
        match_m: largest distance between a found and a true target.
    """

    time_s: Array
    found: NDArray[np.int64]
    right: NDArray[np.int64]
    ospa_m: Array
    gospa: tuple[Gospa, ...]
    targets_ne_m: Array
    reported: tuple[TargetRow, ...]
    errors_m: Array
    match_m: float


def search_score(team: TargetSearchTeam, debriefing: Debriefing) -> SearchScore | None:
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
    places = np.empty((len(states), len(truth), 2))
    times = np.array([state.time_us for state in states], dtype=np.float64)
    for k, (time_us, place) in enumerate(truth):
        places[:, k] = interpolated(times, time_us, place, gap=GAP_US)
    known = np.isfinite(places).all(axis=(1, 2))
    if not known.any():
        return None
    kept = np.flatnonzero(known)
    return scored(
        team.watch.belief.parameters,
        (times[known] - search.began_us) * 1e-6,
        [states[k].targets for k in kept],
        places[known],
    )


def scored(
    parameters: MultiTargetParameters, time_s: Array, states: Sequence[Sequence[TargetRow]], places: Array
) -> SearchScore:
    """The score of reported targets.

    Args:
        parameters: of the estimator.
        time_s: (n,) since the begin of the search.
        states: the reported targets at each time, n.
        places: (n, m, 2) true places.
    """
    # of moving targets the reported ones count as found
    moving = parameters.motion is not MotionKind.STATIC
    right, apart, apart_general = [], [], []
    for state, true in zip(states, places, strict=True):
        reported = np.array([(t.north_m, t.east_m) for t in state]).reshape(-1, 2)
        found = np.array([(t.north_m, t.east_m) for t in state if t.found or moving]).reshape(-1, 2)
        right.append(int(np.isfinite(matched_m(found, true, parameters.found_distance_m)).sum()))
        apart.append(ospa(reported, true, cutoff=CUTOFF_M))
        apart_general.append(gospa(reported, true, cutoff=CUTOFF_M))
    return SearchScore(
        time_s=time_s,
        found=np.array([sum(t.found for t in state) for state in states]),
        right=np.array(right),
        ospa_m=np.array(apart),
        gospa=tuple(apart_general),
        targets_ne_m=places[-1],
        reported=tuple(states[-1]),
        errors_m=matched_m(reported, places[-1], parameters.found_distance_m),
        match_m=parameters.found_distance_m,
    )


def matched_m(found: Array, true: Array, match_m: float) -> Array:
    """Distance of each found target (n, 2) from the true one (m, 2) that it is paired with, (n,): pairs
    within `match_m` and each target in one pair, as many as possible. Infinite: it is in none.
    """
    distances = np.full(len(found), np.inf)
    if not (len(found) and len(true)):
        return distances
    apart = np.linalg.norm(found[:, None, :] - true[None, :, :], axis=-1)
    cost = np.where(apart <= match_m, apart, _NO_PAIR)
    if len(found) <= len(true):
        rows, columns = np.arange(len(found)), assign(cost)
    else:
        rows, columns = assign(np.ascontiguousarray(cost.T)), np.arange(len(true))
    near = cost[rows, columns] < _NO_PAIR
    distances[rows[near]] = apart[rows[near], columns[near]]
    return distances


def search_figures(team: TargetSearchTeam, debriefing: Debriefing) -> Mapping[str, Any]:
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
        "targets_expected": round(belief.expected_targets, 4),
        "match_m": belief.parameters.found_distance_m,
        **score_figures(score),
    }
    return figures


def score_figures(score: SearchScore | None) -> Mapping[str, Any]:
    """The entries that need the true targets; None without them.

    Args:
        score: of the search.
    """
    if score is None:
        return dict.fromkeys(
            (
                *("targets_true", "targets_found_right", "ospa_end_m", "gospa_end_m", "gospa_missed"),
                *("gospa_false", "found_right_s", "targets_reported"),
            )
        )
    rises = np.flatnonzero(np.diff(score.right, prepend=0) > 0)
    end = score.gospa[-1]
    return {
        "targets_true": len(score.targets_ne_m),
        "targets_found_right": int(score.right[-1]),
        "ospa_end_m": round(float(score.ospa_m[-1]), 3),
        "gospa_end_m": round(end.distance, 3),
        "gospa_missed": end.missed,
        "gospa_false": end.false,
        "found_right_s": [[round(float(score.time_s[k]), 3), int(score.right[k])] for k in rises],
        "targets_reported": [
            {
                "mass": round(row.mass, 4),
                "width_m": round(row.width_m, 3),
                "error_m": round(error_m, 3) if math.isfinite(error_m) else None,
            }
            for row, error_m in zip(score.reported, score.errors_m.tolist(), strict=True)
        ],
    }


def _mean_step_s(team: TargetSearchTeam) -> float | None:
    """Mean time between two decisions of a vehicle."""
    times: dict[int, list[int]] = {}
    for step in team.search.steps:
        times.setdefault(step.vehicle, []).append(step.time_us)
    spans = [(row[-1] - row[0]) * 1e-6 for row in times.values()]
    count = sum(len(row) - 1 for row in times.values())
    return round(sum(spans) / count, 3) if count else None


def search_verdict(team: TargetSearchTeam, debriefing: Debriefing) -> str:
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
