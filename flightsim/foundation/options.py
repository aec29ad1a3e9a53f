"""Fields that declare themselves once: type, default, unit, bounds and help stand on the field.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class FilterParameters(Options):
        yaw_sigma_rad: float = option(0.01, least=0.0, help="Standard deviation of the vehicles' yaw.")

What shows, reads or checks such a field takes it from there (`declared`): the command line and the tables of
the docs (`flightsim.foundation.user_options`), keys of files and NAME=VALUE
(`flightsim.foundation.conversion`), the check of the constructor. Importing this module, or one that declares
options with it, costs nothing: neither loads NumPy or compiled code.
"""

import math
import types
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, replace
from enum import Enum
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from flightsim.foundation.checks import Bounds

T = TypeVar("T")

_OPTION: Final = "option"
_HELD: Final = "held"
_OF_BASE: Final = "of base"

UNITS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "rad": "degrees", "deg": "degrees", "m": "m", "s": "s", "hz": "Hz", "px": "px", "nt": "nT",
        "pa": "Pa", "m_s": "m/s", "m_s2": "m/s2", "rad_s": "rad/s", "m2": "m2", "a_m2": "A m2", "us": "us",
    }
)  # fmt: skip
"""Unit in which users give a field, by the suffix of its name. Angles in radians are given in degrees."""

_COMPOUND: Final = (
    "_1_s",
    "_1_m",
    "_1_rad",
    "sqrt_s",
    "sqrt_hz",
    "root_s",
    "root_hz",
    "per_s",
    "per_m2",
    "_s2",
)
"""Endings of names whose unit has no short form: they are given in the unit of their name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """What a field declares besides type and default.

    Attributes:
        help: what the field is: a sentence that begins with a noun and can be read alone. The unit is shown
            beside it.
        unit: unit in which users give it; None: by the suffix of its name (`UNITS`).
        least, most, above, below: bounds, in the unit of the field, of each number in it. A number must be
            finite,
            unless `infinite` is set.
        infinite, nan: an infinite number is accepted, or one that is none.
        name: name for users, where it is not that of the field without its unit. Fields of one class with the
            same
            name are one option: the sides of an area.
        metavar: placeholder of the value for users; "": its unit.
        varies: the default where it is not one value: "aircraft: 60", or for None: "as the map states it".
        needs: name of another option without which it has no effect, and the values of that option with which
            it has
            one; no values: every value.
        replaces: names of options that have no effect beside it.
        separators: characters that may separate the numbers of a tuple, or of several fields of one name.
        lone: what the others are where one number is given; "same": the same number; None: all must be given.
    """

    help: str = ""
    unit: str | None = None
    least: float | None = None
    most: float | None = None
    above: float | None = None
    below: float | None = None
    infinite: bool = False
    nan: bool = False
    name: str = ""
    metavar: str = ""
    varies: str = ""
    needs: tuple[str, tuple[str, ...]] | None = None
    replaces: tuple[str, ...] = ()
    separators: str = ","
    lone: float | str | None = None


_PLAIN: Final = Option()


def option(
    default: T,
    *,
    help: str = "",
    unit: str | None = None,
    least: float | None = None,
    most: float | None = None,
    above: float | None = None,
    below: float | None = None,
    infinite: bool = False,
    name: str = "",
    metavar: str = "",
    varies: str = "",
    needs: tuple[str, tuple[str, ...]] | None = None,
    replaces: tuple[str, ...] = (),
    separators: str = ",",
    lone: float | str | None = None,
) -> T:
    """Declare a field of a dataclass on `Options`: its default, and what `Option` has."""
    stated = Option(
        help=help, unit=unit, least=least, most=most, above=above, below=below, infinite=infinite, name=name,
        metavar=metavar, varies=varies, needs=needs, replaces=replaces, separators=separators, lone=lone,
    )  # fmt: skip
    return field(default=default, metadata={_OPTION: stated})


def other_default(default: T, *, above: float | None = None, varies: str = "") -> T:
    """Declare another default for a field of the base class; the rest is what the base declares.

    Args:
        default: default of the field.
        above: as of `Option`, where the base states none.
        varies: as of `Option`.
    """
    return field(default=default, metadata={_OF_BASE: {"above": above, "varies": varies}})


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """How fields of held parameters are shown to users: as one option.

    Attributes:
        fields: names of the fields.
        together: the fields get one part of the value each; otherwise all get the same value.
        help, metavar, varies, needs, separators, lone: as of `Option`, where those of the first field do not
            say what the fields are together.
    """

    fields: tuple[str, ...]
    together: bool = False
    help: str = ""
    metavar: str = ""
    varies: str = ""
    needs: tuple[str, tuple[str, ...]] | None = None
    separators: str = ","
    lone: float | str | None = None

    def over(self, declared: Option) -> Option:
        """The option that users see."""
        return replace(
            declared,
            help=self.help or declared.help,
            metavar=self.metavar or declared.metavar,
            varies=self.varies or declared.varies,
            needs=self.needs,
            separators=self.separators,
            lone=self.lone,
        )


def held(default: T, **shown: str | Shown) -> T:
    """Declare a field that holds other options, with their own fields and checks.

    Args:
        default: default of the field, an instance of a class on `Options`.
        shown: fields of it that users set beside those of the holder, by their name for users with _ in place
            of -.
    """
    return field(default=default, metadata={_HELD: MappingProxyType(shown)})


class OptionError(ValueError):
    """A field does not accept its value.

    Attributes:
        field: name of the field.
        reason: the value, and what is accepted, in the unit of the field.
        reason_for_users: the same in the unit in which users give it.
    """

    def __init__(self, name: str, reason: str, reason_for_users: str) -> None:
        super().__init__(f"{name} {reason}")
        self.field = name
        self.reason = reason
        self.reason_for_users = reason_for_users


@dataclass(frozen=True, slots=True, kw_only=True)
class Declared:
    """A field with what it declares.

    Attributes:
        name: name of the field.
        kind: its type without None.
        optional: whether it may be None.
        default: its default; `dataclasses.MISSING`: it has none.
        option: what it declares; without a help, it is set in Python only.
        shown: what users see of held options (`held`); None: the field is an option itself.
    """

    name: str
    kind: Any
    optional: bool
    default: Any
    option: Option
    shown: "Mapping[str, str | Shown] | None" = None

    @property
    def hint(self) -> Any:
        """Its type, with None if it may be None."""
        return self.kind | None if self.optional else self.kind

    @property
    def unit(self) -> str:
        """Unit in which users give it; "": none, or that of its name."""
        return unit_of(self.name) if self.option.unit is None else self.option.unit

    def for_users(self, value: Any) -> Any:
        """A number, or each of a tuple, in the unit in which users give it."""
        if isinstance(value, tuple):
            return tuple(self.for_users(part) for part in value)
        return math.degrees(value) if self.in_degrees and isinstance(value, float) else value

    @property
    def in_degrees(self) -> bool:
        """Whether users give it in degrees, and it is in radians."""
        return self.unit == "degrees" and self.name.endswith("_rad")

    def check(self, value: Any) -> None:
        """Raise OptionError for a number that is not accepted, or the first such number of a tuple, or for a
        word that is not a choice.
        """
        if get_origin(self.kind) is Literal and value not in get_args(self.kind):
            reason = f"{value!r} is not one of {', '.join(map(str, get_args(self.kind)))}"
            raise OptionError(self.name, reason, reason)
        for part in value if isinstance(value, tuple) else (value,):
            if not isinstance(part, int | float) or isinstance(part, bool | Enum):
                continue
            if self.kind is int and not isinstance(part, int):
                raise OptionError(self.name, *(f"{part!r} is not a whole number",) * 2)
            if not self._accepts(part):
                unit = f" {self.unit}" if self.unit else ""
                reasons = self._reason(part, lambda x: x, ""), self._reason(part, self.for_users, unit)
                raise OptionError(self.name, *reasons)

    def _accepts(self, number: float) -> bool:
        bounds = self.option
        if math.isnan(number):
            return bounds.nan
        return (
            (bounds.infinite or math.isfinite(number))
            and (bounds.least is None or number >= bounds.least)
            and (bounds.most is None or number <= bounds.most)
            and (bounds.above is None or number > bounds.above)
            and (bounds.below is None or number < bounds.below)
        )

    def _reason(self, number: float, shown: Any, unit: str) -> str:
        o = self.option
        low, high = o.least if o.above is None else o.above, o.most if o.below is None else o.below
        value = _shown(shown(number))
        if low is None and high is None:
            return f"{value} is not a finite number"
        if low is not None and high is not None and o.above is None and o.below is None:
            return f"{value}{unit} is not in {_shown(shown(low))}..{_shown(shown(high))}{unit}"
        ends = []
        if low is not None:
            least = f"{_shown(shown(low))}{unit if low else ''}"
            ends.append(f"more than {least}" if o.least is None else f"{least} or more")
        if high is not None:
            most = f"{_shown(shown(high))}{unit}"
            ends.append(f"less than {most}" if o.most is None else f"up to {most}")
        return f"{value} is not possible; ask for {', '.join(ends)}"


def _shown(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:.6g}"


class Options:
    """Base of a frozen dataclass whose fields declare themselves: the constructor checks them.

    A class that has rules about several fields together states them in `check_together`; each class in the
    line of
    inheritance has its own, and all are checked, the base's first.

    Raises:
        OptionError: a field does not accept its value.
        ValueError: values do not go together.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        for each in declared(type(self)):
            value = getattr(self, each.name)
            if isinstance(each.kind, type) and issubclass(each.kind, Enum) and value is not None:
                object.__setattr__(self, each.name, _member(each, value))
            elif value is not None:
                each.check(value)
        for kind in reversed(type(self).__mro__):
            if (rules := vars(kind).get("check_together")) is not None:
                rules(self)

    def check_together(self) -> None:
        """Raise ValueError if fields do not go together."""


def _member(each: Declared, value: Any) -> Enum:
    """The member of the field's enumeration that a value is, or is the value of."""
    try:
        found: Enum = each.kind(value)
    except ValueError:
        accepted = ", ".join(str(member.value) for member in each.kind)
        reason = f"{value!r} is not one of {accepted}"
        raise OptionError(each.name, reason, reason) from None
    return found


def declared(kind: type) -> Sequence[Declared]:
    """The fields of a dataclass, in their order, with what they declare, without those of `init=False`."""
    key: Any = kind
    return _declared_fields(key)


@cache
def _declared_fields(kind: Any) -> Sequence[Declared]:
    hints = _hints(kind)
    return tuple(_declared(kind, each, hints[each.name]) for each in fields(kind) if each.init)


def _hints(kind: type) -> dict[str, Any]:
    """The types of the fields; Any for one that is imported for type checkers only, which no user gives."""
    try:
        return get_type_hints(kind, include_extras=True)
    except NameError:
        pass
    hints: dict[str, Any] = {}
    for base in reversed(kind.__mro__):
        for name, hint in vars(base).get("__annotations__", {}).items():
            part = type("", (), {"__annotations__": {name: hint}, "__module__": base.__module__})
            try:
                hints |= get_type_hints(part, include_extras=True)
            except NameError:
                hints[name] = Any
    return hints


def _option_of(kind: type, each: Any) -> Option:
    """What a field declares, or the one of the base class that it is another default for."""
    changes = each.metadata.get(_OF_BASE)
    if changes is None:
        return each.metadata.get(_OPTION, _PLAIN)
    stated = next(
        _option_of(base, found)
        for base in kind.__mro__[1:]
        if is_dataclass(base)
        for found in fields(base)
        if found.name == each.name and found is not each
    )
    above = stated.above if changes["above"] is None else changes["above"]
    return replace(stated, above=above, varies=changes["varies"])


def _declared(kind: type, each: Any, hint: Any) -> Declared:
    stated, optional = without_none(hint)
    option = _option_of(kind, each)
    if (bounds := _bounds_in(stated)) is not None:
        option = replace(option, **{each.name: getattr(bounds, each.name) for each in fields(bounds)})
    if get_origin(stated) is Annotated:
        stated = get_args(stated)[0]
    default = each.default if each.default_factory is MISSING else each.default_factory()
    shown = each.metadata.get(_HELD)
    return Declared(
        name=each.name, kind=stated, optional=optional, default=default, option=option, shown=shown
    )


def _bounds_in(stated: Any) -> Bounds | None:
    """What a type says about its number, or the numbers in its tuple."""
    if get_origin(stated) is tuple:
        return next((_bounds_in(part) for part in get_args(stated) if part is not Ellipsis), None)
    return next((part for part in getattr(stated, "__metadata__", ()) if isinstance(part, Bounds)), None)


def without_none(hint: Any) -> tuple[Any, bool]:
    """A type without the None that it may be, and whether it may be None."""
    if get_origin(hint) not in (Union, types.UnionType) or types.NoneType not in get_args(hint):
        return hint, False
    rest = [kind for kind in get_args(hint) if kind is not types.NoneType]
    joined = rest[0]
    for kind in rest[1:]:
        joined = joined | kind
    return joined, True


def unit_of(name: str) -> str:
    """Unit in which users give a field of this name; "": none, or one without a short form."""
    return UNITS.get(_suffix(name), "")


def name_for_users(name: str) -> str:
    """The name of a field without its unit, with - in place of _."""
    suffix = _suffix(name)
    return (name.removesuffix(f"_{suffix}") if suffix else name).removesuffix("_ne").replace("_", "-")


def _suffix(name: str) -> str:
    """The unit at the end of a name; "": it has none of `UNITS`."""
    if name.endswith(_COMPOUND) and not name.endswith("_m_s2"):
        return ""
    words = name.split("_")
    endings = ("_".join(words[-count:]) for count in (2, 1) if len(words) > count)
    return next((ending for ending in endings if ending in UNITS), "")
