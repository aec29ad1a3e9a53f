"""Who flies the next pass over which suspect. Without I/O."""

import math
from collections.abc import Iterable
from typing import Final

from estimators.magnetic_identification.samples import Sample
from estimators.occupancy.detection import MapError
from missions.occupancy.next_pass import Pass, candidate_passes
from missions.occupancy.suspect import ACCEPT, Suspect, Verdict

__all__ = ["PassAssignment"]

_LEAST_GAIN_NATS: Final = 0.02
_MOST_ASSIGNED: Final = 8  # so many passes, which may detect nothing, are flown over one suspect at most
_ELSEWHERE_S: Final = 60.0  # worth of the time that a searcher does not search
_RADIUS_M: Final = 100.0  # usual turn, for the time to the begin of a pass
_USUAL_SPEED_M_S: Final = 25.0
_LEAST_SPEED_M_S: Final = 5.0


class PassAssignment:
    """The passes of a team over suspects.

    Attributes:
        passes_assigned: number of passes that were assigned.
    """

    def __init__(self, searchers: int, *, noise_nt: float, map_error: MapError) -> None:
        """Begin without passes.

        Args:
            searchers: number of searchers.
            noise_nt: standard deviation of a measurement.
            map_error: error of the published map.
        """
        self.passes_assigned = 0
        self._noise_nt = noise_nt
        self._map_error = map_error
        self._legs: list[list[tuple[float, float]]] = [[] for _ in range(searchers)]
        self._assigned: list[Suspect | None] = [None] * searchers
        self._fresh = [False] * searchers
        self._samples: list[Sample | None] = [None] * searchers
        self._speeds_m_s = [_USUAL_SPEED_M_S] * searchers

    def note(self, searcher: int, sample: Sample) -> None:
        """A searcher's newest measurement: where it is, and how fast."""
        last = self._samples[searcher]
        if last is not None and sample.time_us > last.time_us:
            moved_m = math.hypot(sample.north_m - last.north_m, sample.east_m - last.east_m)
            self._speeds_m_s[searcher] = max(
                _LEAST_SPEED_M_S, moved_m * 1e6 / (sample.time_us - last.time_us)
            )
        self._samples[searcher] = sample

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

    def leave(self, searcher: int) -> None:
        """A searcher flies home or is lost; its suspect may be taken by another."""
        self._end(searcher)
        self._samples[searcher] = None

    def release(self, suspect: Suspect) -> None:
        """End the passes that are assigned over a suspect."""
        for searcher, assigned in enumerate(self._assigned):
            if assigned is suspect:
                self._end(searcher)

    def assign_waiting(self, suspects: Iterable[Suspect]) -> None:
        """Assign a pass over each open suspect that has none, the more probable target first: when a suspect
        was found, all searchers may have been on passes over others.
        """
        waiting = [
            suspect
            for suspect in suspects
            if suspect.verdict is Verdict.OPEN and all(suspect is not other for other in self._assigned)
        ]
        for suspect in sorted(waiting, key=lambda suspect: -suspect.probability):
            self._assign(suspect)

    def _end(self, searcher: int) -> None:
        self._assigned[searcher], self._legs[searcher], self._fresh[searcher] = None, [], False

    def _assign(self, suspect: Suspect) -> None:
        """Give the pass that is worth most for its time to a searcher that has none."""
        best: tuple[float, int, Pass] | None = None
        free = [k for k, sample in enumerate(self._samples) if sample is not None and not self._assigned[k]]
        heights_m = [sample.height_m for sample in self._samples if sample is not None]
        if not free or suspect.assigned >= _MOST_ASSIGNED:
            return
        passes = candidate_passes(
            suspect.identified, noise_nt=self._noise_nt, map_error=self._map_error, height_m=min(heights_m)
        )
        for searcher in free:
            for flown in passes:
                worth = flown.gain_nats / (_ELSEWHERE_S + self._duration_s(searcher, flown))
                if best is None or worth > best[0]:
                    best = (worth, searcher, flown)
        # a probable target is open because its place is not known: every pass near it is worth its time
        unplaced = suspect.probability >= ACCEPT
        if best is None or (best[2].gain_nats < _LEAST_GAIN_NATS and not unplaced):
            return
        _, searcher, chosen = best
        self._assigned[searcher] = suspect
        suspect.assigned += 1
        self._legs[searcher] = [chosen.entry_ne_m, chosen.exit_ne_m]
        self._fresh[searcher] = True
        self.passes_assigned += 1

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
