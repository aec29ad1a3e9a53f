"""Reads a world from a TOML file (docs/world.md).

A table of the file has the fields of a parameter class as its keys. The reader knows no class in particular:
it follows the type hints, so that a new field can be set in files at once. Angles are in degrees: a field
`NAME_rad` is the key `NAME_deg`.
"""

import inspect
import math
import types
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from enum import Enum, IntEnum
from pathlib import Path
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from flightsim.environment import Environment, Turbulence
from flightsim.foundation import documents
from flightsim.foundation.file_content import FileError
from flightsim.home import Home
from flightsim.payload import (
    Circle,
    ConstantVelocity,
    DipoleSignature,
    GaussianSignature,
    InducedDipole,
    MagneticField,
    MagneticSpec,
    PictureDetection,
    RandomWalk,
    ResolutionDetection,
    SignatureSpec,
    Static,
    TargetMotion,
    Terrain,
    TerrainSpec,
)
from flightsim.payload.detection import DetectionModel
from flightsim.toml_tables import listed
from flightsim.wind_profile import WindProfile


class WorldFileError(ValueError):
    """A world file can't be used; the message names file, key, value and what is accepted."""


def _home(*, lat_deg: float, lon_deg: float, alt_m: float, heading_deg: float = 0.0) -> Home:
    return Home(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m, heading_deg=heading_deg)


_MAKERS: Final[Mapping[Any, Callable[..., Any]]] = {
    Environment: Environment.from_wind,
    Home: _home,
    MagneticSpec | MagneticField: MagneticSpec,
    TerrainSpec | Terrain: TerrainSpec,
}
"""What makes a value of a type from a table, where it is not the class itself."""

_KINDS: Final[Mapping[Any, Mapping[str, type]]] = {
    TargetMotion: {
        "static": Static,
        "straight": ConstantVelocity,
        "circle": Circle,
        "random-walk": RandomWalk,
    },
    SignatureSpec: {"gaussian": GaussianSignature, "dipole": DipoleSignature, "induced": InducedDipole},
    DetectionModel: {"picture": PictureDetection, "resolution": ResolutionDetection},
}
"""Types of which a table selects one by its key `kind`."""

_WORDS: Final[Mapping[Any, str]] = {
    float: "a number",
    int: "a whole number",
    str: "a text",
    bool: "true or false",
    Path: "a path",
}


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a world file.

    Raises:
        WorldFileError: it can't be read.
    """
    try:
        return documents.read_toml(path)
    except FileError as error:
        raise WorldFileError(f"world file {error}") from None


class _Naming:
    """Adds file and key to the errors of values."""

    def __init__(self, path: Path, key: str) -> None:
        self._where = f"{path}: {key}: " if key else f"{path}: "

    def __enter__(self) -> None: ...

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, ValueError) and not isinstance(error, WorldFileError):
            raise WorldFileError(f"{self._where}{error}") from error


class WorldReader:
    """Makes values of parameter classes from the tables of a file.

    Args:
        path: the file, for errors and for the paths in it.

    Raises:
        WorldFileError: a value is not accepted, from all methods.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def naming(self, key: str) -> _Naming:
        """A context in which an error of a value names the file and the key."""
        return _Naming(self._path, key)

    def make(self, maker: Callable[..., Any], table: Any, key: str) -> Any:
        """Call a class or function with the entries of a table as its arguments."""
        if not isinstance(table, dict):
            raise self._refused(key, table, "a table")
        hints = get_type_hints(maker)
        parameters = inspect.signature(maker).parameters
        names = {_in_files(name): name for name in parameters}
        for given in table:
            if given not in names:
                raise WorldFileError(
                    f"{self._path}: {_joined(key, given)} is unknown; accepted are {listed(sorted(names))}"
                )
        for shown, name in names.items():
            if parameters[name].default is inspect.Parameter.empty and shown not in table:
                raise WorldFileError(f"{self._path}: {_joined(key, shown)} is missing")
        values = {
            names[given]: self._value(hints[names[given]], value, _joined(key, given))
            for given, value in table.items()
        }
        for shown, name in names.items():
            if shown != name and name in values:
                values[name] = _radians(values[name])
        with self.naming(key):
            return maker(**values)

    def _value(self, hint: Any, value: Any, key: str) -> Any:
        hint, optional = _without_none(hint)
        if hint in _KINDS:
            return self._of_kind(_KINDS[hint], value, key)
        if hint is WindProfile and isinstance(value, str):
            value = {"law": value}
        if hint in _MAKERS or is_dataclass(hint):
            if optional and isinstance(value, bool):  # a device: with its defaults, or left out
                return self.make(_MAKERS.get(hint, hint), {}, key) if value else None
            return self.make(_MAKERS.get(hint, hint), value, key)
        origin = get_origin(hint)
        if origin is tuple:
            return self._row(get_args(hint), value, key)
        if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
            if not isinstance(value, dict):
                raise self._refused(key, value, "a table")
            of = get_args(hint)[1]
            return {name: self._value(of, entry, _joined(key, name)) for name, entry in value.items()}
        if isinstance(hint, type) and issubclass(hint, Enum):
            return self._member(hint, value, key)
        if origin in (Union, types.UnionType):
            return self._one_of(get_args(hint), value, key)
        return self._plain(hint, value, key)

    def _of_kind(self, kinds: Mapping[str, type], value: Any, key: str) -> Any:
        if not isinstance(value, dict):
            raise self._refused(key, value, "a table")
        kind = value.get("kind")
        if not isinstance(kind, str) or kind not in kinds:
            raise self._refused(_joined(key, "kind"), kind, listed(kinds))
        return self.make(kinds[kind], {name: entry for name, entry in value.items() if name != "kind"}, key)

    def _row(self, hints: tuple[Any, ...], value: Any, key: str) -> tuple[Any, ...]:
        endless = len(hints) == 2 and hints[1] is Ellipsis
        if not isinstance(value, list) or not (endless or len(value) == len(hints)):
            raise self._refused(key, value, "a list" if endless else f"a list of {len(hints)}")
        return tuple(
            self._value(hints[0] if endless else hints[index], entry, f"{key}[{index + 1}]")
            for index, entry in enumerate(value)
        )

    def _member(self, hint: type[Enum], value: Any, key: str) -> Any:
        """A member of an enumeration, by its value or, for numbers of MAVLink, by its name."""
        by_name = issubclass(hint, IntEnum)
        members = {member.name.lower() if by_name else member.value: member for member in hint}
        if not isinstance(value, str) or value not in members:
            raise self._refused(key, value, listed(members))
        return members[value]

    def _one_of(self, hints: tuple[Any, ...], value: Any, key: str) -> Any:
        if Turbulence in hints:
            return self._member(Turbulence, value, key)
        if set(hints) == {str, Path}:  # a model: a name, or a path from the file's folder
            beside = self._path.parent / self._plain(str, value, key)
            return beside if ("/" in value or beside.is_file()) and beside.exists() else value
        raise self._refused(key, value, "nothing: it can be set in Python only")

    def _plain(self, hint: Any, value: Any, key: str) -> Any:
        accepted: Any = {float: (int, float), int: int, str: str, Path: str, bool: bool}.get(hint)
        if accepted is None:
            raise self._refused(key, value, "nothing: it can be set in Python only")
        is_number = isinstance(value, bool) is (hint is bool)
        if not isinstance(value, accepted) or not is_number or (hint is float and math.isnan(value)):
            raise self._refused(key, value, _WORDS[hint])
        if hint is Path:
            return self._path.parent / value
        return float(value) if hint is float else value

    def _refused(self, key: str, value: Any, accepted: str) -> WorldFileError:
        return WorldFileError(f"{self._path}: {key} is {value!r}; accepted: {accepted}")


def _joined(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


def _in_files(name: str) -> str:
    """The key of a field: angles in degrees."""
    return f"{name.removesuffix('_rad')}_deg" if name.endswith("_rad") else name


def _radians(value: Any) -> Any:
    return None if value is None else math.radians(value)


def _without_none(hint: Any) -> tuple[Any, bool]:
    """A type without the None that it may be, and whether it may be None."""
    if get_origin(hint) not in (Union, types.UnionType) or types.NoneType not in get_args(hint):
        return hint, False
    rest = [kind for kind in get_args(hint) if kind is not types.NoneType]
    joined = rest[0]
    for kind in rest[1:]:
        joined = joined | kind
    return joined, True
