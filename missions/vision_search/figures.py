"""The entries of `summary.json` about a vision search, and its verdict."""

import math
from collections.abc import Mapping
from typing import Any, Final

from estimators.received import GAP_US, interpolated
from estimators.vision_search import AreaEstimate
from flightsim.foundation.geodesy import LocalFrame
from missions.base.report import Debriefing
from missions.flown.targets import true_targets
from missions.vision_search.pose_errors import pose_errors
from missions.vision_search.team import VisionSearchTeam

__all__ = ["ELLIPSE_95", "search_figures", "search_verdict", "true_place"]

ELLIPSE_95: Final = -2.0 * math.log(0.05)
"""Squared Mahalanobis distance of the edge of the 95 % ellipse in the plane."""
_LATE_SHARE: Final = 0.2


def true_place(team: VisionSearchTeam, debriefing: Debriefing, time_us: int) -> tuple[float, float] | None:
    """The target's true place at a time, from the area's origin; None: not known."""
    origin = team.watch.origin
    if origin is None:
        return None
    truth = true_targets(debriefing.records, LocalFrame(origin))
    if not truth:
        return None
    times, places = truth[0]
    north_m, east_m = interpolated(time_us, times, places, gap=GAP_US).tolist()
    return (north_m, east_m) if math.isfinite(north_m) else None


def search_figures(team: VisionSearchTeam, debriefing: Debriefing) -> Mapping[str, Any]:
    """Figures of a finished search.

    Args:
        team: the team at the end of the search.
        debriefing: debriefing of the run.
    """
    search, watch = team.search, team.watch
    began_us = search.began_us
    ended_us = max((searcher.ended_us for searcher in team.searchers), default=-1)
    first = next((s[-1] for s in search.states if s), None)
    place = None if first is None else true_place(team, debriefing, first.time_us)
    beliefs = [
        _belief(states[-1], place) | {"estimator_remarks": watch.remarks(index)}
        for index, states in enumerate(search.states)
        if states
    ]
    origin = watch.origin
    frame = None if origin is None else LocalFrame(origin)
    calibration = {
        str(notes.system_id): pose_errors(
            debriefing.records, notes.system_id, frame, (searcher.began_us, searcher.ended_us)
        )
        for (notes, _), searcher in zip(debriefing.flights, team.searchers, strict=True)
        if frame is not None and searcher.began_us >= 0
    }
    own = beliefs[0] if beliefs else {}
    return {
        "search_end": search.reason or "not ended",
        "search_s": _since(began_us, ended_us) or 0.0,
        "began_us": began_us,
        "localized": search.localized_us >= 0,
        "localized_s": _since(began_us, search.localized_us),
        "passes": search.passes,
        "steps": sum(search.steps),
        "late_steps": sum(searcher.late_steps for searcher in team.searchers),
        "target_north_m": None if place is None else round(place[0], 3),
        "target_east_m": None if place is None else round(place[1], 3),
        **{name: own.get(name) for name in ("north_m", "east_m", "sigma_m", "error_m", "inside_ellipse")},
        "beliefs": beliefs,
        "beliefs_apart_m": _apart(search.states),
        "likelihoods": dict(sorted(watch.counts.items())),
        "pose_errors": calibration,
    }


def _since(began_us: int, time_us: int) -> float | None:
    """Seconds from the begin of the search; None: it did not begin, or the time is not known."""
    return None if min(began_us, time_us) < 0 else round(max(0, time_us - began_us) * 1e-6, 3)


def _belief(estimate: AreaEstimate, place: tuple[float, float] | None) -> dict[str, Any]:
    """The end of one vehicle's belief."""
    found: dict[str, Any] = {
        "north_m": round(estimate.north_m, 3),
        "east_m": round(estimate.east_m, 3),
        "sigma_m": round(estimate.sigma_m, 3),
        "probability_of_detection": round(estimate.probability_of_detection, 5),
        "entropy_nats": round(estimate.entropy_nats, 4),
        "detections": estimate.detections,
        "frames": estimate.frames,
        "error_m": None,
        "distance_squared": None,
        "inside_ellipse": None,
    }
    if place is not None:
        distance = estimate.distance_squared(*place)
        found["error_m"] = round(math.dist(place, (estimate.north_m, estimate.east_m)), 3)
        found["distance_squared"] = round(distance, 3)
        found["inside_ellipse"] = distance <= ELLIPSE_95
    return found


def _apart(states: list[list[AreaEstimate]]) -> float | None:
    """Largest distance between the last means of two vehicles."""
    means = [(s[-1].north_m, s[-1].east_m) for s in states if s]
    if len(means) < 2:
        return None
    return round(max(math.dist(a, b) for k, a in enumerate(means) for b in means[:k]), 4)


def search_verdict(team: VisionSearchTeam, debriefing: Debriefing) -> str:
    """The reason, from the vehicles' reports, why a search was not flown; "" if it was."""
    search = team.search
    if not any(search.states):
        return _why_no_frame([team.watch.remarks(index) for index in range(len(team.searchers))])
    if team.gave_up:
        return f"the search was given up: {team.gave_up} (`sensor_limit_s`)"
    late = sum(searcher.late_steps for searcher in team.searchers)
    if late > _LATE_SHARE * max(sum(search.steps), 10):
        return f"the vehicles did not reach {late} of the {sum(search.steps)} places that were planned"
    return ""


def _why_no_frame(remarks: list[dict[str, float | str]]) -> str:
    """The reason why no frame of a camera was used, from the remarks of the vehicles' estimators."""

    def count(name: str) -> int:
        return sum(int(each.get(f"frames_{name}", 0.0)) for each in remarks)

    without_pose, low = count("without_pose"), count("too_low")
    if not without_pose and not low:
        return "the search ended without any frame of a camera"
    reason = "the search ended without a frame of a camera that could be used: "
    reason += f"{without_pose} without attitude or position near their exposure, {low} too low"
    return "; ".join([reason, *(str(each["warning"]) for each in remarks if "warning" in each)])
