"""Conversion of the units of MAVLink's definition files to SI.

Temperatures stay in degrees Celsius; decibels and counts (pixels, bytes, bits) are not changed; percent
become a fraction of one.
"""

import math
from types import MappingProxyType
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2

_DEGREE: Final = math.pi / 180.0

SI: Final = MappingProxyType(
    {
        # time
        "s": (1.0, "s"),
        "ds": (0.1, "s"),
        "cs": (0.01, "s"),
        "ms": (1e-3, "s"),
        "us": (1e-6, "s"),
        "ns": (1e-9, "s"),
        "Hz": (1.0, "Hz"),
        "MHz": (1e6, "Hz"),
        # angles
        "rad": (1.0, "rad"),
        "mrad": (1e-3, "rad"),
        "deg": (_DEGREE, "rad"),
        "deg/2": (2.0 * _DEGREE, "rad"),
        "cdeg": (_DEGREE / 1e2, "rad"),
        "degE5": (_DEGREE / 1e5, "rad"),
        "degE7": (_DEGREE / 1e7, "rad"),
        "rad/s": (1.0, "rad/s"),
        "mrad/s": (1e-3, "rad/s"),
        "deg/s": (_DEGREE, "rad/s"),
        "ddeg/s": (_DEGREE / 10.0, "rad/s"),
        "cdeg/s": (_DEGREE / 1e2, "rad/s"),
        "rpm": (2.0 * math.pi / 60.0, "rad/s"),
        # lengths, speeds, accelerations
        "dam": (10.0, "m"),
        "m": (1.0, "m"),
        "dm": (0.1, "m"),
        "cm": (0.01, "m"),
        "mm": (1e-3, "m"),
        "cm^2": (1e-4, "m^2"),
        "l": (1e-3, "m^3"),
        "cm^3": (1e-6, "m^3"),
        "cm^3/min": (1e-6 / 60.0, "m^3/s"),
        "m/s": (1.0, "m/s"),
        "m/s*5": (0.2, "m/s"),
        "dm/s": (0.1, "m/s"),
        "cm/s": (0.01, "m/s"),
        "mm/s": (1e-3, "m/s"),
        "m/s/s": (1.0, "m/s^2"),
        "m/s^2": (1.0, "m/s^2"),
        "mG": (GRAVITY_M_S2 / 1e3, "m/s^2"),  # thousandths of standard gravity
        # mass, force, energy, pressure
        "kg": (1.0, "kg"),
        "g": (1e-3, "kg"),
        "N": (1.0, "N"),
        "Nm": (1.0, "N m"),
        "W": (1.0, "W"),
        "J": (1.0, "J"),
        "hJ": (100.0, "J"),
        "Pa": (1.0, "Pa"),
        "hPa": (100.0, "Pa"),
        "mbar": (100.0, "Pa"),
        "kPa": (1e3, "Pa"),
        # electricity, magnetism
        "V": (1.0, "V"),
        "cV": (0.01, "V"),
        "mV": (1e-3, "V"),
        "A": (1.0, "A"),
        "cA": (0.01, "A"),
        "mA": (1e-3, "A"),
        "Ah": (3600.0, "C"),
        "mAh": (3.6, "C"),
        "gauss": (1e-4, "T"),
        "mgauss": (1e-7, "T"),
        "T": (1.0, "T"),
        # temperature
        "degC": (1.0, "degC"),
        "cdegC": (0.01, "degC"),
        "K": (1.0, "K"),
        # fractions
        "%": (0.01, ""),
        "d%": (1e-3, ""),
        "c%": (1e-4, ""),
        # amounts of data
        "bits/s": (1.0, "bits/s"),
        "bytes/s": (1.0, "bytes/s"),
        "KiB/s": (1024.0, "bytes/s"),
        "MiB/s": (1048576.0, "bytes/s"),
        "bytes": (1.0, "bytes"),
        "MiB": (1048576.0, "bytes"),
    }
)
"""By unit of the definition files: factor, and unit of the product."""


def to_si(unit: str) -> tuple[float, str]:
    """Factor that converts a wire value to SI, and the resulting unit; an unknown unit is kept.

    Args:
        unit: unit as in the definition files, "degE7"; "" for numbers without one.
    """
    return SI.get(unit, (1.0, unit))
