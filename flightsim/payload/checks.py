"""Checks of payload parameters; each error names the value and what is accepted."""

import math


def require_finite(**values: float) -> None:
    """Places and angles: finite numbers."""
    for name, value in values.items():
        if not math.isfinite(value):
            raise ValueError(f"{name} = {value!r} is not accepted: a finite number is")


def require_probability(**values: float) -> None:
    """Probabilities: 0 to 1."""
    for name, value in values.items():
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"{name} = {value!r} is not accepted: 0 to 1 is")
