"""The operator of the tracking aircraft, who confirms the target when its identity has become doubtful."""

import math
from collections.abc import Callable, Mapping
from typing import Final

from estimators.handoff import Designation
from flightsim.foundation.vectors import LevelVector

_APART_M: Final = 10.0  # two targets that are nearer to each other are not distinguished


class TrackOperator:
    """Confirms the track that the aircraft follows, some time after other tracks have been close to it.

    Tracks of moving points show nothing of what a target looks like, so this operator cannot notice an
    exchange: from the confirmation on, the target is what the aircraft follows.

    Args:
        after_s: time of doubt after which the target is confirmed; 0: never.
        decision: probability of a track that is decided for, which no doubt must prevent.
        designate: sends a designation by the number of the track.
    """

    def __init__(self, after_s: float, decision: float, designate: Callable[[int], None]) -> None:
        self._after_us = round(1e6 * after_s)
        self._sure = 0.5 * (1.0 + decision)
        self._designate = designate
        self._doubtful_us: int | None = None

    def look(self, time_us: int, designation: Designation, places: Mapping[int, LevelVector]) -> None:
        """Look at the tracks of the newest frame.

        Args:
            time_us: present time.
            designation: of the target.
            places: of the tracks, by number.
        """
        number = designation.number
        here = None if number is None else places.get(number)
        if not self._after_us or number is None or here is None or designation.probability >= self._sure:
            self._doubtful_us = None
            return
        if self._doubtful_us is None:
            self._doubtful_us = time_us
        near = any(k != number and math.dist(place, here) < _APART_M for k, place in places.items())
        if time_us - self._doubtful_us >= self._after_us and not near:
            self._designate(number)
            self._doubtful_us = None
