"""Checked access to tables of a vehicle description; errors name file, key and value."""

from pathlib import Path
from typing import Any, Final

from flightsim.airframe_types import AirframeError
from flightsim.foundation.conversion import Conversion, Refused

_CONVERSION: Final = Conversion()


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
    value = _value(str, table.get(key), key, path)
    return value.removesuffix(".xml") if key == "jsbsim" else value


def number(table: dict[str, Any], key: str, path: Path, default: float | None = None) -> float:
    """A number, or the default where there is none."""
    return float(_value(float, table.get(key, default), key, path))


def names_of(table: dict[str, Any], key: str, path: Path) -> tuple[str, ...]:
    """A list of property names that must be there."""
    accepted = "a list of JSBSim property names"
    names: tuple[str, ...] = _value(tuple[str, ...], table.get(key), key, path, accepted)
    if not names:
        raise AirframeError(f"{path}: {key} is []; expected is {accepted}")
    return names


def _value(kind: Any, value: Any, key: str, path: Path, accepted: str = "") -> Any:
    try:
        return _CONVERSION.value(kind, value)
    except Refused as error:
        reason = accepted or error.accepted
        raise AirframeError(f"{path}: {key} is {value!r}; expected is {reason}") from None
