"""Checks of sensor parameters; each error names the value and what is accepted."""

import math


def require_rate(rate_hz: int) -> None:
    """A sampling rate is a positive whole number of hertz."""
    if not isinstance(rate_hz, int) or rate_hz <= 0:
        raise ValueError(f"rate_hz = {rate_hz!r} is not accepted: a positive whole number of hertz is")


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
