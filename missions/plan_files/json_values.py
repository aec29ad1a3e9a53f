"""Values of a JSON file from another program. Errors name the place in the file."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

Refuse = Callable[[str, str], Exception]
"""(place in the file, what is wrong) -> the error to raise."""


def mapping(value: Any, where: str, refuse: Refuse) -> Mapping[str, Any]:
    """Check that a value is a JSON object, and return it."""
    if not isinstance(value, Mapping):
        raise refuse(where, f"{shown(value)} is not a JSON object")
    return value


def entries(value: Any, where: str, refuse: Refuse) -> Sequence[Any]:
    """Check that a value is a JSON array, and return it."""
    if not isinstance(value, list):
        raise refuse(where, f"{shown(value)} is not a JSON array")
    return value


def is_number(value: Any) -> bool:
    """Whether a value is a JSON number; true and false are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def number(entry: Mapping[str, Any], name: str, where: str, refuse: Refuse) -> float:
    """A required number."""
    value = entry.get(name)
    if not is_number(value):
        raise refuse(where, f"{name} = {shown(value)} is not a number")
    return _finite_float(value, f"{where}, {name}", refuse)


def whole(entry: Mapping[str, Any], name: str, where: str, refuse: Refuse) -> int:
    """A required integer that is not negative."""
    value: Any = entry.get(name)
    if not is_number(value) or (isinstance(value, float) and not math.isfinite(value)) or value != int(value):
        raise refuse(where, f"{name} = {shown(value)} is not a whole number")
    if not 0 <= value < 2**31:
        raise refuse(where, f"{name} = {shown(value)} is not in 0..{2**31 - 1}")
    return int(value)


def flag(entry: Mapping[str, Any], name: str, default: bool, where: str, refuse: Refuse) -> bool:
    """True or false."""
    value = entry.get(name, default)
    if not isinstance(value, bool):
        raise refuse(where, f"{name} = {shown(value)} is not true or false")
    return value


def numbers(value: Any, count: int, where: str, refuse: Refuse) -> list[float]:
    """An array of exactly `count` numbers."""
    if not (isinstance(value, list) and len(value) == count and all(is_number(v) for v in value)):
        raise refuse(where, f"{shown(value)} is not an array of {count} numbers")
    return [_finite_float(v, where, refuse) for v in value]


def _finite_float(value: Any, where: str, refuse: Refuse) -> float:
    try:
        return float(value)
    except OverflowError:
        raise refuse(where, "the number is too large") from None


def shown(value: Any) -> str:
    """A value as text for a message, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
