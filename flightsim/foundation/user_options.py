"""Declared fields as users see them: which options a class has, their names, defaults and placeholders."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Any, Final, Literal, get_args, get_origin

from flightsim.foundation.options import Declared, Option, Shown, declared, name_for_users


def choices_of(kind: Any) -> Sequence[str]:
    """What users may write for a type that is a choice; (): it is none."""
    if get_origin(kind) is Literal:
        return tuple(map(str, get_args(kind)))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return tuple(map(written, kind))
    return ()


_KINDS: Final[Mapping[Any, str]] = MappingProxyType({int: "integer", float: "number"})


def written(value: Any) -> str:
    """A value as users write it; "" for None, or a tuple with one."""
    if isinstance(value, tuple):
        return "" if None in value else ",".join(map(written, value))
    if value is None or isinstance(value, bool):
        return "" if value is None else str(value).lower()
    if isinstance(value, IntEnum):
        return value.name.lower()
    return (
        str(value.value)
        if isinstance(value, Enum)
        else f"{value:.6g}"
        if isinstance(value, float)
        else str(value)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class UserOption:
    """One option as users see it: a field, several fields of one name, or fields of held options.

    Attributes:
        name: name for users, with - between words.
        path: name of the field that holds the options that have the fields; "": the class itself has them.
        fields: the fields that it sets.
        together: the fields get one part of the value each; otherwise all get the same value.
        default: its default: a tuple of the fields' defaults if `together`.
        option: what it declares.
    """

    name: str
    path: str
    fields: tuple[Declared, ...]
    together: bool
    default: Any
    option: Option

    @property
    def declared(self) -> Declared:
        """The first of its fields."""
        return self.fields[0]

    @property
    def default_text(self) -> str:
        """Its default as users would write it, and what varies of it; "": it has none, or is off."""
        shown = "" if self.default is False else self._written_default()
        return "; ".join(part for part in (shown, self.option.varies) if part)

    def _written_default(self) -> str:
        value = self.declared.for_users(self.default)
        if not isinstance(value, tuple):
            return written(value)
        parts = value[:1] if self.option.lone == "same" and len(set(value)) == 1 else value
        return "" if None in parts else self.option.separators[0].join(map(written, parts))

    @property
    def placeholder(self) -> str:
        """What stands for its value: its own placeholder, its unit, or its kind; "": it has no value."""
        kind = self.declared.kind
        if kind is bool:
            return ""
        if choices := choices_of(kind):
            return "|".join(choices)
        if get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis:
            kind = get_args(kind)[0]
        unit = self.declared.unit.replace(" ", "")
        return self.option.metavar or (unit or _KINDS.get(kind, "TEXT")).upper()


def user_options(kind: type) -> Sequence[UserOption]:
    """The options of a class as users see them, in the order of its fields: those with a help, and what it
    shows of held options.
    """
    return tuple(_user_options(kind))


def _user_options(kind: Any) -> Iterator[UserOption]:
    own = [each for each in declared(kind) if each.option.help]
    named: dict[str, list[Declared]] = {}
    for each in own:
        named.setdefault(each.option.name or name_for_users(each.name), []).append(each)
    begun: set[str] = set()
    for each in declared(kind):
        if each.shown is not None:
            yield from _held_options(each)
            continue
        name = each.option.name or name_for_users(each.name)
        if not each.option.help or name in begun:
            continue
        begun.add(name)
        members = tuple(named[name])
        defaults = tuple(member.default for member in members)
        yield UserOption(
            name=name,
            path="",
            fields=members,
            together=len(members) > 1,
            default=defaults if len(members) > 1 else each.default,
            option=each.option,
        )


def _held_options(holder: Declared) -> Iterator[UserOption]:
    inner = {each.name: each for each in declared(holder.kind)}
    assert holder.shown is not None
    for name, given in holder.shown.items():
        shown = Shown(fields=(given,)) if isinstance(given, str) else given
        members = tuple(inner[each] for each in shown.fields)
        defaults = tuple(getattr(holder.default, each) for each in shown.fields)
        yield UserOption(
            name=name.replace("_", "-"),
            path=holder.name,
            fields=members,
            together=shown.together,
            default=defaults if shown.together else defaults[0],
            option=shown.over(members[0].option) if isinstance(given, Shown) else members[0].option,
        )
