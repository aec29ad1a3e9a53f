"""The entries of `summary.json` about a search."""

import math
from collections.abc import Mapping
from typing import Any, Final

from estimators.occupancy.detection import Anomaly
from missions.base.report import Debriefing
from missions.flown.score import FlightScore
from missions.occupancy.candidate import Candidate
from missions.occupancy.heading_score import HeadingScore, heading_score
from missions.occupancy.search import Search
from missions.occupancy.separation import least_separation_m
from missions.occupancy.suspect import Suspect
from missions.occupancy.team import Searcher, SearchTeam


def search_figures(team: SearchTeam, debriefing: Debriefing) -> Mapping[str, Any]:
    """Figures of a finished search.

    Args:
        team: the team at the end of the search.
        debriefing: debriefing of the run.
    """
    search, target_ne_m = team.search, debriefing.target_ne_m
    found = search.found
    estimate = None if found is None else found.place_ne_m
    time_to_find_s = None if found is None else (search.found_us - team.began_us) * 1e-6
    scores = [
        _heading(searcher, score)
        for searcher, (_, score) in zip(team.searchers, debriefing.flights, strict=False)
    ]
    known = [s.p95_rad for s in scores if math.isfinite(s.p95_rad)]
    error_m = None if estimate is None or target_ne_m is None else math.dist(estimate, target_ne_m)
    return {
        "target_found": found is not None,
        "time_to_find_s": None if time_to_find_s is None else round(time_to_find_s, 3),
        "target_estimate_m": _place(estimate),
        "target_m": _place(target_ne_m),
        "target_error_m": None if error_m is None else round(error_m, 2),
        **_naming(found is not None, error_m),
        "probability_of_detection": round(search.map.probability_of_detection, 5),
        "no_target_probability": round(search.no_target_probability, 5),
        "heading_settled_error_95_deg": round(math.degrees(max(known)), 3) if known else None,
        "least_separation_m": _rounded(
            least_separation_m(debriefing.records, [notes.system_id for notes, _ in debriefing.flights])
        ),
        "map_error_nt": round(team.map_error.sigma_nt, 3),
        "candidates": [
            {**(_place(candidate.place_ne_m) or {}), "passes": candidate.passes, **_judgement(candidate)}
            for candidate in search.candidates
        ],
        **_identification(search),
        "searchers": [
            _searcher_block(searcher, notes.system_id, notes.kind, heading, team.began_us)
            for searcher, (notes, _), heading in zip(team.searchers, debriefing.flights, scores, strict=False)
        ],
    }


NAMED_WITHIN_M: Final = 150.0
"""A place farther from the target is that of something else; false anomalies are 500 m away and more."""
HEADING_BOUND_RAD: Final = math.radians(30.0)
"""Bound of the heading error after each turn; a searcher must be within it for 95 % of its flight."""
_LEAST_S: Final = 30.0  # shortest search that is judged, s


def search_verdict(team: SearchTeam, debriefing: Debriefing) -> str:
    """The reason, from the vehicles' reports, why a search was not flown; "" if it was."""
    if team.stopped and team.search.found is None:
        return f"the search was given up: {team.stopped}"
    for searcher, (notes, score) in zip(team.searchers, debriefing.flights, strict=False):
        if searcher.ended_us - searcher.began_us < _LEAST_S * 1e6:
            continue  # the other searchers had found the target
        if searcher.watch is None or not searcher.watch.samples:
            return f"vehicle {notes.system_id} searched without any reading of the magnetic field"
        track = score.estimate
        if track is None:
            return f"vehicle {notes.system_id} reported no position in its search"
        heading = heading_score(
            searcher.pilot.commands, track.time_s, track.yaw_rad, end_s=searcher.ended_us * 1e-6
        )
        if heading.p95_rad > HEADING_BOUND_RAD:
            return (
                f"vehicle {notes.system_id} did not fly its headings: 5 % of the time it was more than "
                f"{math.degrees(heading.p95_rad):.0f} degrees off; accepted: "
                f"{math.degrees(HEADING_BOUND_RAD):.0f}"
            )
    return ""


def _heading(searcher: Searcher, score: FlightScore) -> HeadingScore:
    track = score.truth if score.truth is not None else score.estimate
    if track is None:
        return HeadingScore(
            rms_rad=math.nan,
            p95_rad=math.nan,
            largest_rad=math.nan,
            settled_s=0.0,
            commands=len(searcher.pilot.commands),
        )
    return heading_score(searcher.pilot.commands, track.time_s, track.yaw_rad, end_s=searcher.ended_us * 1e-6)


def _searcher_block(
    searcher: Searcher, system_id: int, kind: str, heading: HeadingScore, began_us: int
) -> dict[str, Any]:
    watch = searcher.watch
    return {
        "system_id": system_id,
        "kind": kind,
        "search_s": round(max(0, searcher.ended_us - searcher.began_us) * 1e-6, 3),
        "heading_commands": heading.commands,
        "heading_settled_s": round(heading.settled_s, 1),
        "heading_settled_error_deg": {
            "rms": _degrees(heading.rms_rad),
            "p95": _degrees(heading.p95_rad),
            "largest": _degrees(heading.largest_rad),
        },
        "readings": 0 if watch is None else watch.samples,
        "readings_dropped": 0 if watch is None else watch.placer.dropped + watch.detector.dropped,
        "readings_implausible": 0 if watch is None else watch.check.implausible,
        "anomalies_insignificant": 0 if watch is None else watch.detector.insignificant,
        "anomalies": [_anomaly(anomaly, began_us) for anomaly in searcher.anomalies],
    }


def _naming(named: bool, error_m: float | None) -> dict[str, bool]:
    """Whether what was named is the target; nothing where the truth is not known."""
    if named and error_m is None:
        return {}
    right = error_m is not None and error_m <= NAMED_WITHIN_M
    return {"target_named": named and right, "false_anomaly_named": named and not right}


def _judgement(candidate: Candidate | Suspect) -> dict[str, Any]:
    """What the identification decides about a candidate."""
    if isinstance(candidate, Suspect):
        return {"probability": round(candidate.probability, 4), "verdict": str(candidate.verdict)}
    return {}


def _identification(search: Search) -> dict[str, Any]:
    investigation = search.investigation
    if investigation is None:
        return {}
    return {"identify": str(investigation.identify), "passes_assigned": investigation.passes_assigned}


def _anomaly(anomaly: Anomaly, began_us: int) -> dict[str, float]:
    return {
        "time_s": round((anomaly.time_us - began_us) * 1e-6, 3),
        "north_m": round(anomaly.north_m, 2),
        "east_m": round(anomaly.east_m, 2),
        "peak_nt": round(anomaly.peak_nt, 3),
    }


def _place(place_ne_m: tuple[float, float] | None) -> dict[str, float] | None:
    if place_ne_m is None:
        return None
    return {"north": round(place_ne_m[0], 2), "east": round(place_ne_m[1], 2)}


def _degrees(angle_rad: float) -> float | None:
    return round(math.degrees(angle_rad), 3) if math.isfinite(angle_rad) else None


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
