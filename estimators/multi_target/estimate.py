"""The estimates of the multi-target estimator."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

__all__ = ["MultiTargetEstimate", "SearchEstimate", "TargetRow"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetRow:
    """One target of a set.

    Attributes:
        north_m, east_m: place from the origin.
        mass: expected number of targets at that place; for a found target the probability that it is within
            `found_distance_m` of it.
        width_m: standard deviation per axis.
        found: whether it counts as found.
    """

    north_m: float
    east_m: float
    mass: float
    width_m: float
    found: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetEstimate:
    """The targets that are found or detected.

    Attributes:
        time_us: vehicle time; for several vehicles, the time common to them.
        targets: the found ones in the order in which they were found, then the others.
        subject: 0, targets.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = ("north_m", "east_m", "mass", "width_m", "found")

    time_us: int
    targets: tuple[TargetRow, ...]
    subject: int = 0

    def rows(self) -> Sequence[tuple[float, ...]]:
        """The values of each target in the order of `COLUMNS`."""
        return [(t.north_m, t.east_m, t.mass, t.width_m, float(t.found)) for t in self.targets]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchEstimate:
    """The state of the search.

    Attributes:
        time_us: vehicle time; for several vehicles, the time common to them.
        vehicle: system id of the vehicle whose scan came last.
        found: number of found targets.
        expected_targets: expected number of detected targets, found or not.
        expected_undetected: expected number of targets that were never detected.
        unexplored: mean of the exploration map.
        subject: 0, targets.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("vehicle", "found", "expected_targets", "expected_undetected", "unexplored"),
    )

    time_us: int
    vehicle: int
    found: int
    expected_targets: float
    expected_undetected: float
    unexplored: float
    subject: int = 0

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        return (
            float(self.vehicle),
            float(self.found),
            self.expected_targets,
            self.expected_undetected,
            self.unexplored,
        )
