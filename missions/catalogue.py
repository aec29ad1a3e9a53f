"""The missions by name, without importing them. A mission of this package has an entry here.

A user's package names its own in `pyproject.toml`: group `flightstack.missions`, value the class, which is
made without arguments.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

GROUP: Final = "flightstack.missions"

_ALL: Final = ("pattern", "ratio", "phase", "period", "heading", "spacing")


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternEntry:
    """A search pattern.

    Attributes:
        help: first text of `flightstack fly NAME --help`.
        curve, size: functions of `missions.pattern_search.curves`: the curve from the options, and the
            options with sizes that suit an aircraft's turns.
        options: those of the options that not every pattern has.
    """

    help: str
    curve: str
    size: str
    options: tuple[str, ...]

    @property
    def without(self) -> tuple[str, ...]:
        """The options of other patterns that it does not have."""
        return tuple(name for name in _ALL if name not in self.options)


PATTERNS: Final[Mapping[str, PatternEntry]] = MappingProxyType(
    {
        "lissajous": PatternEntry(
            help="Fly a Lissajous pattern, east by one frequency and north by another.",
            curve="lissajous_curve",
            size="lissajous_size",
            options=("pattern", "ratio", "phase", "period"),
        ),
        "sector": PatternEntry(
            help="Fly a sector search (IAMSAR) around a point.",
            curve="sector_curve",
            size="sector_size",
            options=("heading",),
        ),
        "parallel-sweep": PatternEntry(
            help="Fly a parallel sweep search (IAMSAR).",
            curve="parallel_sweep_curve",
            size="sweep_size",
            options=("heading", "spacing"),
        ),
        "expanding-square": PatternEntry(
            help="Fly an expanding square search (IAMSAR).",
            curve="expanding_square_curve",
            size="square_size",
            options=("heading", "spacing"),
        ),
        "ergodic": PatternEntry(
            help="Fly an ergodic search: each part of the area has an equal share of the time.",
            curve="ergodic_curve",
            size="square_size",
            options=("heading", "spacing"),
        ),
    }
)

OTHERS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "orbit": ("missions.orbit.mission", "OrbitMission"),
        "occupancy": ("missions.occupancy.mission", "OccupancyMission"),
        "multi-target": ("missions.multi_target.mission", "MultiTargetMission"),
        "handoff": ("missions.handoff.mission", "HandoffMission"),
        "survey": ("missions.survey.mission", "SurveyMission"),
        "vision-search": ("missions.vision_search.mission", "VisionSearchMission"),
    }
)
"""Module and class of each mission that is no pattern."""

NAMES: Final = (*PATTERNS, *OTHERS)
