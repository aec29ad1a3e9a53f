"""The passes of figures 4 to 6 of Lum et al. 2005, flown again: what the filter knows after a diagonal pass
over a target, and the confidence along a pass over a target and over a false anomaly.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification import particles as p
from estimators.magnetic_identification.classes import GaussianClass
from estimators.magnetic_identification.confidence import ConfidenceFilter, Control
from estimators.magnetic_identification.samples import TracePoint
from missions.embedded.magnetic_encounters import EncounterConditions, encounters
from missions.studies.magnetic_trial import anomalies_of

__all__ = ["BEYOND_M", "DIAGONAL_RAD", "TARGET", "DiagonalPass", "diagonal_pass", "pass_traces"]

Array = NDArray[np.float64]

DIAGONAL_RAD: Final = math.atan(0.2)
"""Course of the pass relative to the target's axis: slope 1:5."""
BEYOND_M: Final = 2250.0
"""Distance of the target behind the vehicle at the end of the pass."""
TARGET: Final = GaussianClass(
    name="target",
    amplitude_nt=100.0,
    sigma_along_m=1000.0,
    sigma_across_m=500.0,
    amplitude_spread=0.0,
    size_spread=0.0,
)
"""The target of figures 4 and 5, with values chosen here: the paper gives none."""
_STEP_M: Final = 25.0  # 1 Hz at 25 m/s
_BEFORE_M: Final = 5000.0
_NOISE_NT: Final = 0.5
_THRESHOLD_NT: Final = 3.0
_FORWARD_M, _TURN_RAD = 0.5, 0.015
_WHITE_NT2: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DiagonalPass:
    """The filter in a pass over the target's centre.

    Attributes:
        began: (n, 3) x and y in the frame of the target, m, and psi, of the particles at the first
            measurement beyond the threshold.
        filter: at the end.
        began_along_m: place of that measurement along the track, from the centre.
    """

    began: Array
    filter: ConfidenceFilter
    began_along_m: float

    @property
    def ended(self) -> Array:
        """(n, 3) as `began`, at the end."""
        return _poses(self.filter)


def diagonal_pass(seed: int, particles: int, *, by_roulette: bool = False) -> DiagonalPass:
    """Fly from where the anomaly begins over the centre of the target to `BEYOND_M` behind it.

    Args:
        seed: of the filter and of the noise.
        particles: their number.
        by_roulette: resample as the paper does.
    """
    rng = np.random.Generator(np.random.SFC64(seed))
    paper = ConfidenceFilter(TARGET, particles, rng, by_roulette=by_roulette)
    along_m = np.arange(-_BEFORE_M, BEYOND_M + 1.0, _STEP_M)
    square = (along_m * math.cos(DIAGONAL_RAD) / TARGET.sigma_along_m) ** 2
    square += (along_m * math.sin(DIAGONAL_RAD) / TARGET.sigma_across_m) ** 2
    noise_nt = _NOISE_NT * np.random.default_rng(seed).standard_normal(len(along_m))
    values = TARGET.amplitude_nt * np.exp(-0.5 * square) + noise_nt
    first = int(np.flatnonzero(values > _THRESHOLD_NT)[0])
    paper.start(float(values[first]), _WHITE_NT2)
    began = _poses(paper)
    control = Control(
        forward_m=_STEP_M, right_m=0.0, turn_rad=0.0, forward_sigma_m=_FORWARD_M, turn_sigma_rad=_TURN_RAD
    )
    for value in values[first + 1 :].tolist():
        paper.step(control, value, _WHITE_NT2)
    return DiagonalPass(began=began, filter=paper, began_along_m=float(along_m[first]))


def _poses(paper: ConfidenceFilter) -> Array:
    x, y, cosine, sine = (paper.particles[k] for k in (p.X, p.Y, p.COS, p.SIN))
    return np.column_stack((x, y, np.arctan2(sine, cosine)))


def pass_traces(seed: int, count: int) -> Iterator[tuple[bool, Array]]:
    """The confidence (7) along first passes, as in figure 6, of encounters of the study.

    Args:
        seed: of the first encounter; the next ones have the next seeds.
        count: number of maps, each with a target and a false anomaly.

    Yields:
        Whether it is a target, and (n, 2) time since the begin of the anomaly, s, and confidence.
    """
    for number in range(count):
        conditions = EncounterConditions()
        for encounter in encounters(seed + number, conditions, passes=1):
            anomaly = next(anomalies_of(encounter, seed + number, noise_nt=conditions.noise_nt))
            if anomaly is not None:
                yield encounter.is_target, _trace(anomaly.trace)


def _trace(points: Sequence[TracePoint]) -> Array:
    began_us = points[0].time_us
    # the first point begins the filter and has no confidence
    return np.array([((point.time_us - began_us) * 1e-6, point.confidence) for point in points[1:]])
