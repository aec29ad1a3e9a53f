"""The firmwares' data in TOML files, with the names of messages, commands, modes and reasons resolved."""

import tomllib
from collections.abc import Iterable, Mapping
from enum import Enum
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any, TypeVar

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mavlink import dialect

E = TypeVar("E", bound=Enum)
T = TypeVar("T")


@cache
def load_data(package: str, name: str) -> dict[str, Any]:
    """The tables of a TOML file in a package of this one, read once: "px4.copter", "modes.toml"."""
    file = files(f"autopilot_bridge.firmware.{package}").joinpath(name)
    return tomllib.loads(file.read_text(encoding="utf-8"))


def message_ids(names: Iterable[str]) -> tuple[int, ...]:
    """Ids of messages: "ATTITUDE"."""
    return tuple(getattr(dialect, f"MAVLINK_MSG_ID_{name}") for name in names)


def message_rates(table: Mapping[str, float]) -> dict[int, float]:
    """Rates in Hz by message id, in the order of the table."""
    return dict(zip(message_ids(table), table.values(), strict=True))


def commands(names: Iterable[str]) -> frozenset[int]:
    """Numbers of commands and mission items: "NAV_WAYPOINT"."""
    return frozenset(getattr(dialect, f"MAV_CMD_{name}") for name in names)


def modes(names: Iterable[str]) -> frozenset[FlightMode]:
    """Modes by their names in `FlightMode`."""
    return frozenset(FlightMode[name] for name in names)


def by_member(kind: type[E], table: Mapping[str, T]) -> Mapping[E, T]:
    """A table by the members of an enumeration, read-only, in the same order."""
    return MappingProxyType({kind[name]: value for name, value in table.items()})
