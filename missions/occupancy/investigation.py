"""Identification within a search: which anomalies are suspects, and what is decided about each."""

from typing import Final

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.classifier import shipped_classifier, trace_features
from estimators.magnetic_identification.identifier import Identifier, Progress
from estimators.magnetic_identification.samples import LikelyPlace, Sample
from estimators.occupancy import detection
from estimators.occupancy.detection import MapError
from estimators.occupancy.placed_readings import PlacedReading
from estimators.tracking.grid import GridLayout
from missions.occupancy.assignment import PassAssignment
from missions.occupancy.candidate import Candidate
from missions.occupancy.parameters import Identify
from missions.occupancy.suspect import ACCEPT, DISMISS, Suspect, Verdict

__all__ = ["Investigation"]

_CERTAIN: Final = 1.0 - 1e-9
_REOPEN: Final = 0.3  # a dismissed suspect is open again beyond it, after a pass that happened to be near
_PLACED_WITHIN_M: Final = 40.0  # of the place of a target that is named, with the probability below
_PLACED: Final = 0.9
_MOST_PASSES: Final = 5  # a suspect that is still open then is decided by the more probable


class Investigation:
    """The suspects of a team's search.

    Attributes:
        identify: how anomalies are identified.
        identifier: their filters.
        suspects: by the number of the anomaly, in the order of time.
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
        target_prior: float,
    ) -> None:
        """Begin without suspects.

        Args:
            identify: TRACE or BAYES.
            identifier: fresh filters.
            searchers: number of searchers.
            layout: cells of the searched area, in which the target is.
            noise_nt: standard deviation of a measurement.
            map_error: error of the published map.
            target_prior: probability of a target that the identification begins with.
        """
        self.identifier = identifier
        self.suspects: dict[int, Suspect] = {}
        self.identify = identify
        self._target_prior = target_prior
        self._layout = layout
        self._passes = PassAssignment(searchers, noise_nt=noise_nt, map_error=map_error)

    @property
    def passes_assigned(self) -> int:
        """Number of passes that were flown on purpose."""
        return self._passes.passes_assigned

    def take(self, searcher: int, reading: PlacedReading, map_nt: float) -> Progress | None:
        """Process a reading of a searcher."""
        progress = self.identifier.take(searcher, reading, map_nt)
        if progress is not None:
            self._passes.note(searcher, progress.sample)
        return progress

    def certain(self, searcher: int, progress: Progress) -> bool:
        """Whether the anomaly of a pass in progress is the target already. A probability may be looked at
        after every measurement, the output of the classifier at the end of a pass only.
        """
        anomaly = progress.anomaly
        if self.identify is not Identify.BAYES or anomaly is None or progress.doubted:
            return False
        if anomaly.probability < ACCEPT or not self.in_pass(searcher):
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
        self._passes.release(suspect)
        self._passes.assign_waiting(self.suspects.values())
        return suspect

    def evidence_of(self, candidate: Candidate | Suspect) -> float:
        """How much more probable its measurements are if a candidate is a target than if it is none."""
        if not isinstance(candidate, Suspect):
            return 1.0
        probability = min(candidate.probability, _CERTAIN)
        prior = self._target_prior
        return probability / (1.0 - probability) * (1.0 - prior) / prior

    def flies_pass(self, searcher: int) -> bool:
        """Whether a searcher is assigned a pass."""
        return self._passes.flies_pass(searcher)

    def next_leg(self, searcher: int, *, done: bool) -> tuple[tuple[float, float] | None, Suspect | None]:
        """The next goal of a searcher that flies a pass; see `PassAssignment.next_leg`."""
        return self._passes.next_leg(searcher, done=done)

    def most_probable(self) -> Suspect | None:
        """The open suspect that is most probably the target, which it then is; None: none is probable."""
        likely = [
            suspect
            for suspect in self.suspects.values()
            if suspect.verdict is Verdict.OPEN
            and suspect.probability >= ACCEPT
            and self._layout.contains(*suspect.place_ne_m)
        ]
        if not likely:
            return None
        chosen = max(likely, key=lambda suspect: suspect.probability)
        chosen.verdict = Verdict.TARGET
        return chosen

    def leave(self, searcher: int) -> None:
        """A searcher flies home or is lost; its suspect may be taken by another."""
        self._passes.leave(searcher)
        self._passes.assign_waiting(self.suspects.values())

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
        if (suspect.probability >= ACCEPT and placed) or (
            last_chance and inside and suspect.probability >= 0.5
        ):
            suspect.verdict = Verdict.TARGET
        elif suspect.probability <= DISMISS or last_chance:
            suspect.verdict = Verdict.DISMISSED
        elif suspect.probability >= _REOPEN:
            suspect.verdict = Verdict.OPEN

    def _placed(self, place: LikelyPlace) -> bool:
        """Whether a place is known well enough. The target is in the searched area: a place outside may be
        that of its mirror image.
        """
        return place.share >= _PLACED and self._layout.contains(place.north_m, place.east_m)
