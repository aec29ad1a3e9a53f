"""Types of numbers on the command line."""

import math
from typing import Any, Final

import click


class FiniteRange(click.FloatRange):
    """A range of numbers that excludes infinity and NaN, which would compare as if it were in every range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a usage error that names it."""
        number: float = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


SLOWEST: Final = 0.001
SPEEDUP: Final = FiniteRange(min=SLOWEST, max=1e6)
"""Simulated seconds per wall second."""

SECONDS: Final = FiniteRange(min=0.0, max=86_400.0)
"""A time of up to a day."""
