"""What of a list of cases runs by default."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow(*values: object) -> Any:
    """A case that is left to the slow tests."""
    return pytest.param(*values, marks=pytest.mark.slow)


def slow_after(quick: int, values: Iterable[object]) -> list[Any]:
    """The first few as they are; the others are left to the slow tests."""
    return [value if k < quick else slow(value) for k, value in enumerate(values)]
