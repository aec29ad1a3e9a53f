"""Conversion of the units of MAVLink's definition files to SI.

Temperatures stay in degrees Celsius; decibels and counts (pixels, bytes, bits) are not changed; percent
become a fraction of one.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2

_DEGREE: Final = math.pi / 180.0

_FACTORS: Final[Mapping[str, Mapping[str, float]]] = {
    # time
    "s": {"s": 1.0, "ds": 0.1, "cs": 0.01, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "Hz": {"Hz": 1.0, "MHz": 1e6},
    # angles
    "rad": {
        "rad": 1.0,
        "mrad": 1e-3,
        "deg": _DEGREE,
        "deg/2": 2.0 * _DEGREE,
        "cdeg": _DEGREE / 1e2,
        "degE5": _DEGREE / 1e5,
        "degE7": _DEGREE / 1e7,
    },
    "rad/s": {
        "rad/s": 1.0,
        "mrad/s": 1e-3,
        "deg/s": _DEGREE,
        "ddeg/s": _DEGREE / 10.0,
        "cdeg/s": _DEGREE / 1e2,
        "rpm": 2.0 * math.pi / 60.0,
    },
    # lengths, speeds, accelerations
    "m": {"dam": 10.0, "m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3},
    "m^2": {"cm^2": 1e-4},
    "m^3": {"l": 1e-3, "cm^3": 1e-6},
    "m^3/s": {"cm^3/min": 1e-6 / 60.0},
    "m/s": {"m/s": 1.0, "m/s*5": 0.2, "dm/s": 0.1, "cm/s": 0.01, "mm/s": 1e-3},
    "m/s^2": {"m/s/s": 1.0, "m/s^2": 1.0, "mG": GRAVITY_M_S2 / 1e3},
    # mass, force, energy, pressure
    "kg": {"kg": 1.0, "g": 1e-3},
    "N": {"N": 1.0},
    "N m": {"Nm": 1.0},
    "W": {"W": 1.0},
    "J": {"J": 1.0, "hJ": 100.0},
    "Pa": {"Pa": 1.0, "hPa": 100.0, "mbar": 100.0, "kPa": 1e3},
    # electricity, magnetism
    "V": {"V": 1.0, "cV": 0.01, "mV": 1e-3},
    "A": {"A": 1.0, "cA": 0.01, "mA": 1e-3},
    "C": {"Ah": 3600.0, "mAh": 3.6},
    "T": {"gauss": 1e-4, "mgauss": 1e-7, "T": 1.0},
    # temperature
    "degC": {"degC": 1.0, "cdegC": 0.01},
    "K": {"K": 1.0},
    # fractions
    "": {"%": 0.01, "d%": 1e-3, "c%": 1e-4},
    # amounts of data
    "bits/s": {"bits/s": 1.0},
    "bytes/s": {"bytes/s": 1.0, "KiB/s": 1024.0, "MiB/s": 1048576.0},
    "bytes": {"bytes": 1.0, "MiB": 1048576.0},
}
"""By unit of the product, then of the definition files; mG: thousandths of standard gravity."""

SI: Final = MappingProxyType(
    {unit: (factor, product) for product, units in _FACTORS.items() for unit, factor in units.items()}
)
"""By unit of the definition files: factor, and unit of the product."""


def to_si(unit: str) -> tuple[float, str]:
    """Factor that converts a wire value to SI, and the resulting unit; an unknown unit is kept.

    Args:
        unit: unit as in the definition files, "degE7"; "" for numbers without one.
    """
    return SI.get(unit, (1.0, unit))
