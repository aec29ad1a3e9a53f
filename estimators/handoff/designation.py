"""Which track of the tracking aircraft is the target, and how probable that is.

An operator designates a track. From then on its identity is a probability for each track, and for targets
that have no track at present ("identity management": Shin, Guibas and Zhao 2003, "A distributed algorithm for
managing multi-target identities in wireless ad-hoc sensor networks"). It changes when

* two tracks come close to each other: a tracker of several targets may exchange them, and nothing in the
  tracks shows it. The probabilities of both are mixed, the more the closer they came. When one of them ends
  there, both may have been of one target: the other one is of either;
* a track is lost: its probability goes to the place where its target may be, which widens as the target walks
  on, and from there to a new track that begins near it. A track that was hardly measured at its end has left
  its target before, at the place where it was measured last;
* a lost target stays without a track, although one in view soon has one;
* a new track begins beside a living one: a tracker often has two tracks of one target for a second, but it
  may be of a lost one, which shows when they part;
* tracks look like the designated target, or do not (`appearance`); without looks they are all alike.
"""

import math
from collections.abc import Mapping

from estimators.handoff.appearance import Appearance, Look
from estimators.handoff.identities import (
    DesignationParameters,
    LivingTrack,
    LostTarget,
    exchange,
    give,
    unexchanged,
)
from flightsim.foundation.vectors import LevelVector

_NO_LOOKS: Mapping[int, Look] = {}
_MEASURED_US = 1_000_000
_CERTAIN = 0.95  # the looks of a track that is the target with this probability are the target's


class Designation:
    """The designated target.

    Args:
        parameters: when it becomes doubtful.

    Attributes:
        number: of the track that most probably is the target; None: none is designated, or it has no track.
        probability: probability that this track is the designated target.
        count: number of designations.
    """

    def __init__(self, parameters: DesignationParameters | None = None) -> None:
        self.parameters = parameters or DesignationParameters()
        self.number: int | None = None
        self.probability = 1.0
        self.count = 0
        self._time_us = 0
        self._seen_us = 0
        self._living: dict[int, LivingTrack] = {}
        self._lost: list[LostTarget] = []
        self._appearance = Appearance(self.parameters.appearance)

    def designate(
        self,
        time_us: int,
        number: int,
        place: LevelVector,
        sure: float = 1.0,
        doubles: frozenset[int] = frozenset(),
    ) -> None:
        """An operator designates a track, or confirms that it is the target.

        Args:
            time_us: of the track.
            number, place: of the track.
            sure: probability that it is the target.
            doubles: other tracks that are of the same target.
        """
        self._count_looks()
        known = self._living.setdefault(number, LivingTrack(weight=0.0, place=place))
        others = [entry for entry in self._entries() if entry is not known]
        if not others and sure < 1.0:  # then the target is one that has no track
            unseen = self._without_track(0.0, time_us, place)
            unseen.exists = 1.0 - sure
            self._lost.append(unseen)
            others = [unseen]
        total = sum(entry.weight for entry in others)
        for entry in others:
            entry.weight = (1.0 - sure) * (entry.weight / total if total > 0.0 else 1.0 / len(others))
        known.weight = sure
        known.beside.update(dict.fromkeys(doubles & self._living.keys(), self.parameters.doubled))
        if sure > _CERTAIN:
            self._appearance.designate(known.looks)
            for other in self._living.values():
                if other is not known:
                    other.looks = None
        self.count += 1
        self._seen_us = time_us
        self._choose()

    def designate_place(self, time_us: int, place: LevelVector, sure: float = 1.0) -> None:
        """An operator designates a place at which there is no track yet: the next one near it is the target.

        Args:
            time_us: of the place.
            place: in the frame of the tracks.
            sure: probability that the target is there.
        """
        for entry in self._entries():
            entry.weight *= 1.0 - sure
        # a track of it may have ended shortly before: there is one target, and not two
        near_m = self.parameters.beside_m
        self._lost = [
            lost
            for lost in self._lost
            if math.dist(lost.place_at(time_us, self.parameters)[0], place) > near_m
        ]
        self._lost.append(self._without_track(sure, time_us, place))
        self.count += 1
        self._seen_us = time_us
        self._choose()

    def _without_track(self, weight: float, time_us: int, place: LevelVector) -> LostTarget:
        """A target that has had no track yet, somewhere near a place."""
        speed_m_s = self.parameters.speed_m_s
        return LostTarget(weight=weight, exists=1.0, since_us=time_us, place=place, sigma_m_s=speed_m_s)

    def refuse(self, number: int, sure: float = 1.0) -> None:
        """An operator says that a track is not the target.

        Args:
            number: of the track.
            sure: probability that it is not.
        """
        self._count_looks()
        track = self._living.get(number)
        if track is None:
            return
        track.weight *= 1.0 - sure
        total = sum(entry.weight for entry in self._entries())
        if total > 0.0:
            for entry in self._entries():
                entry.weight /= total
        self._choose()

    def update(
        self,
        time_us: int,
        places: Mapping[int, LevelVector],
        looks: Mapping[int, Look] = _NO_LOOKS,
        doubtful: frozenset[int] = frozenset(),
    ) -> None:
        """Process the tracks of a frame.

        Args:
            time_us: its time.
            places: of the tracks by number, in a frame in which targets move smoothly.
            looks: of the tracks that were seen in it.
            doubtful: tracks that have been measured seldom lately: their targets may have left them.
        """
        dt_s = (time_us - self._time_us) * 1e-6
        self._time_us = time_us
        self._lose(time_us, places)
        self._move(time_us, dt_s, places, doubtful)
        self._begin(time_us, places)
        self._meet(doubtful)
        p = self.parameters
        for number, look in looks.items():
            track = self._living.get(number)
            if track is not None and all(m > p.alone_m for m in track.nearest.values()):
                track.looks = self._appearance.add(track.looks, time_us, look)
        self._lost = [
            lost for lost in self._lost if lost.weight > 1e-6 or (time_us - lost.since_us) * 1e-6 < p.forget_s
        ]
        self._choose()
        if self.number is not None:
            self._seen_us = time_us

    @property
    def expected(self) -> LevelVector | None:
        """Where the target most probably is: its track, or where a lost one may have gone to; None: it was
        never designated, or was lost for too long.
        """
        if self.number is not None:
            return self._living[self.number].place
        lost = max(self._lost, key=lambda lost: lost.weight, default=None)
        if lost is None or not lost.weight or self.lost_s > self.parameters.lost_s:
            return None
        return lost.place_at(self._time_us, self.parameters)[0]

    @property
    def lost_s(self) -> float:
        """Time since the target had a track; 0: it has one."""
        return 0.0 if self.number is not None else (self._time_us - self._seen_us) * 1e-6

    def beside(self, number: int) -> frozenset[int]:
        """Tracks that probably are of the same target as a track: one of both began beside the other."""
        track = self._living.get(number)
        if track is None:
            return frozenset()
        return frozenset(track.beside.keys() | {k for k, t in self._living.items() if number in t.beside})

    def _entries(self) -> list[LivingTrack | LostTarget]:
        return [*self._living.values(), *self._lost]

    # what changes the probabilities

    def _lose(self, time_us: int, places: Mapping[int, LevelVector]) -> None:
        """Tracks that have ended."""
        ended = [number for number in self._living if number not in places]
        if ended:
            self._count_looks()
        for number in ended:
            track = self._living.pop(number)
            for k, other in self._living.items():
                doubled = max(other.beside.pop(number, 0.0), track.beside.get(k, 0.0))
                if doubled:
                    give(track, other, doubled)
                    self._claim(k, 1.0 - doubled)
                elif k in track.nearest:
                    away = math.dist(track.place, other.place) / self.parameters.merged_m
                    exchange(track, other, 0.5 * math.exp(-0.5 * away * away))
                other.nearest.pop(number, None)
            # a track that was hardly measured has left its target before, which may have another one already
            since_us, place, velocity = time_us, track.place, track.velocity
            if track.doubtful and track.measured:
                since_us, place, velocity = track.measured[0]
            self._lost.append(
                LostTarget(
                    weight=track.weight,
                    exists=1.0,
                    since_us=since_us,
                    place=place,
                    velocity=velocity,
                    sigma_m_s=self.parameters.lost_sigma_m_s,
                )
            )
            for k, other in self._living.items():
                if other.begun[0] >= since_us and not other.beside:
                    self._claim(k, 1.0, self._lost[-1])

    def _move(
        self, time_us: int, dt_s: float, places: Mapping[int, LevelVector], doubtful: frozenset[int]
    ) -> None:
        share = min(1.0, max(0.0, dt_s / 2.0))
        for number, track in self._living.items():
            x, y = places[number]
            if dt_s > 0.0:
                u, v = track.velocity
                track.velocity = (
                    u + share * ((x - track.place[0]) / dt_s - u),
                    v + share * ((y - track.place[1]) / dt_s - v),
                )
            track.place = (x, y)
            track.doubtful = number in doubtful
            if not track.doubtful and (not track.measured or time_us - track.measured[-1][0] >= _MEASURED_US):
                track.measured.append((time_us, track.place, track.velocity))

    def _begin(self, time_us: int, places: Mapping[int, LevelVector]) -> None:
        """New tracks: of a target beside that of a living one, of a lost target, or of another."""
        p = self.parameters
        for number in sorted(places.keys() - self._living.keys()):
            place = places[number]
            new = LivingTrack(weight=0.0, place=place, begun=(time_us, place))
            near = [k for k, track in self._living.items() if math.dist(track.place, place) <= p.beside_m]
            self._living[number] = new
            if not near:
                self._claim(number, 1.0)
                continue
            # doubles are so much more frequent there than targets that had no track
            other = sum(self._densities(new)) + p.untracked / p.area_m2
            doubles = p.doubled / (1.0 - p.doubled) * p.untracked / p.area_m2
            new.beside = dict.fromkeys(near, doubles / (doubles + other))

    def _densities(self, track: LivingTrack) -> list[float]:
        """Densities of the lost targets at the beginning of a track."""
        time_us, place = track.begun
        return [
            lost.exists * lost.density(time_us, place, self.parameters) if lost.since_us <= time_us else 0.0
            for lost in self._lost
        ]

    def _claim(self, number: int, real: float, of: LostTarget | None = None) -> None:
        """A track is of a lost target, or of another one that had no track.

        Args:
            number: of the track.
            real: probability that it is not of the same target as another track.
            of: the lost target that it may be; None: any of them.
        """
        track = self._living[number]
        densities = self._densities(track)
        every = sum(densities) + self.parameters.untracked / self.parameters.area_m2
        for lost, density in zip(self._lost, densities, strict=True):
            if of is not None and lost is not of:
                continue
            share = real * density / every
            track.weight += share * lost.weight
            lost.weight -= share * lost.weight
            lost.exists *= 1.0 - share

    def _meet(self, doubtful: frozenset[int]) -> None:
        """Tracks that come close to each other, or leave each other."""
        p = self.parameters
        numbers = list(self._living)
        for i, a in enumerate(numbers):
            one = self._living[a]
            for b in numbers[i + 1 :]:
                other = self._living[b]
                away_m = math.dist(one.place, other.place)
                if away_m > 5.0 * p.exchange_m:
                    if b in one.nearest:  # the encounter is over
                        del one.nearest[b], other.nearest[a]
                    if b in one.beside or a in other.beside:
                        self._part(a, b, doubtful)
                    continue
                before_m = one.nearest.get(b, math.inf)
                if away_m >= before_m:
                    continue
                if before_m == math.inf:
                    self._count_looks()
                    one.looks = other.looks = None
                one.nearest[b] = other.nearest[a] = away_m
                doubled = max(one.beside.get(b, 0.0), other.beside.get(a, 0.0))
                mixed = 0.5 * (
                    1.0 - unexchanged(away_m / p.exchange_m) / unexchanged(before_m / p.exchange_m)
                )
                exchange(one, other, (1.0 - doubled) * mixed)

    def _part(self, a: int, b: int, doubtful: frozenset[int]) -> None:
        """Two tracks that were beside each other are no longer: both are of targets, unless one of them has
        hardly been measured, which has then left the target that both had.
        """
        self._count_looks()
        one, other = self._living[a], self._living[b]
        younger = b if a in other.beside else a
        doubled = max(one.beside.pop(b, 0.0), other.beside.pop(a, 0.0))
        if (a in doubtful) == (b in doubtful):
            if not self._living[younger].beside:
                self._claim(younger, 1.0)
            return
        left, kept = (one, other) if a in doubtful else (other, one)
        give(left, kept, doubled)

    # looks

    def _count_looks(self) -> None:
        """Put the looks so far into the probabilities, each once."""
        posterior, lost = self._posterior()
        for number, track in self._living.items():
            track.weight = posterior[number]
            if track.looks is not None:
                track.looks.log_ratio = 0.0
            if track.weight > _CERTAIN:
                self._appearance.learn(track.looks)
        for entry, weight in zip(self._lost, lost, strict=True):
            entry.weight, entry.counted = weight, entry.without_track(self._time_us, self.parameters)

    def _posterior(self) -> tuple[dict[int, float], list[float]]:
        """Probabilities of the tracks with their looks, and of the lost targets."""
        found = {
            number: track.weight * (self._appearance.ratio(track.looks) if track.weight else 1.0)
            for number, track in self._living.items()
        }
        lost = [
            entry.weight * entry.without_track(self._time_us, self.parameters) / entry.counted
            for entry in self._lost
        ]
        total = sum(found.values()) + sum(lost)
        if not total > 0.0:
            return found, lost
        return {k: weight / total for k, weight in found.items()}, [weight / total for weight in lost]

    def _choose(self) -> None:
        """The track that is reported."""
        posterior, _ = self._posterior()
        best = max(posterior, key=lambda k: posterior[k], default=None)
        held = self.number
        if held in posterior and best is not None and posterior[best] < posterior[held] + 0.1:
            best = held  # two tracks that are as probable do not take turns
        if best is None or posterior[best] < self.parameters.least:
            self.number = None
            return
        self.number, self.probability = best, posterior[best]
