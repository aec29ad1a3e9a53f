"""The role of the handoff logic: which track of the handoff aircraft is the tracker's target."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.alignment import Alignment, align
from estimators.relative_pose.belief import PoseMode

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackWindows:
    """Windows of tracks at the same times, each in the present level frame of its aircraft (equation 41).

    Attributes:
        time_us: present time.
        times_us: (n,) times of the places, ascending to the present.
        handoff: (n, 2) forward and right by track number of the handoff aircraft.
        target: (n, 2) the tracker's target; None: it has no window.
        eyes: (n, 2) places of the handoff aircraft and of the tracker at these times, each in its own frame.
        heights_m: of both over the ground.
        others: the tracker's other tracks, by number.
        identity: probability that the tracker's target still is the designated one.
        doubtful: tracks of the handoff aircraft that are measured more seldom than a new track must be: they
            are about to leave their targets, or these have stopped.
    """

    time_us: int
    times_us: NDArray[np.int64]
    handoff: Mapping[int, Array]
    target: Array | None
    eyes: tuple[Array, Array]
    heights_m: tuple[float, float]
    others: Mapping[int, Array] = field(default_factory=dict)
    identity: float = 1.0
    doubtful: frozenset[int] = frozenset()
    _alignments: dict[int, Alignment] = field(default_factory=dict, init=False, repr=False)

    def alignment(self, number: int, target: Array) -> Alignment:
        """Alignment of a track of the handoff aircraft with the tracker's target, made once for all
        comparisons of these windows.
        """
        if number not in self._alignments:
            self._alignments[number] = align(self.handoff[number], target)
        return self._alignments[number]


class TrackComparison(ABC):
    """Compares windows of tracks one after the other, until one track is decided for.

    Attributes:
        decided: number of the track that is the target; None: not decided yet.
    """

    def __init__(self) -> None:
        self.decided: int | None = None

    def due(self, time_us: int) -> bool:
        """Whether `update` compares at a time; windows of other times need not be made."""
        return True

    @abstractmethod
    def update(self, windows: TrackWindows, pose: PoseMode) -> None:
        """Compare the tracks of one time.

        Args:
            windows: of the tracks.
            pose: the relative pose of a converged belief.
        """

    @property
    @abstractmethod
    def scores(self) -> Mapping[int, float]:
        """By track of the handoff aircraft: how far it is the target, 0..1."""

    @abstractmethod
    def reset(self) -> None:
        """Discard scores and decision."""
