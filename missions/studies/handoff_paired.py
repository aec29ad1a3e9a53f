"""The trade-off of the study `handoff`: all windows and thresholds judge the same flight.

The tracks do not depend on what is compared, so one flight serves all cells of a run. It is flown by relative
pose alone: a blend with a track (equation 45) would be that of one cell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.handoff.process import WindowParameters
from estimators.relative_pose import PoseMode
from missions.studies.handoff_trial import (
    Early,
    Handoff,
    HandoffCell,
    HandoffTrial,
    TrialFlight,
    comparison_of,
    outcome_of,
)

__all__ = ["PairedTrial"]


class _Observers(TrackComparison):
    """Comparisons of several windows that have no effect on the flight.

    Args:
        cells: windows and thresholds.

    Attributes:
        flight: with this as its comparison, and the longest of the windows.
        undecided: comparisons that have not decided, by cell.
    """

    def __init__(self, cells: Sequence[HandoffCell]) -> None:
        super().__init__()
        self.flight: TrialFlight | None = None
        self.undecided = {cell: comparison_of(cell) for cell in cells}

    def due(self, time_us: int) -> bool:
        return any(comparison.due(time_us) for comparison in self.undecided.values())

    def update(self, windows: TrackWindows, pose: PoseMode) -> None:
        assert self.flight is not None
        process, every_s = self.flight.process, self.flight.process.windows.every_s
        made = {process.windows.samples: windows}
        for cell, comparison in self.undecided.items():
            if cell.window not in made:
                parameters = WindowParameters(samples=cell.window, every_s=every_s)
                made[cell.window] = process.track_windows(
                    windows.time_us, windows.heights_m[0], pose, parameters
                )
            comparison.update(made[cell.window], pose)

    @property
    def scores(self) -> Mapping[int, float]:
        return {}

    def reset(self) -> None:
        """Nothing: the comparisons keep their scores, as those of a trial of one cell do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedTrial:
    """The trial of a cell, which is computed together with those of the other cells of its run.

    Args:
        trial: setting and timeout.
        cells: all cells; they have one belief. Those of one operator and one world share a flight.
    """

    trial: HandoffTrial
    cells: tuple[HandoffCell, ...]

    def __call__(self, cell: HandoffCell, seed: int) -> Handoff:
        shared = (cell.operator, cell.world)
        cells = tuple(other for other in self.cells if (other.operator, other.world) == shared)
        return _flown(self.trial, cells, seed)[cell]


@lru_cache(maxsize=1)  # the trials of a run follow one another
def _flown(trial: HandoffTrial, cells: tuple[HandoffCell, ...], seed: int) -> dict[HandoffCell, Handoff]:
    """The outcomes of all cells on one flight."""
    observers = _Observers(cells)
    flight = trial.flight(max(cells, key=lambda cell: cell.window), seed, observers)
    observers.flight = flight
    early: dict[HandoffCell, Early | None] = dict.fromkeys(cells)
    rows = {}
    while flight.world.time_us < 1e6 * trial.timeout_s and observers.undecided:
        flight.step()
        for cell, comparison in list(observers.undecided.items()):
            early[cell] = early[cell] or flight.best(comparison)
            if comparison.decided is not None:
                rows[cell] = outcome_of(flight, comparison, early[cell])
                del observers.undecided[cell]
    for cell, comparison in observers.undecided.items():
        rows[cell] = outcome_of(flight, comparison, early[cell])
    return rows
