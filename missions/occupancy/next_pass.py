"""The next pass over an anomaly: the one that tells most for its time.

A pass at another heading and offset measures something else under each hypothesis. Its worth is the mutual
information between what is to be known and the measurements. The predicted measurements of equally probable
particles are the means of a mixture of Gaussians with one covariance, whose entropy is bounded from below
through the pairwise distances of the means (Kolchinsky and Tracey 2017, "Estimating mixture entropy with
pairwise distances", with the Chernoff coefficient of 1/2).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.occupancy.detection import MapError

Array = NDArray[np.float64]

_HEADINGS: Final = 12
_OFFSETS_M: Final = (-60.0, 0.0, 60.0)
_HALF_M: Final = 300.0  # of a pass, before and behind the anomaly
_SPACING_M: Final = 30.0
_PARTICLES: Final = 24  # of each hypothesis
_SHARE_OF_POSE: Final = 0.25  # worth of information on the place and the axis, beside that on the class


@dataclass(frozen=True, slots=True, kw_only=True)
class Pass:
    """A straight pass.

    Attributes:
        entry_ne_m, exit_ne_m: its ends.
        gain_nats: information that it is expected to give.
    """

    entry_ne_m: tuple[float, float]
    exit_ne_m: tuple[float, float]
    gain_nats: float


def candidate_passes(
    anomaly: Anomaly, *, noise_nt: float, map_error: MapError, height_m: float
) -> list[Pass]:
    """Passes at headings all around and at three offsets, with the information that each would give.

    Args:
        anomaly: the anomaly.
        noise_nt: standard deviation of a measurement.
        map_error: error of the map.
        height_m: height of the sensor above the map's home.
    """
    along_m = np.arange(-_HALF_M, _HALF_M + 1.0, _SPACING_M)
    apart_m = np.abs(along_m[:, None] - along_m)
    covariance = map_error.sigma_nt**2 * np.exp(-apart_m / map_error.correlation_m)
    covariance[np.diag_indices_from(covariance)] += noise_nt**2
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    centre_n, centre_e = anomaly.place_ne_m
    found = []
    for k in range(_HEADINGS):
        heading = math.tau * k / _HEADINGS
        cosine, sine = math.cos(heading), math.sin(heading)
        for offset_m in _OFFSETS_M:
            north_m = centre_n + along_m * cosine - offset_m * sine
            east_m = centre_e + along_m * sine + offset_m * cosine
            signals = anomaly.predictions(north_m, east_m, height_m, _PARTICLES)
            found.append(
                Pass(
                    entry_ne_m=(float(north_m[0]), float(east_m[0])),
                    exit_ne_m=(float(north_m[-1]), float(east_m[-1])),
                    gain_nats=_gain(signals, anomaly.probabilities, whitener),
                )
            )
    return found


def _gain(signals: Sequence[Array | None], probabilities: Array, whitener: Array) -> float:
    """Information on the class, and a share of that on the pose."""
    known = [k for k, signal in enumerate(signals) if signal is not None]
    shares = probabilities[known] / max(float(probabilities[known].sum()), 1e-12)
    white = [np.asarray(signals[k]) @ whitener.T for k in known]
    weights = np.concatenate(
        [np.full(len(w), share / len(w)) for w, share in zip(white, shares, strict=True)]
    )
    total = mixture_information(np.concatenate(white), weights)
    pose = sum(
        share * mixture_information(w, np.full(len(w), 1.0 / len(w)))
        for w, share in zip(white, shares.tolist(), strict=True)
    )
    return total - pose + _SHARE_OF_POSE * pose


def mixture_information(means: Array, weights: Array) -> float:
    """Lower bound of the mutual information between the component of a mixture and a sample of it, nats.

    Args:
        means: (n, m) means of Gaussians with unit covariance.
        weights: (n,) sum one.
    """
    squares = np.sum(means * means, axis=1)
    distances = np.maximum(0.0, squares[:, None] + squares - 2.0 * means @ means.T)
    overlap = np.exp(-distances / 8.0) @ weights
    return float(-weights @ np.log(overlap))
