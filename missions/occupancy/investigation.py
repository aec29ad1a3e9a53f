"""Identification within a search: which anomalies are suspects, what is decided about each, and who flies the
next pass over it. Without I/O.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.classifier import shipped_classifier, trace_features
from estimators.magnetic_identification.identifier import Identifier, Progress
from estimators.magnetic_identification.samples import Place, Sample
from estimators.occupancy import detection
from estimators.occupancy.detection import MapError
from estimators.occupancy.placed_readings import PlacedReading
from estimators.tracking.grid import GridLayout
from missions.occupancy.next_pass import Pass, candidate_passes

_ACCEPT: Final = 0.97
_DISMISS: Final = 0.03
_REOPEN: Final = 0.3  # a dismissed suspect is open again beyond it, after a pass that happened to be near
_PLACED_WITHIN_M: Final = 40.0  # of the place of a target that is named, with the probability below
_PLACED: Final = 0.9
_MOST_PASSES: Final = 5  # a suspect that is still open then is decided by the more probable
_LEAST_GAIN_NATS: Final = 0.02
_MOST_ASSIGNED: Final = 8  # so many passes, which may detect nothing, are flown over one suspect at most
_ELSEWHERE_S: Final = 60.0  # worth of the time that a searcher does not search
_RADIUS_M: Final = 100.0  # usual turn, for the time to the begin of a pass
_LEAST_SPEED_M_S: Final = 5.0


class Identify(StrEnum):
    """How a search decides that an anomaly is the target."""

    THRESHOLD = "threshold"
    """Enough passes have detected an anomaly at one place."""
    TRACE = "trace"
    """By a classifier on the trace of the paper's confidence."""
    BAYES = "bayes"
    """By the evidence of all classes."""


class Verdict(StrEnum):
    """What is decided about a suspect."""

    OPEN = "open"
    TARGET = "target"
    DISMISSED = "dismissed"


@dataclass(slots=True, kw_only=True)
class Suspect:
    """An anomaly under investigation.

    Attributes:
        identified: its filters.
        verdict: what is decided.
        probability: that it is the target.
        likeliest: where it is, if it is the target.
        anomalies: (searcher, loudest measurement) of each pass, in the order of time.
        assigned: number of passes that were assigned over it.
    """

    identified: Anomaly
    likeliest: Place
    verdict: Verdict = Verdict.OPEN
    probability: float = 0.5
    anomalies: list[tuple[int, detection.Anomaly]] = field(default_factory=list)
    assigned: int = 0

    @property
    def passes(self) -> int:
        """Number of passes that detected it."""
        return len(self.anomalies)

    @property
    def place_ne_m(self) -> tuple[float, float]:
        """Its most probable place: as a target, or as what it is instead."""
        if self.probability < 0.5:
            return self.identified.place_ne_m
        return self.likeliest.north_m, self.likeliest.east_m


class Investigation:
    """The suspects of a team's search.

    Attributes:
        identify: how anomalies are identified.
        identifier: their filters.
        suspects: by the number of the anomaly, in the order of time.
        passes_flown: number of passes that were flown on purpose.
    """

    def __init__(
        self,
        identify: Identify,
        identifier: Identifier,
        *,
        searchers: int,
        layout: GridLayout,
        noise_nt: float,
        map_error: MapError,
    ) -> None:
        """Begin without suspects.

        Args:
            identify: TRACE or BAYES.
            identifier: fresh filters.
            searchers: number of searchers.
            layout: cells of the searched area, in which the target is.
            noise_nt: standard deviation of a measurement.
            map_error: error of the published map.
        """
        self.identifier = identifier
        self.suspects: dict[int, Suspect] = {}
        self.passes_flown = 0
        self.identify = identify
        self._layout = layout
        self._noise_nt = noise_nt
        self._map_error = map_error
        self._legs: list[list[tuple[float, float]]] = [[] for _ in range(searchers)]
        self._assigned: list[Suspect | None] = [None] * searchers
        self._fresh = [False] * searchers
        self._samples: list[Sample | None] = [None] * searchers
        self._speeds_m_s = [25.0] * searchers

    def take(self, searcher: int, reading: PlacedReading, map_nt: float) -> Progress | None:
        """Process a reading of a searcher."""
        progress = self.identifier.take(searcher, reading, map_nt)
        if progress is None:
            return None
        sample, last = progress.sample, self._samples[searcher]
        if last is not None and sample.time_us > last.time_us:
            moved_m = math.hypot(sample.north_m - last.north_m, sample.east_m - last.east_m)
            self._speeds_m_s[searcher] = max(
                _LEAST_SPEED_M_S, moved_m * 1e6 / (sample.time_us - last.time_us)
            )
        self._samples[searcher] = sample
        return progress

    def certain(self, searcher: int, progress: Progress) -> bool:
        """Whether the anomaly of a pass in progress is the target already. A probability may be looked at
        after every measurement, the output of the classifier at the end of a pass only.
        """
        anomaly = progress.anomaly
        if self.identify is not Identify.BAYES or anomaly is None or progress.doubted:
            return False
        if anomaly.probability < _ACCEPT or not self.in_pass(searcher):
            return False
        return self._placed(anomaly.likeliest_place(_PLACED_WITHIN_M))

    def in_pass(self, searcher: int) -> bool:
        """Whether a searcher is at an anomaly."""
        return self.identifier.in_pass(searcher)

    def conclude(self, searcher: int, anomaly: Anomaly, loudest: Sample | None = None) -> Suspect:
        """Decide after a pass of a searcher over an anomaly, and assign the next pass if it is open.

        Args:
            searcher: number of the searcher.
            anomaly: the anomaly.
            loudest: largest measurement of the pass; None: nothing was detected.
        """
        suspect = self.suspects.get(anomaly.number)
        if suspect is None:
            suspect = self.suspects[anomaly.number] = Suspect(
                identified=anomaly, likeliest=anomaly.likeliest_place(_PLACED_WITHIN_M)
            )
        if loudest is not None:
            suspect.anomalies.append(
                (
                    searcher,
                    detection.Anomaly(
                        time_us=loudest.time_us,
                        north_m=loudest.north_m,
                        east_m=loudest.east_m,
                        peak_nt=loudest.residual_nt,
                        samples=loudest.readings,
                    ),
                )
            )
        if suspect.verdict is not Verdict.TARGET:
            self._decide(suspect)
        self._release(suspect)
        self._assign_waiting()
        return suspect

    def flies_pass(self, searcher: int) -> bool:
        """Whether a searcher is assigned a pass."""
        return self._assigned[searcher] is not None

    def next_leg(self, searcher: int, *, done: bool) -> tuple[tuple[float, float] | None, Suspect | None]:
        """The next goal of a searcher that flies a pass.

        Args:
            searcher: number of the searcher.
            done: its present goal is reached; a new pass is returned at once.

        Returns:
            The goal, or None to search on or to keep the present goal; and the suspect whose pass was flown
            to its end without another decision.
        """
        legs = self._legs[searcher]
        if self._fresh[searcher]:
            self._fresh[searcher] = False
            return legs.pop(0), None
        if not done:
            return None, None
        if legs:
            return legs.pop(0), None
        flown = self._assigned[searcher]
        self._assigned[searcher] = None
        return None, flown

    def most_probable(self) -> Suspect | None:
        """The open suspect that is most probably the target, which it then is; None: none is probable."""
        likely = [
            suspect
            for suspect in self.suspects.values()
            if suspect.verdict is Verdict.OPEN
            and suspect.probability >= _ACCEPT
            and self._layout.contains(*suspect.place_ne_m)
        ]
        if not likely:
            return None
        chosen = max(likely, key=lambda suspect: suspect.probability)
        chosen.verdict = Verdict.TARGET
        return chosen

    def leave(self, searcher: int) -> None:
        """A searcher flies home or is lost; its suspect may be taken by another."""
        self._legs[searcher] = []
        self._fresh[searcher] = False
        self._assigned[searcher] = None
        self._samples[searcher] = None
        self._assign_waiting()

    def _decide(self, suspect: Suspect) -> None:
        anomaly = suspect.identified
        if self.identify is Identify.BAYES:
            suspect.probability = anomaly.probability
        else:
            features = trace_features(anomaly.trace)
            suspect.probability = float(shipped_classifier().probability(features))
        suspect.likeliest = anomaly.likeliest_place(_PLACED_WITHIN_M)
        placed, last_chance = self._placed(suspect.likeliest), anomaly.passes >= _MOST_PASSES
        inside = self._layout.contains(*suspect.place_ne_m)
        if (suspect.probability >= _ACCEPT and placed) or (
            last_chance and inside and suspect.probability >= 0.5
        ):
            suspect.verdict = Verdict.TARGET
        elif suspect.probability <= _DISMISS or last_chance:
            suspect.verdict = Verdict.DISMISSED
        elif suspect.probability >= _REOPEN:
            suspect.verdict = Verdict.OPEN

    def _placed(self, place: Place) -> bool:
        """Whether a place is known well enough. The target is in the searched area: a place outside may be
        that of its mirror image.
        """
        return place.share >= _PLACED and self._layout.contains(place.north_m, place.east_m)

    def _release(self, suspect: Suspect) -> None:
        """End the passes that are assigned over a suspect."""
        for k, assigned in enumerate(self._assigned):
            if assigned is suspect:
                self._assigned[k], self._legs[k], self._fresh[k] = None, [], False

    def _assign_waiting(self) -> None:
        """Assign a pass over each open suspect that has none, the more probable target first: when a suspect
        was found, all searchers may have been on passes over others.
        """
        waiting = [
            suspect
            for suspect in self.suspects.values()
            if suspect.verdict is Verdict.OPEN and all(suspect is not other for other in self._assigned)
        ]
        for suspect in sorted(waiting, key=lambda suspect: -suspect.probability):
            self._assign(suspect)

    def _assign(self, suspect: Suspect) -> None:
        """Give the pass that is worth most for its time to a searcher that has none."""
        anomaly = suspect.identified
        best: tuple[float, int, Pass] | None = None
        free = [k for k, sample in enumerate(self._samples) if sample is not None and not self._assigned[k]]
        heights_m = [sample.height_m for sample in self._samples if sample is not None]
        if not free or suspect.assigned >= _MOST_ASSIGNED:
            return
        passes = candidate_passes(
            anomaly, noise_nt=self._noise_nt, map_error=self._map_error, height_m=min(heights_m)
        )
        for searcher in free:
            for flown in passes:
                worth = flown.gain_nats / (_ELSEWHERE_S + self._duration_s(searcher, flown))
                if best is None or worth > best[0]:
                    best = (worth, searcher, flown)
        # a probable target is open because its place is not known: every pass near it is worth its time
        unplaced = suspect.probability >= _ACCEPT
        if best is None or (best[2].gain_nats < _LEAST_GAIN_NATS and not unplaced):
            return
        _, searcher, chosen = best
        self._assigned[searcher] = suspect
        suspect.assigned += 1
        self._legs[searcher] = [chosen.entry_ne_m, chosen.exit_ne_m]
        self._fresh[searcher] = True
        self.passes_flown += 1

    def _duration_s(self, searcher: int, flown: Pass) -> float:
        """Time until a searcher has flown a pass: two turns, the way to its begin, and its length."""
        sample = self._samples[searcher]
        if sample is None:
            return math.inf
        to_n, to_e = flown.entry_ne_m[0] - sample.north_m, flown.entry_ne_m[1] - sample.east_m
        way = math.atan2(to_e, to_n)
        along_n, along_e = (b - a for a, b in zip(flown.entry_ne_m, flown.exit_ne_m, strict=True))
        turns = abs(math.remainder(way - sample.course_rad, math.tau))
        turns += abs(math.remainder(math.atan2(along_e, along_n) - way, math.tau))
        length_m = math.hypot(to_n, to_e) + math.hypot(along_n, along_e) + _RADIUS_M * turns
        return length_m / self._speeds_m_s[searcher]
