"""One anomaly under investigation: its hypotheses, the evidence of each, and the trace of the confidence.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III. The paper has one hypothesis, the target, and reads
its confidence; here every class is one, and the probabilities of the classes follow from their evidences
(Bayes). Beside the classes stand explanations by something else, so that the target must fit better than
these and not only better than the known false anomalies; and a target that fits badly loses its probability
although nothing else fits (`goodness`). The paper's filter runs beside them.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.classes import AnomalyClass, DipoleClass, GaussianClass
from estimators.magnetic_identification.confidence import ConfidenceFilter, Control
from estimators.magnetic_identification.goodness import fitting_share
from estimators.magnetic_identification.hypotheses import (
    BackgroundHypothesis,
    Beginning,
    EdgeHypothesis,
    Hypothesis,
    ShapelessHypothesis,
)
from estimators.magnetic_identification.measurements import Measurements
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.magnetic_identification.samples import LikelyPlace, Sample, TracePoint
from estimators.magnetic_identification.source_hypotheses import (
    BodyHypothesis,
    DipoleHypothesis,
    GaussianHypothesis,
    SourceHypothesis,
)
from estimators.occupancy.detection import MapError
from estimators.tracking.modes import Mode, find_modes

__all__ = ["BACKGROUND", "OTHERS", "Anomaly"]

Array = NDArray[np.float64]

BACKGROUND: Final = "background"
"""Name of the hypothesis that there is only the error of the map."""
OTHERS: Final = ("other body", "other dipole", "map edge", "unknown")
"""Names of the hypotheses that an anomaly is something else than a class: a body of any extent, a dipole of
any depth, the edge of a tile of the map, and a source of any shape.
"""
_BACKGROUND_PRIOR: Final = 0.15  # of what is no target
_OTHER_PRIORS: Final = (0.28, 0.2, 0.05, 0.05)  # of what is no target, in the order of `OTHERS`
_ANY_DIPOLE: Final = DipoleClass(name="dipole", strength_nt=15.0, least_m=20.0, most_m=400.0)
_HOPELESS_NATS: Final = 16.0
"""A hypothesis so far behind the best one is not followed any more: the right one is that far behind at any
time with a probability of exp(-16) at most (Ville's inequality).
"""
_SOURCES: Final = 0.15  # number of sources of a hypothesis over that of the paper's particles
_BODIES: Final = 0.25  # likewise of bodies, of which five numbers are sampled
_DIPOLES: Final = 0.06  # likewise of dipoles, of which three numbers are sampled
_MOST_MEASUREMENTS: Final = 240  # of an anomaly: then it is known
_ADJOINING_NATS: Final = math.log(10.0)  # sources are seldom so near to each other, parts of a body always
_LONGEST_STEP_M: Final = 50.0  # the noise of a motion does not grow beyond it: positions are absolute
_SHIFTS: Final = 8  # of a place to the mean around it


class Anomaly:
    """One anomaly.

    Attributes:
        number: from 0, in the order of time.
        names: of the hypotheses: the classes, `OTHERS` and `BACKGROUND`.
        log_evidence: (hypotheses,) logarithms.
        trace: after each measurement.
        passes: number of passes over it.
        under_way: whether a pass is in progress.
    """

    def __init__(
        self,
        number: int,
        first: Sample,
        parameters: IdentificationParameters,
        classes: Sequence[AnomalyClass],
        map_error: MapError,
        *,
        threshold_nt: float,
        field_ned: Array,
        rng: np.random.Generator,
        approach: Sequence[Sample] = (),
    ) -> None:
        """Start every hypothesis with the first measurement beyond the threshold.

        Args:
            number: of the anomaly.
            first: the measurement.
            parameters, classes: of the filters.
            map_error: error of the published map.
            threshold_nt: threshold that the measurement exceeds.
            field_ned: (3,) direction of the Earth's field.
            rng: random numbers of the filters.
            approach: the measurements right before, by the same vehicle, within the threshold.
        """
        q = parameters
        self.number = number
        self.passes = 1
        self.under_way = True
        self.trace: list[TracePoint] = []
        self._parameters = q
        self._map_error = map_error
        self._last = first
        self._loudest = first
        self._sought = [k for k, of in enumerate(classes) if of.sought]
        gaussians = [of for of in classes if of.sought and isinstance(of, GaussianClass)]
        self._seen = Measurements(map_error, first)
        sources, dipoles = round(_SOURCES * q.particles), round(_DIPOLES * q.particles)
        speed_m_s = q.target_speed_m_s
        hypotheses: list[Hypothesis] = [
            GaussianHypothesis(of, sources, rng, speed_m_s=speed_m_s)
            if isinstance(of, GaussianClass)
            else DipoleHypothesis(of, dipoles, rng, field_ned=field_ned, speed_m_s=speed_m_s)
            for of in classes
        ]
        hypotheses += [
            BodyHypothesis(gaussians, round(_BODIES * q.particles), rng),
            DipoleHypothesis(_ANY_DIPOLE, dipoles, rng, field_ned=field_ned),
            EdgeHypothesis(q.unknown_nt),
            ShapelessHypothesis(q.unknown_nt, q.unknown_m),
            BackgroundHypothesis(),
        ]
        self.names = (*(of.name for of in classes), *OTHERS, BACKGROUND)
        self._hypotheses = hypotheses
        self._is_sought: NDArray[np.bool_] = np.isin(np.arange(len(hypotheses)), self._sought)
        self._misfits: Array = np.zeros(len(hypotheses))
        self._steps = 0
        self._adjoins = False
        self._log_prior = np.log(_priors(classes, q.target_prior))
        self.log_evidence: Array = np.zeros(len(hypotheses))
        for sample in approach:
            self._seen.add(sample, self._white_nt2(sample))
        quiet = self._seen.log_density()
        self._seen.add(first, self._white_nt2(first))
        beginning = self._beginning(first, approach, threshold_nt)
        for k, hypothesis in enumerate(hypotheses):
            # the approach is no measurement of the anomaly: its own density counts for none
            self.log_evidence[k] = hypothesis.start(self._seen, beginning) - quiet
        self._paper: ConfidenceFilter | None = None
        if gaussians:
            self._paper = ConfidenceFilter(gaussians[0], q.particles, rng, by_roulette=q.roulette)
            self._paper.start(first.residual_nt, self._alone_nt2(first))
        self._place_ne_m: tuple[float, float] | None = None
        self._note(first, math.nan)

    def take(self, sample: Sample) -> None:
        """One more measurement of any vehicle."""
        if self._seen.count < _MOST_MEASUREMENTS:
            self._weigh(sample)
        confidence = math.nan
        if self._paper is not None:
            control = self._control(self._last, sample)
            confidence = self._paper.step(control, sample.residual_nt, self._alone_nt2(sample))
        self._last = sample
        if abs(sample.residual_nt) > abs(self._loudest.residual_nt):
            self._loudest = sample
        self._note(sample, confidence)

    def _weigh(self, sample: Sample) -> None:
        """Weigh the hypotheses by a measurement; those that are far behind are not followed any more."""
        self._seen.add(sample, self._white_nt2(sample))
        best = int(np.argmax(self.log_evidence))
        behind = self.log_evidence < self.log_evidence[best] - _HOPELESS_NATS
        for k, hypothesis in enumerate(self._hypotheses):
            if behind[k]:
                continue
            update = hypothesis.step(self._seen)
            self.log_evidence[k] += update.log_density
            self._misfits[k] += update.misfit
            if k == best:
                self.log_evidence[behind] += update.log_density
        self._steps += 1

    def adjoin(self) -> None:
        """Note that the anomaly goes on into another one, or is right beside it: they are rather one long
        body than two sources.
        """
        if not self._adjoins:
            self._adjoins = True
            self._log_prior[self._sought] -= _ADJOINING_NATS

    def restore(self, kept: "Anomaly") -> None:
        """Return to the state of an earlier copy (`copy.deepcopy`), which must not be used any more."""
        self.__dict__.update(kept.__dict__)

    def _beginning(self, first: Sample, approach: Sequence[Sample], threshold_nt: float) -> Beginning:
        step_ne_m, shared_nt2 = None, 0.0
        if approach:
            step_ne_m = (first.north_m - approach[-1].north_m, first.east_m - approach[-1].east_m)
            shared_nt2 = float(self._seen.map_covariance_nt2(np.hypot(*step_ne_m)))
        # of the noise of a measurement at the threshold
        at_threshold = replace(first, residual_nt=threshold_nt)
        return Beginning(
            threshold_nt=threshold_nt,
            north_m=first.north_m,
            east_m=first.east_m,
            step_ne_m=step_ne_m,
            map_nt2=self._map_error.sigma_nt**2,
            shared_nt2=shared_nt2,
            white_nt2=self._white_nt2(at_threshold),
        )

    def _control(self, last: Sample, sample: Sample) -> Control:
        """The motion between two measurements."""
        q = self._parameters
        north_m, east_m = sample.north_m - last.north_m, sample.east_m - last.east_m
        cosine, sine = math.cos(last.course_rad), math.sin(last.course_rad)
        turn_rad = math.remainder(sample.course_rad - last.course_rad, math.tau)
        distance_m = math.hypot(north_m, east_m)
        elapsed_s = abs(sample.time_us - last.time_us) * 1e-6
        walked_m = q.target_speed_m_s * min(elapsed_s, 60.0)
        return Control(
            forward_m=cosine * north_m + sine * east_m,
            right_m=cosine * east_m - sine * north_m,
            turn_rad=turn_rad,
            forward_sigma_m=math.hypot(q.forward_noise * min(distance_m, _LONGEST_STEP_M), walked_m),
            turn_sigma_rad=math.hypot(q.turn_noise * turn_rad, q.course_noise_rad),
        )

    def _white_nt2(self, sample: Sample) -> float:
        """Variance of what a measurement shares with no other one."""
        q = self._parameters
        shape_nt = q.shape_error * sample.residual_nt
        return q.noise_nt**2 / sample.readings + sample.excess_nt2 + shape_nt**2

    def _alone_nt2(self, sample: Sample) -> float:
        """Variance of a measurement for the paper's filter: the error of the map is white."""
        return self._white_nt2(sample) + self._map_error.sigma_nt**2

    def _note(self, sample: Sample, confidence: float) -> None:
        self._place_ne_m = None
        self.trace.append(
            TracePoint(
                time_us=sample.time_us,
                number=self.passes - 1,
                residual_nt=sample.residual_nt,
                confidence=confidence,
                probability=self.probability,
                evidence=float(
                    self.log_evidence[self._is_sought].max() - self.log_evidence[~self._is_sought].max()
                ),
            )
        )

    @property
    def probabilities(self) -> Array:
        """(hypotheses,) probability of each.

        Where the best explanation is off by more than it predicts, the noise is larger than assumed, and all
        evidence counts less by as much.
        """
        logs = self._log_prior + self.log_evidence / self._excess
        shares: Array = np.exp(logs - logs.max())
        return shares / shares.sum()

    @property
    def _excess(self) -> float:
        """Variance of the whitened residuals of the best explanation, where it is more than one."""
        best = int(np.argmax(self._log_prior + self.log_evidence))
        return max(1.0, float(self._misfits[best]) / self._steps) if self._steps else 1.0

    @property
    def log_density(self) -> float:
        """Logarithm of the density of all its measurements, whichever hypothesis is right."""
        logs = self._log_prior + self.log_evidence
        return float(logs.max() + np.log(np.exp(logs - logs.max()).sum()))

    @property
    def probability(self) -> float:
        """Probability that the anomaly is one of the targets: that of their evidence, as far as they fit."""
        shares = self.probabilities[self._sought]
        return float(sum(share * self._fitting(k) for k, share in zip(self._sought, shares, strict=True)))

    @property
    def background(self) -> float:
        """Probability that there is only the error of the map."""
        return float(self.probabilities[-1])

    def _fitting(self, number: int) -> float:
        """What is left of the probability of a hypothesis for its goodness of fit."""
        return fitting_share(float(self._misfits[number]), self._steps)

    @property
    def place_ne_m(self) -> tuple[float, float]:
        """Mean place under the most probable class, from the map's home."""
        if self._place_ne_m is None:
            # of the classes: a body of any extent may be anywhere after few measurements
            best = self._hypotheses[int(np.argmax(self.probabilities[: -len(OTHERS) - 1]))]
            assert isinstance(best, SourceHypothesis)
            self._place_ne_m = best.mean_place_m()
        return self._place_ne_m

    def likeliest_place(self, radius_m: float) -> LikelyPlace:
        """Where the anomaly is if it is the most probable target: the place with the largest share of the
        belief within a radius. It is found by mean shift from each mode (Fukunaga and Hostetler 1975), so
        mirror modes are not averaged to a place where the target is not.
        """
        best = self._sought[int(np.argmax(self.probabilities[self._sought]))]
        hypothesis = self._hypotheses[best]
        if not isinstance(hypothesis, SourceHypothesis):
            return LikelyPlace(north_m=self._loudest.north_m, east_m=self._loudest.east_m, share=0.0)
        sources, weights = hypothesis.places(), hypothesis.weights
        found = []
        for mode in find_modes(sources, weights):
            centre = np.array(mode.mean[:2])
            for _ in range(_SHIFTS):
                inside = np.sum((sources[:, :2] - centre) ** 2, axis=1) <= radius_m * radius_m
                share = float(weights[inside].sum())
                if share <= 0.0:
                    break
                before, centre = centre, weights[inside] @ sources[inside, :2] / share
                if np.array_equal(before, centre):
                    break
            found.append((share, *centre.tolist()))
        share, north_m, east_m = max(found, default=(0.0, *self.place_ne_m))
        return LikelyPlace(north_m=north_m, east_m=east_m, share=share)

    def modes(self) -> list[Mode]:
        """The modes under the most probable target: north and east from the map's home, axis from north."""
        best = self._sought[int(np.argmax(self.probabilities[self._sought]))]
        hypothesis = self._hypotheses[best]
        if not isinstance(hypothesis, SourceHypothesis):
            return []
        return find_modes(hypothesis.places(), hypothesis.weights)

    def predictions(self, north_m: Array, east_m: Array, height_m: float, count: int) -> list[Array | None]:
        """What a pass over places (n,) would measure, nT, by each hypothesis: (count, n) for as many equally
        probable particles; None: an unknown shape predicts nothing.
        """
        found: list[Array | None] = []
        for hypothesis in self._hypotheses[:-1]:
            if not isinstance(hypothesis, SourceHypothesis):
                found.append(None)
                continue
            found.append(hypothesis.predicted_nt(north_m, east_m, height_m, count))
        return [*found, np.zeros((1, len(north_m)))]


def _priors(classes: Sequence[AnomalyClass], target_prior: float) -> Array:
    """Probabilities of the hypotheses before any measurement."""
    sought = sum(of.sought for of in classes)
    known = len(classes) - sought
    rest = 1.0 - target_prior
    others = [share * rest for share in (*_OTHER_PRIORS, _BACKGROUND_PRIOR)]
    left = rest - sum(others)
    if not known:
        others[-2], left = others[-2] + left, 0.0
    return np.array([target_prior / sought if of.sought else left / known for of in classes] + others)
