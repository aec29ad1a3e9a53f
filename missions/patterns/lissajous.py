"""Lissajous patterns: Steckenrider, Leamy, Furukawa 2020 (SSRR), section II-C, equation 11.

    x(t) = A_x sin(w_x t + p_x),   y(t) = A_y sin(w_y t + p_y)

with x to the east and y to the north, as on a map. Only the ratio of the frequencies and the phases shape the
curve, so the curve's parameter is the fundamental phase, and the planner determines the time.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import Final

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import Array, knots_by_length

# frequencies like 1.4 are 7:5; ratios with larger integers are treated as open curves
_LARGEST_TERM: Final = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Lissajous:
    """A Lissajous curve (equation 11), parametrised by the phase u = w t of the fundamental frequency w.

    Attributes:
        amplitude_x_m, amplitude_y_m: half the width (east) and half the height (north).
        ratio_x, ratio_y: the frequencies in units of the fundamental. Integers without a common divisor for a
            closed curve, which then closes at u = 2 pi; otherwise the curve is open, and 0..end is
            `open_turns` turns of the slower axis.
        phase_x_rad, phase_y_rad: p_x and p_y.
        open_turns: length of an open curve; not used for a closed one.
    """

    amplitude_x_m: float
    amplitude_y_m: float
    ratio_x: float = 1.0
    ratio_y: float = 1.0
    phase_x_rad: float = 0.0
    phase_y_rad: float = 0.0
    open_turns: float = 20.0

    def __post_init__(self) -> None:
        for name, value in (("width", self.amplitude_x_m), ("height", self.amplitude_y_m)):
            if not (math.isfinite(value) and value > 0.0):
                raise PlanError(f"a pattern of {name} {2 * value:g} m is empty; ask for more than 0 m")
        for name, value in (("x", self.ratio_x), ("y", self.ratio_y)):
            if not (math.isfinite(value) and value > 0.0):
                raise PlanError(
                    f"frequency {value:g} of axis {name} is not possible; "
                    "ask for more than 0, as in `ratio=3:4`"
                )
        for value in (self.phase_x_rad, self.phase_y_rad):
            if not math.isfinite(value):
                raise PlanError(f"phase {value} is not finite")

    @classmethod
    def from_frequencies(
        cls,
        *,
        amplitude_x_m: float,
        amplitude_y_m: float,
        frequency_x_rad_s: float,
        frequency_y_rad_s: float,
        phase_x_rad: float = 0.0,
        phase_y_rad: float = 0.0,
    ) -> "Lissajous":
        """From the paper's w_x and w_y (rad/s). A ratio of small integers (up to 64) is detected and gives a
        closed curve.

        The time for 0..2 pi of the parameter is then `natural_period_s(frequency_x_rad_s)`.
        """
        if not (frequency_x_rad_s > 0.0 and frequency_y_rad_s > 0.0):
            raise PlanError(
                f"frequencies {frequency_x_rad_s:g} and {frequency_y_rad_s:g} rad/s: both must be more than 0"
            )
        ratio_x, ratio_y = reduced_ratio(frequency_x_rad_s, frequency_y_rad_s)
        return cls(
            amplitude_x_m=amplitude_x_m,
            amplitude_y_m=amplitude_y_m,
            ratio_x=ratio_x,
            ratio_y=ratio_y,
            phase_x_rad=phase_x_rad,
            phase_y_rad=phase_y_rad,
        )

    @property
    def closed(self) -> bool:
        """Whether the ratio is one of integers."""
        return float(self.ratio_x).is_integer() and float(self.ratio_y).is_integer()

    @property
    def end(self) -> float:
        if self.closed:
            return 2.0 * math.pi / math.gcd(int(self.ratio_x), int(self.ratio_y))
        return 2.0 * math.pi * self.open_turns / min(self.ratio_x, self.ratio_y)

    @property
    def retraced(self) -> bool:
        """Whether a closed curve reverses at two cusps and follows itself back (both axes at rest at the same
        time).
        """
        if not self.closed:
            return False
        a, b = int(self.ratio_x), int(self.ratio_y)
        # both derivatives vanish at u: a u + p_x and b u + p_y are odd multiples of pi/2
        candidates = ((2 * k + 1) * math.pi / 2 - self.phase_x_rad for k in range(2 * a))
        return any(abs(math.cos(b * (c / a) + self.phase_y_rad)) < 1e-9 for c in candidates)

    def natural_period_s(self, frequency_x_rad_s: float) -> float:
        """Seconds from 0 to `end` in the pattern's own time law, for w_x in rad/s."""
        return self.end * self.ratio_x / frequency_x_rad_s

    def points(self, u: Array) -> Array:
        north = self.amplitude_y_m * np.sin(self.ratio_y * u + self.phase_y_rad)
        east = self.amplitude_x_m * np.sin(self.ratio_x * u + self.phase_x_rad)
        return np.stack((north, east), axis=1)

    def derivatives(self, u: Array) -> tuple[Array, Array]:
        x, y = self.ratio_x * u + self.phase_x_rad, self.ratio_y * u + self.phase_y_rad
        ax, ay = self.amplitude_x_m, self.amplitude_y_m
        first = np.stack((ay * self.ratio_y * np.cos(y), ax * self.ratio_x * np.cos(x)), axis=1)
        second = np.stack((-ay * self.ratio_y**2 * np.sin(y), -ax * self.ratio_x**2 * np.sin(x)), axis=1)
        return first, second

    def knots(self, spacing_m: float) -> Array:
        turns = max(1, math.ceil(self.end * max(self.ratio_x, self.ratio_y) / (0.5 * math.pi)))
        return knots_by_length(self, spacing_m, np.linspace(0.0, self.end, turns + 1))


def reduced_ratio(x: float, y: float) -> tuple[float, float]:
    """x : y as integers without a common divisor if such a ratio exists (up to 64, tolerance 1e-6), otherwise
    (x/y, 1).
    """
    fraction = Fraction(x / y).limit_denominator(_LARGEST_TERM)
    if 0 < fraction.numerator <= _LARGEST_TERM and abs(float(fraction) - x / y) <= 1e-6 * x / y:
        return float(fraction.numerator), float(fraction.denominator)
    return x / y, 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedPattern:
    """One of the paper's four patterns: frequency ratio x:y, and the phases."""

    ratio_x: int
    ratio_y: int
    phase_x_rad: float
    phase_y_rad: float = 0.0


NAMED_PATTERNS: Final[Mapping[str, NamedPattern]] = MappingProxyType(
    {
        "L1": NamedPattern(ratio_x=1, ratio_y=1, phase_x_rad=0.5 * math.pi),
        "L2": NamedPattern(ratio_x=1, ratio_y=2, phase_x_rad=0.0),
        "L3": NamedPattern(ratio_x=3, ratio_y=4, phase_x_rad=0.0),
        "L4": NamedPattern(ratio_x=5, ratio_y=6, phase_x_rad=0.0),
    }
)
"""The patterns of the paper's Table I. L1 is the circle (section IV-A). The parameters of L2 to L4 are only
in the paper's figure 2, and not in its text, so they are chosen here: the lemniscate (named in section II-C),
then ratios n : n+1 of growing order. With one odd and one even term and no phase the curves start in the
centre, where the paper's drone starts, and never run back over themselves.
"""


def named_lissajous(name: str, *, width_m: float, height_m: float) -> Lissajous:
    """The pattern "L1".."L4" in a box of `width_m` (east) by `height_m` (north)."""
    pattern = NAMED_PATTERNS.get(name.upper())
    if pattern is None:
        raise PlanError(f"pattern {name!r} is not known; there are {', '.join(NAMED_PATTERNS)}")
    return Lissajous(
        amplitude_x_m=0.5 * width_m,
        amplitude_y_m=0.5 * height_m,
        ratio_x=pattern.ratio_x,
        ratio_y=pattern.ratio_y,
        phase_x_rad=pattern.phase_x_rad,
        phase_y_rad=pattern.phase_y_rad,
    )
