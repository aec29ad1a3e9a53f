"""One anomaly under investigation: its hypotheses, the evidence of each, and the trace of the confidence.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III. The paper has one hypothesis, the target, and reads
its confidence; here every class has a filter, and the probabilities of the classes follow from their
evidences (Bayes). Beside the classes stand explanations by something else, so that the target must fit better
than these and not only better than the known false anomalies; and a target that fits badly loses its
probability although nothing else fits (`goodness`). The paper's filter, with white noise and a fixed
signature, runs beside them.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.classes import AnomalyClass, DipoleClass, GaussianClass
from estimators.magnetic_identification.goodness import fitting_share
from estimators.magnetic_identification.hypotheses import (
    Before,
    Control,
    EdgeHypothesis,
    Hypothesis,
    Measurement,
    ShapelessHypothesis,
)
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.magnetic_identification.particle_hypotheses import (
    BodyHypothesis,
    DipoleHypothesis,
    GaussianHypothesis,
    ParticleHypothesis,
)
from estimators.magnetic_identification.samples import LikelyPlace, Sample, TracePoint
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
_OTHER_PRIORS: Final = (0.28, 0.1, 0.05, 0.05)  # of what is no target, in the order of `OTHERS`
_ANY_DIPOLE: Final = DipoleClass(name="dipole", strength_nt=15.0, least_m=20.0, most_m=400.0)
_HOPELESS_NATS: Final = 30.0  # a hypothesis so far behind the best one is not followed any more
_FIRST: Final = 3  # so many times more particles of bodies begin, and of classes
_FIRST_OF_CLASS: Final = 2
_FEWER: Final = 2  # dipoles have so many times fewer particles: their strengths are not sampled
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
        last: Sample | None = None,
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
            last: the measurement before, by the same vehicle; None: there is none.
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
        hypotheses: list[Hypothesis] = []
        for of in classes:
            if isinstance(of, GaussianClass):
                hypotheses.append(
                    GaussianHypothesis(of, q.particles, rng, first=_FIRST_OF_CLASS, by_roulette=q.roulette)
                )
            else:
                hypotheses.append(
                    DipoleHypothesis(
                        of, q.particles // _FEWER, rng, field_ned=field_ned, by_roulette=q.roulette
                    )
                )
        hypotheses += [
            BodyHypothesis(gaussians, q.particles, rng, first=_FIRST, by_roulette=q.roulette),
            DipoleHypothesis(
                _ANY_DIPOLE, q.particles // _FEWER, rng, field_ned=field_ned, by_roulette=q.roulette
            ),
            EdgeHypothesis(q.unknown_nt),
            ShapelessHypothesis(math.hypot(q.unknown_nt, map_error.sigma_nt), q.unknown_m),
            ShapelessHypothesis(map_error.sigma_nt),
        ]
        self.names = (*(of.name for of in classes), *OTHERS, BACKGROUND)
        self._hypotheses = hypotheses
        self._is_sought: NDArray[np.bool_] = np.isin(np.arange(len(hypotheses)), self._sought)
        self._misfits: Array = np.zeros(len(hypotheses))
        self._steps = 0
        self._adjoins = False
        self._log_prior = np.log(_priors(classes, q.target_prior))
        self.log_evidence: Array = np.zeros(len(hypotheses))
        self._paper: GaussianHypothesis | None = None
        if gaussians:
            exact = replace(gaussians[0], amplitude_spread=0.0, size_spread=0.0)
            self._paper = GaussianHypothesis(exact, q.particles, rng, by_roulette=q.roulette)
        seen = self._measurement(first)
        before = self._before(first, last, threshold_nt)
        for k, hypothesis in enumerate(hypotheses):
            self.log_evidence[k] = hypothesis.start(seen, map_error.sigma_nt**2, threshold_nt, before)
        if self._paper is not None:
            self._paper.start(self._white(seen), 0.0)
        self._place_ne_m: tuple[float, float] | None = None
        self._note(first, math.nan)

    def take(self, sample: Sample) -> None:
        """One more measurement of any vehicle."""
        seen = self._measurement(sample)
        control = self._control(self._last, sample)
        best = int(np.argmax(self.log_evidence))
        behind = self.log_evidence - self.log_evidence[best] < -_HOPELESS_NATS
        for k, hypothesis in enumerate(self._hypotheses):
            if behind[k]:
                continue
            update = hypothesis.step(control, seen)
            self.log_evidence[k] += update.log_density
            self._misfits[k] += update.misfit
            if k == best:
                self.log_evidence[behind] += update.log_density
        self._steps += 1
        confidence = math.nan
        if self._paper is not None:
            exact = replace(control, decay=0.0, drive_nt2=0.0)
            confidence = self._paper.step(exact, self._white(seen)).confidence
        self._last = sample
        if abs(sample.residual_nt) > abs(self._loudest.residual_nt):
            self._loudest = sample
        self._note(sample, confidence)

    def adjoin(self) -> None:
        """Note that the anomaly goes on into another one without a gap: they are rather one long body than
        two sources beside each other.
        """
        if not self._adjoins:
            self._adjoins = True
            self._log_prior[self._sought] -= _ADJOINING_NATS

    def restore(self, kept: "Anomaly") -> None:
        """Return to the state of an earlier copy (`copy.deepcopy`), which must not be used any more."""
        self.__dict__.update(kept.__dict__)

    def _before(self, first: Sample, last: Sample | None, threshold_nt: float) -> Before | None:
        """The measurement before the first one beyond the threshold, if the track entered the anomaly
        between them.
        """
        if last is None or abs(last.residual_nt) > threshold_nt:
            return None
        step_m = math.hypot(first.north_m - last.north_m, first.east_m - last.east_m)
        if not 0.0 < step_m <= _LONGEST_STEP_M:
            return None
        # particles start at the first measurement, on its course
        along = replace(last, course_rad=first.course_rad)
        return Before(seen=self._measurement(along), control=self._control(along, first))

    def _control(self, last: Sample, sample: Sample) -> Control:
        """The motion between two measurements."""
        q, map_error = self._parameters, self._map_error
        north_m, east_m = sample.north_m - last.north_m, sample.east_m - last.east_m
        cosine, sine = math.cos(last.course_rad), math.sin(last.course_rad)
        forward_m, right_m = cosine * north_m + sine * east_m, cosine * east_m - sine * north_m
        turn_rad = math.remainder(sample.course_rad - last.course_rad, math.tau)
        distance_m = math.hypot(north_m, east_m)
        elapsed_s = abs(sample.time_us - last.time_us) * 1e-6
        decay = math.exp(-distance_m / map_error.correlation_m)
        walked_m = q.target_speed_m_s * min(elapsed_s, 60.0)
        return Control(
            forward_m=forward_m,
            right_m=right_m,
            turn_rad=turn_rad,
            forward_sigma_m=math.hypot(q.forward_noise * min(distance_m, _LONGEST_STEP_M), walked_m),
            turn_sigma_rad=math.hypot(q.turn_noise * turn_rad, q.course_noise_rad),
            decay=decay,
            drive_nt2=(1.0 - decay * decay) * map_error.sigma_nt**2,
        )

    def _measurement(self, sample: Sample) -> Measurement:
        q = self._parameters
        return Measurement(
            residual_nt=sample.residual_nt,
            white_nt2=q.noise_nt**2 / sample.readings
            + sample.excess_nt2
            + (q.shape_error * sample.residual_nt) ** 2,
            height_m=sample.height_m,
            course_rad=sample.course_rad,
        )

    def _white(self, seen: Measurement) -> Measurement:
        """As the paper's filter sees it: the error of the map is white."""
        return replace(seen, white_nt2=seen.white_nt2 + self._map_error.sigma_nt**2)

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
            assert isinstance(best, ParticleHypothesis)
            self._place_ne_m = self._in_map(*best.mean_place_m())
        return self._place_ne_m

    def likeliest_place(self, radius_m: float) -> LikelyPlace:
        """Where the anomaly is if it is the most probable target: the place with the largest share of the
        belief within a radius. It is found by mean shift from each mode (Fukunaga and Hostetler 1975), so
        mirror modes are not averaged to a place where the target is not.
        """
        best = self._sought[int(np.argmax(self.probabilities[self._sought]))]
        hypothesis = self._hypotheses[best]
        if not isinstance(hypothesis, ParticleHypothesis):
            return LikelyPlace(north_m=self._loudest.north_m, east_m=self._loudest.east_m, share=0.0)
        sources, weights = hypothesis.sources(), hypothesis.weights
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
        share, forward_m, right_m = max(found, default=(0.0, 0.0, 0.0))
        north_m, east_m = self._in_map(forward_m, right_m)
        return LikelyPlace(north_m=north_m, east_m=east_m, share=share)

    def modes(self) -> list[Mode]:
        """The modes under the most probable target: north and east from the map's home, axis from north."""
        best = self._sought[int(np.argmax(self.probabilities[self._sought]))]
        hypothesis = self._hypotheses[best]
        if not isinstance(hypothesis, ParticleHypothesis):
            return []
        found = find_modes(hypothesis.sources(), hypothesis.weights)
        course = self._last.course_rad
        return [mode.moved(self._in_map(*mode.mean[:2]), course) for mode in found]

    def predictions(self, north_m: Array, east_m: Array, height_m: float, count: int) -> list[Array | None]:
        """What a pass over places (n,) would measure, nT, by each hypothesis: (count, n) for as many equally
        probable particles; None: an unknown shape predicts nothing.
        """
        found: list[Array | None] = []
        for hypothesis in self._hypotheses[:-1]:
            if not isinstance(hypothesis, ParticleHypothesis):
                found.append(None)
                continue
            last = self._last
            cosine, sine = math.cos(last.course_rad), math.sin(last.course_rad)
            off_n, off_e = north_m - last.north_m, east_m - last.east_m
            found.append(
                hypothesis.predicted_nt(
                    cosine * off_n + sine * off_e, cosine * off_e - sine * off_n, height_m, count
                )
            )
        return [*found, np.zeros((1, len(north_m)))]

    def _in_map(self, forward_m: float, right_m: float) -> tuple[float, float]:
        last = self._last
        cosine, sine = math.cos(last.course_rad), math.sin(last.course_rad)
        return (
            last.north_m + cosine * forward_m - sine * right_m,
            last.east_m + sine * forward_m + cosine * right_m,
        )


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
