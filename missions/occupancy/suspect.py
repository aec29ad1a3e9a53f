"""An anomaly under investigation, and what is decided about it."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.samples import LikelyPlace
from estimators.occupancy import detection

__all__ = ["ACCEPT", "DISMISS", "Suspect", "Verdict"]

ACCEPT: Final = 0.97
"""From this probability on a suspect is the target, if its place is known."""
DISMISS: Final = 0.03
"""Up to this probability a suspect is not the target."""


class Verdict(StrEnum):
    """What is decided about a suspect."""

    OPEN = "open"
    TARGET = "target"
    DISMISSED = "dismissed"


@dataclass(slots=True, kw_only=True)
class Suspect:
    """An anomaly under investigation.

    Attributes:
        identified: its filters.
        verdict: what is decided.
        probability: that it is the target.
        likeliest: where it is, if it is the target.
        anomalies: (searcher, loudest measurement) of each pass, in the order of time.
        assigned: number of passes that were assigned over it.
    """

    identified: Anomaly
    likeliest: LikelyPlace
    verdict: Verdict = Verdict.OPEN
    probability: float = 0.5
    anomalies: list[tuple[int, detection.Anomaly]] = field(default_factory=list)
    assigned: int = 0

    @property
    def passes(self) -> int:
        """Number of passes that detected it."""
        return len(self.anomalies)

    @property
    def place_ne_m(self) -> tuple[float, float]:
        """Its most probable place: as a target, or as what it is instead."""
        if self.probability < 0.5:
            return self.identified.place_ne_m
        return self.likeliest.north_m, self.likeliest.east_m
