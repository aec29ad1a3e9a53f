"""Checks of parameters; each error names the value and what is accepted."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from enum import Enum
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any, Final, get_type_hints

Check = Callable[..., None]
"""Checks numbers by name, and raises a ValueError for the first one that is not accepted."""

_NO_OTHERS: Final[Mapping[str, Check]] = MappingProxyType({})


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


Finite = Annotated[float, require_finite]
Positive = Annotated[float, require_positive]
NotNegative = Annotated[float, require_not_negative]
Share = Annotated[float, require_probability]
PositiveOrInf = Annotated[Positive, math.inf]
NotNegativeOrInf = Annotated[NotNegative, math.inf]
"""Types of a field for which `check_fields` requires something else than of the others."""


def require_rate(rate_hz: int) -> None:
    """A sampling rate is a positive whole number of hertz."""
    if not isinstance(rate_hz, int) or rate_hz <= 0:
        raise ValueError(f"rate_hz = {rate_hz!r} is not accepted: a positive whole number of hertz is")


def named(record: Any, *names: str) -> dict[str, Any]:
    """Fields of a record, to be checked by name; those that are None are left out."""
    return {name: value for name in names if (value := getattr(record, name)) is not None}


def require_members(record: Any, **kinds: type[Enum]) -> None:
    """Fields of a frozen dataclass are members of these enumerations; a member's value becomes the member."""
    for name, kind in kinds.items():
        value = getattr(record, name)
        try:
            object.__setattr__(record, name, kind(value))
        except ValueError:
            accepted = ", ".join(str(member.value) for member in kind)
            raise ValueError(f"{name} {value!r} is not one of {accepted}") from None


def check_amounts(record: Any, *positive: str) -> None:
    """Check the float fields of a dataclass: those named must be above zero, the others at least zero."""
    values = {field.name: getattr(record, field.name) for field in fields(record) if field.type is float}
    require_positive(**{name: values.pop(name) for name in positive})
    require_not_negative(**values)


def check_fields(
    record: Any, usually: Check, *, but: Mapping[str, Check] = _NO_OTHERS, unchecked: Collection[str] = ()
) -> None:
    """Check every number among the fields of a dataclass, and in its tuples.

    Args:
        record: an instance; fields other than numbers are skipped.
        usually: what the numbers must be whose fields have none of the types above.
        but: what some must be instead, by name.
        unchecked: names of those that are checked elsewhere.
    """
    for name, stated, unlimited in _stated(record.__class__):
        value = getattr(record, name, None)
        if name in unchecked or (unlimited and value == math.inf):
            continue
        check = but.get(name) or stated or usually
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, int | float) and not isinstance(part, bool | Enum):
                check(**{name: part})


@cache
def _stated(kind: Any) -> tuple[tuple[str, Any, bool], ...]:
    """What the type of each field of a dataclass states: its name, a check, whether it may be infinite."""
    hints = get_type_hints(kind, include_extras=True)
    stated = {field.name: getattr(hints[field.name], "__metadata__", ()) for field in fields(kind)}
    return tuple(
        (name, next((part for part in parts if callable(part)), None), math.inf in parts)
        for name, parts in stated.items()
    )
