"""The estimate of `survey`: the mean of about a second's readings."""

from dataclasses import dataclass
from typing import ClassVar

__all__ = ["SurveyEstimate"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyEstimate:
    """Readings of one vehicle, averaged.

    Attributes:
        time_us: vehicle time, the mean of the readings.
        subject: system id of the vehicle.
        north_m, east_m, height_m: place, from the map's home; without a map from the vehicle's first
        position. total_nt: total field.
        compensated_nt: without the aircraft's field; without coefficients the same.
        reference_nt: of the map, or of the main field without a map; NaN off the map.
        differential_nt: compensated less reference; not levelled.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("north_m", "east_m", "height_m"),
        *("total_nt", "compensated_nt", "reference_nt", "differential_nt"),
    )

    time_us: int
    subject: int
    north_m: float
    east_m: float
    height_m: float
    total_nt: float
    compensated_nt: float
    reference_nt: float
    differential_nt: float

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        return (
            *(self.north_m, self.east_m, self.height_m),
            *(self.total_nt, self.compensated_nt, self.reference_nt, self.differential_nt),
        )
