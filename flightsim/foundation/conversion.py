"""Values of annotated types from texts (NAME=VALUE, the command line) and from tables of files, by cattrs.

One set of rules for all that users write: numbers, whole numbers, true or false, choices, None, and several
values with
commas between. Values of files are typed already; only texts are converted to numbers. Angles: a table has
the key
`NAME_deg` for a field `NAME_rad`.
"""

import inspect
import math
import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import is_dataclass
from enum import Enum, IntEnum, StrEnum
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from cattrs import Converter
from cattrs.errors import StructureHandlerNotFoundError

from flightsim.foundation.options import without_none

_TRUE: Final = ("1", "true", "yes", "on")
_FALSE: Final = ("0", "false", "no", "off")
_IN_PYTHON: Final = "nothing: it can be set in Python only"


class Refused(ValueError):
    """A value is not accepted.

    Attributes:
        value: the value.
        accepted: what is accepted.
        path: keys and numbers that lead to it, from outside.
        where: the path as one text.
    """

    def __init__(self, value: Any, accepted: str, sentence: str = "") -> None:
        super().__init__(sentence or f"{value!r} is not {accepted}")
        self.value, self.accepted = value, accepted
        self.path: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        return "".join(part if part.startswith("[") else f".{part}" for part in self.path).removeprefix(".")


class NotMade(Refused):
    """The keys or values of a table do not make what it is for: a key is unknown or missing, or what the
    values are
    for does not accept them.
    """

    def __init__(self, sentence: str) -> None:
        super().__init__(None, "", sentence)


def key_of(name: str) -> str:
    """The key of a field in files: angles are in degrees."""
    return f"{name.removesuffix('_rad')}_deg" if name.endswith("_rad") else name


class Conversion:
    """Makes values of annotated types. Errors are `Refused`, with the path to the value.

    Args:
        text: whether values are texts, of the command line; otherwise they are values of a TOML file.
        folder: folder of relative paths.
        makers: what makes a value of a type from a table, where it is not the class itself.
        kinds: types of which a table selects one by its key `kind`.
        short: keys that a text stands for in place of a table, by type.
    """

    def __init__(
        self,
        *,
        text: bool = False,
        folder: Path = Path(),
        makers: Mapping[Any, Callable[..., Any]] = types.MappingProxyType({}),
        kinds: Mapping[Any, Mapping[str, type]] = types.MappingProxyType({}),
        short: Mapping[Any, str] = types.MappingProxyType({}),
    ) -> None:
        self._text, self._folder, self._makers, self._kinds, self._short = text, folder, makers, kinds, short
        self._converter = Converter(detailed_validation=False)
        hooks: tuple[tuple[Callable[[Any], bool], Callable[[Any, Any], Any]], ...] = (
            (lambda kind: is_dataclass(kind) or kind in makers, self._made),
            (lambda kind: _is_a(kind, Mapping), self._mapping),
            (lambda kind: get_origin(kind) is tuple, self._row),
            (lambda kind: get_origin(kind) in (Union, types.UnionType), self._one_of),
            (lambda kind: get_origin(kind) is Literal, self._literal),
            (lambda kind: kind in kinds, self._of_kind),
        )
        for applies, hook in hooks:
            self._converter.register_structure_hook_func(applies, hook)
        of_classes: tuple[tuple[type, Callable[[Any, Any], Any]], ...] = (
            *((kind, self._number) for kind in (int, float)),
            *((kind, self._member) for kind in (StrEnum, IntEnum, Enum)),
            *((bool, self._flag), (str, self._string), (Path, self._path)),
        )
        for of_class, hook in of_classes:
            self._converter.register_structure_hook(of_class, hook)

    def value(self, kind: Any, value: Any) -> Any:
        """A value of a type.

        Raises:
            Refused: the value is not accepted.
        """
        try:
            return self._converter.structure(value, kind)
        except StructureHandlerNotFoundError:
            raise Refused(value, _IN_PYTHON) from None

    def called(self, maker: Callable[..., Any], table: Any) -> Any:
        """The result of a class or function with the entries of a table as its arguments."""
        values = self.arguments(maker, table)
        for name, parameter in inspect.signature(maker).parameters.items():
            if parameter.default is inspect.Parameter.empty and name not in values:
                _inside(key_of(name), _not_made, "is missing")
        try:
            return maker(**values)
        except Refused:
            raise
        except ValueError as error:
            raise NotMade(f": {error}") from error

    def arguments(
        self, maker: Callable[..., Any], table: Any, *, without: Collection[str] = ()
    ) -> dict[str, Any]:
        """The entries of a table as arguments of a class or function; some may be left out.

        Args:
            maker: the class or function.
            table: the table.
            without: arguments that a table can't give.
        """
        if not isinstance(table, dict):
            raise Refused(table, "a table")
        hints = get_type_hints(maker)
        names = {key_of(name): name for name in inspect.signature(maker).parameters if name not in without}
        values = {}
        for key, given in table.items():
            if key not in names:
                _inside(key, _not_made, f"is unknown; accepted are {', '.join(sorted(names))}")
            name = names[key]
            found = _inside(key, partial(self.value, hints[name]), given)
            values[name] = math.radians(found) if name != key and found is not None else found
        return values

    def _made(self, table: Any, kind: Any) -> Any:
        if isinstance(table, str) and kind in self._short:
            table = {self._short[kind]: table}
        return self.called(self._makers.get(kind, kind), table)

    def _of_kind(self, value: Any, kind: Any) -> Any:
        if not isinstance(value, dict):
            raise Refused(value, "a table")
        kinds, name = self._kinds[kind], value.get("kind")
        if not isinstance(name, str) or name not in kinds:
            return _inside("kind", partial(_refuse, ", ".join(kinds)), name)
        return self.called(kinds[name], {key: entry for key, entry in value.items() if key != "kind"})

    def _mapping(self, value: Any, kind: Any) -> Any:
        if not isinstance(value, dict):
            raise Refused(value, "a table")
        of = get_args(kind)[1]
        if of in self._kinds:  # the key is the kind
            value = {
                key: {"kind": key} | entry if isinstance(entry, dict) else entry
                for key, entry in value.items()
            }
        return {key: _inside(key, partial(self.value, of), entry) for key, entry in value.items()}

    def _row(self, value: Any, kind: Any) -> tuple[Any, ...]:
        kinds = get_args(kind)
        endless = len(kinds) == 2 and kinds[1] is Ellipsis
        parts: Any = value
        if isinstance(value, str) and self._text:
            parts = [part.strip() for part in value.split(",")] if value else []
        if not isinstance(parts, list) or not (endless or len(parts) == len(kinds)):
            count = "" if endless else f" of {len(kinds)}"
            raise Refused(
                value, f"a list{count}", f"{value!r} is not {len(kinds)} values with commas between"
            )
        of = [kinds[0]] * len(parts) if endless else kinds
        return tuple(
            _inside(f"[{index + 1}]", partial(self.value, each), part)
            for index, (each, part) in enumerate(zip(of, parts, strict=True))
        )

    def _one_of(self, value: Any, kind: Any) -> Any:
        stated, optional = without_none(kind)
        if optional:
            if self._text and str(value).lower() in ("none", ""):
                return None
            if isinstance(value, bool) and (is_dataclass(stated) or stated in self._makers):
                return self._made({}, stated) if value else None  # a device: with its defaults, or left out
        if get_origin(stated) not in (Union, types.UnionType):
            return self._or_none(stated, value, optional)
        if stated in self._kinds or stated in self._makers:
            return (self._of_kind if stated in self._kinds else self._made)(value, stated)
        kinds = set(get_args(stated))
        if kinds == {str, Path} and not self._text:  # a name, or a path from the folder
            beside = self._folder / self.value(str, value)
            return beside if ("/" in value or beside.is_file()) and beside.exists() else value
        refused = Refused(value, _IN_PYTHON)
        if not self._text:
            members = {each for each in kinds if isinstance(each, type) and issubclass(each, Enum)}
            if not members and type(value) in kinds & {bool, int, float, str}:  # it is typed already
                return self.value(type(value), value)
            kinds = members
        for each in sorted(kinds, key=lambda k: k is str):  # every text is a str, so it is tried last
            try:
                return self.value(each, value)
            except Refused as error:
                refused = error
        raise refused

    def _or_none(self, kind: Any, value: Any, optional: bool) -> Any:
        try:
            return self.value(kind, value)
        except Refused as error:
            if self._text and optional and not error.path:
                raise Refused(value, error.accepted, f"{error}, or none") from None
            raise

    def _literal(self, value: Any, kind: Any) -> Any:
        return _chosen(value, {str(each): each for each in get_args(kind)})

    def _member(self, value: Any, kind: Any) -> Any:
        """A member of an enumeration, by its value or, where that is a number, by its name."""
        by_name = issubclass(kind, IntEnum)
        return _chosen(
            value, {member.name.lower() if by_name else str(member.value): member for member in kind}
        )

    def _number(self, value: Any, kind: Any) -> Any:
        accepted = "a whole number" if kind is int else "a number"
        try:
            typed = isinstance(value, int if kind is int else (int, float)) and not isinstance(value, bool)
            number = kind(value) if typed or (self._text and isinstance(value, str)) else math.nan
        except ValueError:
            number = math.nan
        if math.isnan(number):
            raise Refused(value, accepted)
        return number

    def _flag(self, value: Any, _: Any) -> bool:
        if self._text and str(value).lower() in _TRUE + _FALSE:
            return str(value).lower() in _TRUE
        if not isinstance(value, bool):
            raise Refused(value, "true or false", f"{value!r} is not accepted; give true or false")
        return value

    def _string(self, value: Any, _: Any) -> str:
        if not isinstance(value, str):
            raise Refused(value, "a text")
        return value

    def _path(self, value: Any, _: Any) -> Path:
        if not isinstance(value, str):
            raise Refused(value, "a path")
        return self._folder / value


def _is_a(kind: Any, base: type) -> bool:
    origin = get_origin(kind)
    return isinstance(origin, type) and issubclass(origin, base)


def _refuse(accepted: str, value: Any) -> Any:
    raise Refused(value, accepted)


def _not_made(sentence: str) -> Any:
    raise NotMade(f" {sentence}")


def _chosen(value: Any, known: Mapping[str, Any]) -> Any:
    if not isinstance(value, str) or value not in known:
        accepted = ", ".join(known)
        raise Refused(value, accepted, f"{value!r} is not accepted; there are {accepted}")
    return known[value]


def _inside(key: str, make: Callable[[Any], Any], value: Any) -> Any:
    """A value made of an entry of a table or row; its errors have the path to it."""
    try:
        return make(value)
    except Refused as error:
        error.path = (key, *error.path)
        raise
