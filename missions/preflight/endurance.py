"""Whether the battery lasts as long as the mission."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from missions.planning.outline import Outline
from missions.preflight.finding import Finding, ok, problem, warning
from missions.preflight.snapshot import Snapshot

__all__ = ["PARAMETERS", "RESERVE", "Endurance", "endurance_finding", "reported_endurance", "too_long"]

RESERVE: Final = 1.3
"""The battery must last so many times as long as the path of the mission: for takeoff, way home and landing,
and for wind.
"""
_HOUR_S: Final = 3600.0

PARAMETERS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"px4": ("BAT1_CAPACITY", "BAT_AVRG_CURRENT"), "ardupilot": ()}
)
"""By flavour: capacity (mAh) and expected current in flight (A). ArduPilot has no parameter of a current."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Endurance:
    """How long a battery lasts in flight.

    Attributes:
        seconds: from now on.
        source: where this is known from, for texts.
    """

    seconds: float
    source: str


def reported_endurance(snapshot: Snapshot) -> Endurance | None:
    """What a vehicle reports; None: neither a time nor capacity and consumption."""
    left_s = snapshot.whole("BATTERY_STATUS", "time_remaining")
    if left_s:
        return Endurance(seconds=float(left_s), source="the autopilot's own figure")
    values = [snapshot.parameters.get(name, 0.0) for name in PARAMETERS.get(snapshot.flavour, ())]
    remaining = snapshot.whole("SYS_STATUS", "battery_remaining")
    if len(values) != 2 or not all(value > 0.0 for value in values) or remaining is None or remaining < 0:
        return None
    capacity_mah, current_a = values
    return Endurance(
        seconds=1e-3 * capacity_mah * 0.01 * remaining / current_a * _HOUR_S,
        source=f"{remaining} % of BAT1_CAPACITY {capacity_mah:g} mAh at BAT_AVRG_CURRENT {current_a:g} A",
    )


def too_long(outline: Outline | None, endurance: Endurance | None) -> str:
    """The sentence about a mission for which the battery does not last; "": it does, or one is not known."""
    if outline is None or outline.duration_s is None or endurance is None:
        return ""
    if endurance.seconds >= RESERVE * outline.duration_s:
        return ""
    longer = (
        "takes longer than the battery lasts"
        if endurance.seconds < outline.duration_s
        else (f"leaves no reserve of {100.0 * (RESERVE - 1.0):.0f} %")
    )
    return f"the mission {longer}: {_times(outline.duration_s, endurance)}"


def endurance_finding(outline: Outline | None, endurance: Endurance | None) -> Finding:
    """Finding about the battery's endurance for the mission, as far as both are known."""
    if outline is None or outline.duration_s is None:
        return warning("duration", "the mission does not state how long it flies", "check it yourself")
    if endurance is None:
        return warning(
            "duration",
            f"about {outline.duration_s / 60.0:.1f} min of mission, and it is not known how long the battery "
            "lasts",
            "see that it does, or give its endurance",
        )
    if text := too_long(outline, endurance):
        return problem("duration", text, "charge it, or fly less")
    return ok("duration", _times(outline.duration_s, endurance))


def _times(duration_s: float, endurance: Endurance) -> str:
    flown_min, left_min = duration_s / 60.0, endurance.seconds / 60.0
    return (
        f"about {flown_min:.1f} min without takeoff and landing, {left_min:.1f} min of battery "
        f"({endurance.source})"
    )
