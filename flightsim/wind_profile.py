"""The mean wind over height in the surface layer, as a multiple of the wind at a reference height.

Sources: MIL-F-8785C, paragraph 3.7.3.2 (logarithmic law up to 1000 ft; roughness length 0.15 ft for
approach and landing, 2 ft for other flight phases); the one-seventh power law of wind engineering;
SIM_WIND_T of ArduPilot 4.6.3's SITL (square root up to 60 m, or linear).
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.imperial import M_PER_FT
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_REFERENCE_M: Final = 10.0  # height of the wind in weather reports (WMO No. 8, part I, chapter 5)
_OPEN_ROUGHNESS_M: Final = 0.15 * M_PER_FT
_TOP_M: Final = 1000.0 * M_PER_FT


class WindLaw(StrEnum):
    """How the mean wind grows with height above ground."""

    UNIFORM = "uniform"
    LOGARITHMIC = "log"
    POWER = "power"
    LINEAR = "linear"


@dataclass(frozen=True, slots=True, kw_only=True)
class WindProfile:
    """Mean wind over height; its direction is the same at all heights.

    Attributes:
        law: uniform: 1 everywhere. log: ln(h/z0) / ln(h_ref/z0), zero at and below z0.
            power: (h/h_ref)^exponent. linear: 1 + gradient (h - h_ref), at least zero.
        reference_height_m: h_ref above ground, where the wind is the given one.
        roughness_length_m: z0 of the logarithmic law.
        exponent: of the power law.
        gradient_1_m: of the linear law.
        top_m: the wind stays the same above this height.
    """

    law: WindLaw = WindLaw.UNIFORM
    reference_height_m: float = _REFERENCE_M
    roughness_length_m: float = _OPEN_ROUGHNESS_M
    exponent: float = 1.0 / 7.0
    gradient_1_m: float = 0.0
    top_m: float = _TOP_M

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "law", WindLaw(self.law))
        except ValueError:
            accepted = ", ".join(law.value for law in WindLaw)
            raise ValueError(f"wind profile {self.law!r} is unknown; accepted are {accepted}") from None
        for name, value, unit, smallest, largest in (
            ("reference height", self.reference_height_m, " m", 1.0, 1000.0),
            ("roughness length", self.roughness_length_m, " m", 1e-5, 5.0),
            ("exponent", self.exponent, "", 0.0, 1.0),
            ("gradient", self.gradient_1_m, " 1/m", -10.0, 10.0),
            ("top", self.top_m, " m", 1.0, 10_000.0),
        ):
            if not smallest <= value <= largest:
                raise ValueError(
                    f"wind profile's {name} {value}{unit} is out of range; accepted are {smallest:g} to "
                    f"{largest:g}{unit}"
                )
        if self.law is WindLaw.LOGARITHMIC and self.roughness_length_m > 0.5 * self.reference_height_m:
            raise ValueError(
                f"wind profile's roughness length {self.roughness_length_m} m is more than half of its "
                f"reference height {self.reference_height_m} m; give a smaller one"
            )

    @property
    def constants(self) -> Array:
        """(6,) of `wind_factor`."""
        law = float(list(WindLaw).index(self.law))
        laws = self.reference_height_m, self.roughness_length_m, self.exponent, self.gradient_1_m, self.top_m
        return np.array([law, *laws])

    def factor(self, height_m: float) -> float:
        """Wind at a height above ground over the wind at the reference height; not negative."""
        return float(wind_factor(self.constants, height_m))


_UNIFORM, _LOGARITHMIC, _POWER = 0.0, 1.0, 2.0  # places in `WindLaw`


@kernel
def wind_factor(constants: Array, height_m: float) -> float:
    """`WindProfile.factor`; constants = (law, reference height, roughness, exponent, gradient, top)."""
    law, reference_m = constants[0], constants[1]
    h = min(height_m, constants[5])
    if law == _UNIFORM:
        return 1.0
    if law == _LOGARITHMIC:
        z0 = constants[2]
        return math.log(h / z0) / math.log(reference_m / z0) if h > z0 else 0.0
    if law == _POWER:
        return math.pow(max(h, 0.0) / reference_m, constants[3])
    return max(1.0 + constants[4] * (h - reference_m), 0.0)


SURFACE_LAYER: Final = WindProfile(law=WindLaw.LOGARITHMIC)
"""The logarithmic law over open ground, with the wind of a weather report at 10 m."""
