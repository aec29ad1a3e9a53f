"""Parameter tables as TOML files: one line per parameter, beside the flavour they belong to.

    MPC_XY_CRUISE = { type = "float", default = 5.0, min = 3.0, max = 20.0, unit = "m/s", text = "Speed" }
    "RC#_TRIM" = { type = "float", default = 1500.0, instances = [1, 8], text = "Neutral pulse" }

`type` is int8, int16, int32 or float. `min` and `max` are the range that the firmware documents, and
`used = [low, high]` is the range that the vehicle acts on where it differs (`ParameterDefinition.used`). With
`instances`, `#` in the name stands for each number from the first to the last; `default` may be a list with
one value for each. `reboot = true`: a change waits for the next boot.

A table of another vehicle class than the one that has the shared rows begins with `without`, the names (or
beginnings of names, which end in `_`) that it does not have. Its rows replace those of the same name.
"""

import tomllib
from collections.abc import Iterable, Iterator
from importlib.resources.abc import Traversable
from typing import Any, Final

from autopilot_bridge.parameters import ParameterDefinition, ParameterType

_TYPES: Final = {
    "int8": ParameterType.INT8,
    "int16": ParameterType.INT16,
    "int32": ParameterType.INT32,
    "float": ParameterType.REAL32,
}
_KEYS: Final = frozenset(("type", "default", "min", "max", "used", "unit", "reboot", "instances", "text"))


def load_table(
    file: Traversable, *, base: Iterable[ParameterDefinition] = ()
) -> tuple[ParameterDefinition, ...]:
    """The definitions in a TOML table, in the order of the file.

    Args:
        base: the table of the class that has the shared rows, which come first.

    Raises:
        ValueError: an entry is not as described above; the message names it.
    """
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    without = frozenset(table.pop("without", ()))
    prefixes = tuple(name for name in without if name.endswith("_"))
    own = {row.name: row for name, entry in table.items() for row in _definitions(name, entry)}
    shared = [
        own.pop(row.name, row) for row in base if not (row.name in without or row.name.startswith(prefixes))
    ]
    return (*shared, *own.values())


def _definitions(name: str, entry: dict[str, Any]) -> Iterator[ParameterDefinition]:
    unknown = set(entry) - _KEYS
    if unknown:
        raise ValueError(f"{name}: unknown key {min(unknown)!r}; accepted are {', '.join(sorted(_KEYS))}")
    if entry.get("type") not in _TYPES:
        raise ValueError(f"{name}: type {entry.get('type')!r}; accepted are {', '.join(_TYPES)}")
    if "default" not in entry:
        raise ValueError(f"{name}: no default")
    if "instances" not in entry:
        yield _definition(name, entry, entry["default"])
        return
    first, last = entry["instances"]
    defaults = entry["default"]
    if not isinstance(defaults, list):
        defaults = [defaults] * (last - first + 1)
    if "#" not in name or len(defaults) != last - first + 1:
        raise ValueError(f"{name}: {len(defaults)} defaults for instances {first} to {last} of a name with #")
    for number, default in enumerate(defaults, start=first):
        yield _definition(name.replace("#", str(number)), entry, default)


def _definition(name: str, entry: dict[str, Any], default: float) -> ParameterDefinition:
    return ParameterDefinition(
        name=name,
        type=_TYPES[entry["type"]],
        default=default,
        minimum=entry.get("min"),
        maximum=entry.get("max"),
        used=None if "used" not in entry else (entry["used"][0], entry["used"][1]),
        unit=entry.get("unit", ""),
        description=entry.get("text", ""),
        reboot_required=entry.get("reboot", False),
    )
