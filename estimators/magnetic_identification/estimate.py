"""The estimate of `magnetic-identification`: the places at which the target of an anomaly may be."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from estimators.tracking.modes import Mode

__all__ = ["IdentificationEstimate"]


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationEstimate:
    """The modes of one anomaly under the most probable target; a row for each, the heaviest first.

    Attributes:
        time_us: vehicle time of the newest measurement.
        subject: 0, a target.
        anomaly: number of the anomaly, from 0 in the order of time.
        passes: number of passes over it.
        probability: that it is one of the targets.
        background: probability that it is an error of the map.
        confidence: the paper's C_t (7), per particle and over its greatest value; NaN: at the first
            measurement of an anomaly, and if no class that is sought is Gaussian.
        evidence: logarithm of the greatest evidence of a target over the greatest evidence of another
            explanation; without the classes' priors.
        modes: north and east from the map's home, and the axis of the signature from north.
    """

    ALTERNATIVES_OF: ClassVar[str] = "anomaly"
    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("north_m", "east_m", "axis_rad", "north_sigma_m", "east_sigma_m", "axis_sigma_rad", "weight"),
        *("anomaly", "passes", "probability", "background", "confidence", "evidence"),
    )

    time_us: int
    subject: int = 0
    anomaly: int
    passes: int
    probability: float
    background: float
    confidence: float
    evidence: float
    modes: tuple[Mode, ...]

    def rows(self) -> Sequence[tuple[float, ...]]:
        """The values of each mode in the order of `COLUMNS`."""
        common = (
            *(float(self.anomaly), float(self.passes)),
            *(self.probability, self.background, self.confidence, self.evidence),
        )
        return [(*mode.mean, *mode.sigmas, mode.weight, *common) for mode in self.modes]
