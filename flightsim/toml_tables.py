"""Checked access to tables of a vehicle description; errors name file, key and value."""

import math
from pathlib import Path
from typing import Any

from flightsim.airframe_types import AirframeError


def listed(names: Any) -> str:
    """Names in a row, for a message."""
    return ", ".join(str(name) for name in names)


def only(table: dict[str, Any], accepted: Any, what: str, path: Path) -> None:
    """Refuse keys that mean nothing."""
    for key in table:
        if key not in tuple(str(name) for name in accepted):
            raise AirframeError(f"{path}: '{key}' is unknown; {what} are {listed(accepted)}")


def table_of(data: dict[str, Any], name: str, path: Path) -> dict[str, Any]:
    """A table that must be there."""
    table = data.get(name)
    if not isinstance(table, dict):
        raise AirframeError(f"{path} has no table [{name}]")
    return table


def text(table: dict[str, Any], key: str, path: Path) -> str:
    """A text that must be there."""
    value = table.get(key)
    if not isinstance(value, str):
        raise AirframeError(f"{path}: {key} is {value!r}; expected is a text")
    return value.removesuffix(".xml") if key == "jsbsim" else value


def number(table: dict[str, Any], key: str, path: Path, default: float | None = None) -> float:
    """A number, or the default where there is none."""
    value = table.get(key, default)
    if not isinstance(value, int | float) or isinstance(value, bool) or math.isnan(value):
        raise AirframeError(f"{path}: {key} is {value!r}; expected is a number")
    return float(value)


def names_of(table: dict[str, Any], key: str, path: Path) -> tuple[str, ...]:
    """A list of property names that must be there."""
    names = table.get(key)
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise AirframeError(f"{path}: {key} is {names!r}; expected is a list of JSBSim property names")
    return tuple(names)
