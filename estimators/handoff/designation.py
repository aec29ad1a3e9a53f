"""Which track of the tracking aircraft is the target, and how probable it is that it still is.

An operator designates a track. A tracker of several targets may exchange the tracks of two that come close to
each other, and then follows another target under the same number. Nothing in the tracks shows it, so the
probability that the track still is the designated target is part of what the aircraft reports. A track that
begins beside the target's is no other target: a tracker often has two tracks of one target for a second.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from flightsim.foundation.checks import Positive, Share
from flightsim.foundation.options import Options

Place = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignationParameters(Options):
    """When an identity becomes doubtful.

    Attributes:
        exchange_m: a track that comes as near as this to the target's has exchanged targets with it with a
            probability of 0.5 exp(-1/2).
        regained_m: a track that is this close to the place where the target's was lost is taken for it.
        regained: probability that it is.
        doubled: the same of a track that began beside the target's while that lived; in none of 252 frames
            was such a track of another target. It must leave room for a decision at 0.99.
        lost_s: time without a track after which the target is lost.
    """

    exchange_m: Positive = 2.0
    regained_m: Positive = 10.0
    regained: Share = 0.9
    doubled: Share = 0.995
    lost_s: Positive = 5.0


class Designation:
    """The designated track.

    Args:
        parameters: when it becomes doubtful.

    Attributes:
        number: of the track; None: none is designated, or it was lost.
        count: number of designations.
    """

    def __init__(self, parameters: DesignationParameters | None = None) -> None:
        self.parameters = parameters or DesignationParameters()
        self.number: int | None = None
        self.count = 0
        self._place: Place | None = None
        self._seen_us = 0
        self._settled = 1.0  # probability before the present encounter
        self._nearest_m = math.inf  # least distance of another track in the present encounter
        self._apart: set[int] = set()  # tracks that have been away from the target's: other targets
        self._beside: set[int] = set()  # tracks that began beside it

    @property
    def probability(self) -> float:
        """Probability that the track still is the designated target."""
        apart = self._nearest_m / self.parameters.exchange_m
        return self._settled * (1.0 - 0.5 * math.exp(-0.5 * apart * apart))

    def designate(self, time_us: int, number: int, place: Place, sure: float = 1.0) -> None:
        """An operator designates a track, or confirms that it is the target.

        Args:
            time_us: of the track.
            number, place: of the track.
            sure: probability that it is the target.
        """
        self.number, self._place, self._seen_us = number, place, time_us
        self._settled, self._nearest_m = sure, math.inf
        self.count += 1

    def update(self, time_us: int, places: Mapping[int, Place]) -> None:
        """Process the tracks of a frame.

        Args:
            time_us: its time.
            places: of the tracks by number, in a frame in which targets move smoothly.
        """
        p = self.parameters
        if self._place is None:
            return
        if self.number is None or self.number not in places:
            if (time_us - self._seen_us) * 1e-6 > p.lost_s:
                self.number = self._place = None
                return
            near = [k for k, place in places.items() if math.dist(place, self._place) <= p.regained_m]
            if not near:
                return
            lost_at = self._place
            number = min(near, key=lambda k: math.dist(places[k], lost_at))
            same = p.doubled if number in self._beside else p.regained / len(near)
            self._settled, self._nearest_m = self.probability * same, math.inf
            self.number = number
        self._place, self._seen_us = places[self.number], time_us
        here = self._place
        off_m = {k: math.dist(place, here) for k, place in places.items() if k != self.number}
        self._apart |= {k for k, away_m in off_m.items() if away_m > p.regained_m}
        self._beside = {k for k in off_m if k not in self._apart}
        nearest_m = min((off_m[k] for k in off_m if k in self._apart), default=math.inf)
        if nearest_m > 5.0 * p.exchange_m:  # the encounter is over
            self._settled, self._nearest_m = self.probability, math.inf
        else:
            self._nearest_m = min(self._nearest_m, nearest_m)
