"""Compensation of a survey aircraft's own magnetic field (Tolles and Lawson), from a calibration flight.

Source: Leliak 1961 (IRE Transactions on Aerospace and Navigational Electronics 8); the regression on terms in
the band of the manoeuvres: Leach 1979, "Automatic aerial magnetometer compensation"; figure of merit: Reeves
2005, "Aeromagnetic Surveys", chapter 3.

The terms are 3 permanent, 5 induced (the sixth is a constant, as the squares of the direction cosines sum to
one) and 8 of eddy currents. Their regression is nearly singular on any flight, so a ridge keeps the
coefficients small.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from estimators.errors import EstimatorError
from flightsim.foundation.documents import read_json
from flightsim.foundation.file_content import FileError

__all__ = [
    "CYCLES",
    "TERMS",
    "Compensation",
    "compensation_bytes",
    "direction_cosines",
    "figure_of_merit_nt",
    "fit_compensation",
    "load_compensation",
    "mean_cycle",
    "noise_figure_nt",
]

Array = NDArray[np.float64]

TERMS: Final = 16
_BAND_HZ: Final = (0.08, 1.0)  # of manoeuvres: above the geology, below the noise
_ORDER: Final = 3
_LEAST_SAMPLES: Final = 300
_RIDGE: Final = 1e-6
_LEAST_TURN_RAD: Final = math.radians(5.0)
_HEADINGS: Final = 4
CYCLES: Final = 6
"""Of each manoeuvre. White noise of 0.2 nT makes 1.1 nT of the figure of merit by six, 1.5 nT by three."""
_NOISE_DRAWS: Final = 20
_TREND: Final = 2  # degree of what geology does during a manoeuvre
FORMAT: Final = "flightstack-compensation-1"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compensation:
    """Coefficients of the terms of an aircraft.

    Attributes:
        coefficients: (TERMS,) of the terms of `terms_of`: nT, those of eddy currents nT s.
    """

    coefficients: Array

    def field_nt(self, cosines: Array, rates_1_s: Array) -> Array:
        """The aircraft's field (n,), to be subtracted from readings.

        Args:
            cosines: (n, 3) direction cosines of the Earth's field in the body frame.
            rates_1_s: (n, 3) their rates.
        """
        found: Array = terms_of(cosines, rates_1_s) @ self.coefficients
        return found


def direction_cosines(
    roll_rad: Array, pitch_rad: Array, yaw_rad: Array, time_s: Array, direction_ned: Array
) -> tuple[Array, Array]:
    """Direction cosines (n, 3) of the Earth's field in the body frame, and their rates, from attitudes.

    Args:
        roll_rad, pitch_rad, yaw_rad: (n,).
        time_s: (n,) ascending.
        direction_ned: (3,) direction of the Earth's field.
    """
    sr, cr = np.sin(roll_rad), np.cos(roll_rad)
    sp, cp = np.sin(pitch_rad), np.cos(pitch_rad)
    sy, cy = np.sin(yaw_rad), np.cos(yaw_rad)
    n, e, d = direction_ned
    cosines = np.column_stack(
        (
            cp * cy * n + cp * sy * e - sp * d,
            (sr * sp * cy - cr * sy) * n + (sr * sp * sy + cr * cy) * e + sr * cp * d,
            (cr * sp * cy + sr * sy) * n + (cr * sp * sy - sr * cy) * e + cr * cp * d,
        )
    )
    return cosines, np.gradient(cosines, time_s, axis=0)


def terms_of(cosines: Array, rates_1_s: Array) -> Array:
    """The terms (n, TERMS): 3 direction cosines (permanent), 5 products of two of them (induced), and 8
    products of one with a rate, 1/s (eddy currents).

    Args:
        cosines, rates_1_s: (n, 3) of `direction_cosines`.
    """
    x, y, z = cosines.T
    dx, dy, dz = rates_1_s.T
    return np.column_stack(
        (
            *(x, y, z),
            *(x * x, x * y, x * z, y * y, y * z),
            *(x * dx, x * dy, x * dz, y * dx, y * dy, y * dz, z * dx, z * dy),
        )
    )


def fit_compensation(time_s: Array, total_nt: Array, cosines: Array, rates_1_s: Array) -> Compensation:
    """Fit the coefficients to a calibration flight: rolls, pitches and yaws on four headings, high up.

    Args:
        time_s: (n,) evenly spaced.
        total_nt: (n,) readings.
        cosines, rates_1_s: (n, 3) of `direction_cosines`.

    Raises:
        EstimatorError: the flight is too short, or its manoeuvres are too small.
    """
    if len(time_s) < _LEAST_SAMPLES:
        raise EstimatorError(
            f"the calibration flight has {len(time_s)} readings; {_LEAST_SAMPLES} or more make a compensation"
        )
    spread = float(np.max(np.linalg.norm(cosines - cosines.mean(axis=0), axis=1)))
    if spread < _LEAST_TURN_RAD:
        raise EstimatorError(
            f"the aircraft turned by {math.degrees(spread):.1f} degrees against the field on the calibration "
            "flight; roll, pitch and yaw on four headings"
        )
    rate_hz = (len(time_s) - 1) / float(time_s[-1] - time_s[0])
    band = butter(_ORDER, np.minimum(_BAND_HZ, 0.45 * rate_hz), "bandpass", fs=rate_hz, output="sos")
    terms = sosfiltfilt(band, terms_of(cosines, rates_1_s), axis=0)
    measured = sosfiltfilt(band, total_nt - total_nt.mean())
    scale = np.maximum(terms.std(axis=0), 1e-12)
    scaled = terms / scale
    normal = scaled.T @ scaled + _RIDGE * len(time_s) * np.eye(TERMS)
    coefficients = np.linalg.solve(normal, scaled.T @ measured) / scale
    return Compensation(coefficients=coefficients)


def figure_of_merit_nt(manoeuvres: Sequence[Array], *, rate_hz: float) -> float:
    """Figure of merit: the sum of the peak-to-peak values of the readings during rolls, pitches and yaws on
    four headings, twelve manoeuvres in all, without their slow change. Survey contracts ask for 1 to 2 nT.

    The cycles of a manoeuvre are averaged, so that noise counts less than what the manoeuvre does.

    Args:
        manoeuvres: (n,) readings of each manoeuvre of `CYCLES` cycles, evenly spaced.
        rate_hz: of the readings.

    Raises:
        EstimatorError: there are not twelve.
    """
    if len(manoeuvres) != 3 * _HEADINGS:
        raise EstimatorError(
            f"a figure of merit of {len(manoeuvres)} manoeuvres; accepted: 12, three on each of four headings"
        )
    return math.fsum(float(np.ptp(mean_cycle(values, rate_hz=rate_hz))) for values in manoeuvres)


def noise_figure_nt(manoeuvres: Sequence[Array], noise_nt: float, *, rate_hz: float) -> float:
    """The figure of merit that white noise alone makes: no compensation makes it smaller.

    Survey contracts are written for noise of some 0.01 nT, which makes next to nothing of 1 to 2 nT. The
    magnetometer of a small aircraft has more, and a figure of merit near this one tells nothing of the
    aircraft.

    Args:
        manoeuvres: as of `figure_of_merit_nt`; only their lengths count.
        noise_nt: standard deviation of a reading.
        rate_hz: of the readings.
    """
    rng = np.random.default_rng(0)
    drawn = [
        figure_of_merit_nt(
            [noise_nt * rng.standard_normal(len(values)) for values in manoeuvres], rate_hz=rate_hz
        )
        for _ in range(_NOISE_DRAWS)
    ]
    return math.fsum(drawn) / _NOISE_DRAWS


def mean_cycle(values_nt: Array, *, rate_hz: float) -> Array:
    """The mean of the cycles of a manoeuvre (n,), without its slow trend, as means over a second:
    the noise of single readings is no manoeuvre.
    """
    length = len(values_nt) // CYCLES
    # the filter of a second takes from the ends, so cycles are averaged before it, and repeated for it
    times = np.arange(len(values_nt)) / rate_hz
    level = np.polynomial.Polynomial.fit(times, values_nt, _TREND)(times)
    cycle = (values_nt - level)[: CYCLES * length].reshape(CYCLES, length).mean(axis=0)
    width = max(1, round(rate_hz))
    around = np.concatenate((cycle[length - width // 2 :], cycle, cycle[: width - width // 2 - 1]))
    return np.convolve(around, np.full(width, 1.0 / width), "valid")


def compensation_bytes(compensation: Compensation) -> bytes:
    """Contents of a file of coefficients (JSON), which `load_compensation` reads."""
    return (
        json.dumps({"format": FORMAT, "coefficients_nt": compensation.coefficients.tolist()}, indent=1) + "\n"
    ).encode()


def load_compensation(path: Path) -> Compensation:
    """Read coefficients. Other keys of the file, as older versions have written them, do not count.

    Raises:
        EstimatorError: the file can't be read, or holds no coefficients.
    """
    try:
        found = read_json(path)
    except FileError as error:
        raise EstimatorError(f"`compensation_file` {error}") from None
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise EstimatorError(
            f"`compensation_file` {path} is no compensation; accepted is the format {FORMAT}, which "
            "a calibration flight writes"
        )
    values = found.get("coefficients_nt")
    accepted = (
        isinstance(values, list)
        and len(values) == TERMS
        and all(isinstance(value, int | float) and math.isfinite(value) for value in values)
    )
    if not accepted:
        raise EstimatorError(
            f"`compensation_file` {path}: coefficients_nt is {str(values)[:60]}; accepted are {TERMS} finite "
            "numbers, as a calibration flight writes them"
        )
    return Compensation(coefficients=np.array(values, dtype=np.float64))
