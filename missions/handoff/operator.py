"""The operator of the tracking aircraft, who confirms the target when its identity has become doubtful, and
designates it anew when its track was lost.
"""

import math
from collections.abc import Callable, Mapping
from typing import Final

from estimators.handoff import Designation

Place = tuple[float, float]

_APART_M: Final = 10.0  # two targets that are nearer to each other are not distinguished
_LOST_M: Final = 80.0  # a track this far from where the target was lost is taken for it


class TrackOperator:
    """Confirms the track that the aircraft follows, some time after other tracks have been close to it.

    Tracks of moving points show nothing of what a target looks like, so this operator cannot notice an
    exchange: from the confirmation on, the target is what the aircraft follows. In the same way the track
    nearest to the place at which the target was lost becomes the target.

    Args:
        after_s: time of doubt, or without a track, after which the target is designated; 0: never.
        decision: probability of a track that is decided for, which no doubt must prevent.
        designate: sends a designation by the number of the track.
    """

    def __init__(self, after_s: float, decision: float, designate: Callable[[int], None]) -> None:
        self._after_us = round(1e6 * after_s)
        self._sure = 0.5 * (1.0 + decision)
        self._designate = designate
        self._doubtful_us: int | None = None
        self._last: Place | None = None  # of the target

    def look(self, time_us: int, designation: Designation, places: Mapping[int, Place]) -> None:
        """Look at the tracks of the newest frame.

        Args:
            time_us: present time.
            designation: of the target.
            places: of the tracks, by number.
        """
        number, last = designation.number, self._last
        if number is None and last is not None and places:
            number = min(places, key=lambda k: math.dist(places[k], last))
            here = places[number] if math.dist(places[number], last) <= _LOST_M else None
        else:
            here = self._last = None if number is None else places.get(number, last)
        sure = designation.number is not None and designation.probability >= self._sure
        if not self._after_us or number is None or here is None or sure:
            self._doubtful_us = None
            return
        if self._doubtful_us is None:
            self._doubtful_us = time_us
        near = any(k != number and math.dist(place, here) < _APART_M for k, place in places.items())
        if time_us - self._doubtful_us >= self._after_us and not near:
            self._designate(number)
            self._doubtful_us = None
