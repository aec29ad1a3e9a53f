"""Checks of parameters; each error names the value and what is accepted."""

import math
from dataclasses import dataclass
from typing import Annotated


def require_finite(**values: float) -> None:
    """Places and angles: finite numbers."""
    for name, value in values.items():
        if not math.isfinite(value):
            raise ValueError(f"{name} = {value!r} is not accepted: a finite number is")


def require_not_negative(**values: float) -> None:
    """Noise, latency and quantum: finite and at least zero."""
    for name, value in values.items():
        if not (math.isfinite(value) and value >= 0.0):
            raise ValueError(f"{name} = {value!r} is not accepted: a finite number of at least 0 is")


def require_positive(**values: float) -> None:
    """Time constants and ranges: finite and above zero."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} = {value!r} is not accepted: a finite number above 0 is")


def require_probability(**values: float) -> None:
    """Probabilities and shares: 0 to 1."""
    for name, value in values.items():
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"{name} = {value!r} is not accepted: 0 to 1 is")


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """What a number may be: the metadata of a type of a field (`Positive`, ...) of a class on `Options`.

    Attributes:
        least, most, above: bounds.
        infinite, nan: an infinite number is accepted, or one that is none.
    """

    least: float | None = None
    most: float | None = None
    above: float | None = None
    infinite: bool = False
    nan: bool = False


Finite = Annotated[float, Bounds()]
Positive = Annotated[float, Bounds(above=0.0)]
NotNegative = Annotated[float, Bounds(least=0.0)]
Share = Annotated[float, Bounds(least=0.0, most=1.0)]
PositiveOrInf = Annotated[float, Bounds(above=0.0, infinite=True)]
NotNegativeOrInf = Annotated[float, Bounds(least=0.0, infinite=True)]
NotNegativeOrNan = Annotated[float, Bounds(least=0.0, nan=True)]
Count = Annotated[int, Bounds(least=1)]
Whole = Annotated[int, Bounds(least=0)]
Rate = Count
"""Types of fields that say what their numbers may be. Other numbers must be finite."""


def require_rate(rate_hz: int) -> None:
    """A sampling rate is a positive whole number of hertz."""
    if not isinstance(rate_hz, int) or rate_hz <= 0:
        raise ValueError(f"rate_hz = {rate_hz!r} is not accepted: a positive whole number of hertz is")
