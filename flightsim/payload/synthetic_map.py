"""Made-up geology: a magnetic map with the spectrum of a real one.

A layer of randomly magnetised rock at depth d gives an anomaly whose amplitude spectrum falls with the
wavenumber k as k^(-b/2) exp(-k d): the exponential from the distance (Spector and Grant 1970, Geophysics 35),
the power from magnetisation that is correlated over all scales (Maus and Dimri 1994, Geophysical Research
Letters 21). Above its sources the field is harmonic, so its upward derivative is -k in the spectrum (Blakely,
section 12.1).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.main_field import MainField
from flightsim.home import Home
from flightsim.payload.area_grid import AreaGrid
from flightsim.payload.magnetic_map import MagneticMap

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SyntheticMapParameters(AreaGrid):
    """A map to be made.

    Attributes:
        height_m: above home, what the map is valid at: the height to fly at.
        anomaly_nt: root mean square of the anomaly.
        source_depth_m: of the rock below the survey height.
        spectral_exponent: b above; 3 is common for crust.
        shallow_anomaly_nt, shallow_depth_m: a second layer, of the ground itself: what lies between the
            lines of a survey and is not on its map.
        raised_m: height of the map above the level that anomalies and depths are given for; the field is
            continued upwards by it.
    """

    south_m: float = -2000.0
    west_m: float = -2000.0
    north_m: float = 2000.0
    east_m: float = 2000.0
    spacing_m: Positive = 100.0
    height_m: float = 100.0
    anomaly_nt: NotNegative = 60.0
    source_depth_m: Positive = 500.0
    spectral_exponent: NotNegative = 3.0
    shallow_anomaly_nt: NotNegative = 3.0
    shallow_depth_m: Positive = 100.0
    raised_m: NotNegative = 0.0


def synthetic_map(
    parameters: SyntheticMapParameters,
    *,
    home: Home,
    seed: np.random.SeedSequence,
    decimal_year: float = 2026.0,
) -> MagneticMap:
    """Make a map: main field and anomaly, with its vertical gradient.

    Args:
        parameters: the map.
        home: origin of its frame.
        seed: of the geology.
        decimal_year: date of the main field (WMM-2025).
    """
    p = parameters
    rng = np.random.Generator(np.random.PCG64(seed))
    layers = [
        _layer(p, rng, amplitude_nt, depth_m)
        for amplitude_nt, depth_m in (
            (p.anomaly_nt, p.source_depth_m),
            (p.shallow_anomaly_nt, p.shallow_depth_m),
        )
    ]
    anomaly, gradient = (np.sum(parts, axis=0) for parts in zip(*layers, strict=True))

    rows, columns = p.shape
    main = MainField(home, decimal_year)
    north_m: Array = p.south_m + p.spacing_m * np.arange(rows, dtype=np.float64)
    east_m: Array = p.west_m + p.spacing_m * np.arange(columns, dtype=np.float64)
    main_nt = main.total_at_nt(north_m[:, None], east_m[None, :], p.height_m)
    return MagneticMap(
        north_m=north_m,
        east_m=east_m,
        total_field_nt=main_nt + anomaly,
        vertical_gradient_nt_m=main.gradient_up_nt_m + gradient,
        height_m=p.height_m,
        home=home,
    )


def _layer(
    p: SyntheticMapParameters, rng: np.random.Generator, amplitude_nt: float, depth_m: float
) -> tuple[Array, Array]:
    """Anomaly of one layer, without a mean, and its upward derivative."""
    rows, columns = p.shape
    # A field made by Fourier transform repeats itself; of twice the size only a quarter is shown.
    noise = np.fft.rfft2(rng.standard_normal((2 * rows, 2 * columns)))
    k_north = 2.0 * math.pi * np.fft.fftfreq(2 * rows, p.spacing_m)
    k_east = 2.0 * math.pi * np.fft.rfftfreq(2 * columns, p.spacing_m)
    k = np.hypot(k_north[:, None], k_east[None, :])
    k[0, 0] = np.inf  # no mean: that is the main field's
    spectrum = noise * k ** (-0.5 * p.spectral_exponent) * np.exp(-np.minimum(k, 1e9) * depth_m)
    spectrum[0, 0] = 0.0
    k[0, 0] = 0.0
    size = (2 * rows, 2 * columns)
    anomaly: Array = np.fft.irfft2(spectrum, s=size)[:rows, :columns]
    anomaly = anomaly - anomaly.mean()
    scale = amplitude_nt / float(np.sqrt(np.mean(anomaly**2)))
    if p.raised_m:
        spectrum = spectrum * np.exp(-k * p.raised_m)
        anomaly = np.fft.irfft2(spectrum, s=size)[:rows, :columns]
        anomaly = anomaly - anomaly.mean()
    gradient: Array = np.fft.irfft2(-k * spectrum, s=size)[:rows, :columns]
    return scale * anomaly, scale * gradient
