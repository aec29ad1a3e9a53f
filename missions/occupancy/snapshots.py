"""The map of a search at moments of it, for pictures."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_KEPT_SCORES: Final = 10_000_000  # numbers kept: 80 MB
_LEAST_SNAPSHOTS: Final = 16
_EVENTS_KEPT: Final = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """The map at one moment.

    Attributes:
        time_us: vehicle time.
        scores: (rows, columns).
        places_ne_m: position of each searcher; NaN: not yet received.
        event: the snapshot was stored because an anomaly was reported.
    """

    time_us: int
    scores: Array
    places_ne_m: tuple[tuple[float, float], ...]
    event: bool = False


class Snapshots:
    """Snapshots after anomalies and at even intervals, which are increased when there are too many.

    Attributes:
        kept: in the order of time.
    """

    def __init__(self, interval_s: float) -> None:
        """Begin without snapshots; see the class for the interval."""
        self.kept: list[Snapshot] = []
        self._interval_us = round(interval_s * 1e6)

    def due(self, time_us: int) -> bool:
        """Whether the interval has passed."""
        return not self.kept or time_us - self.kept[-1].time_us >= self._interval_us

    def room_for_event(self) -> bool:
        """Whether one more event is kept."""
        return sum(snapshot.event for snapshot in self.kept) < _EVENTS_KEPT

    def add(self, snapshot: Snapshot) -> None:
        """Keep one more; with too many, every second one between events is dropped."""
        if len(self.kept) >= max(_LEAST_SNAPSHOTS, _KEPT_SCORES // snapshot.scores.size):
            self.kept = [kept for k, kept in enumerate(self.kept) if kept.event or k % 2 == 0]
            self._interval_us *= 2
        self.kept.append(snapshot)
