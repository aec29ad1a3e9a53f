"""Declaration of the command-line options of a mission."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from enum import Enum, StrEnum
from typing import TYPE_CHECKING, Any, Final, get_args, get_type_hints

import click

from missions.cli.options import option_of

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec
    from missions.base.options import MissionOptions

Given = Mapping[str, Any]
"""Values of the command line's options by name, with _ in place of -."""


MISSION_GROUP: Final = "The mission's own"
"""Heading of a mission's own options in the help."""


class Scope(StrEnum):
    """The flights on which an option has an effect."""

    ANY = "any"
    EMBEDDED = "embedded"
    CONNECTED = "connected"


class FlightOption(click.Option):
    """An option of `flightstack fly`.

    Args:
        group: heading under which the help lists it.
        scope: the flights it has an effect on; it is refused for the others.
        replaces: names of options that have no effect beside it; they are refused beside it.
        needs: name of an option without which it has no effect, and the values of that option with which it
            has one; without values, every value.
        sets: the field of the mission's options that it sets; None: the one of its name (`option_of`).
    """

    def __init__(
        self,
        *arguments: Any,
        group: str,
        scope: Scope = Scope.ANY,
        replaces: tuple[str, ...] = (),
        needs: tuple[str, tuple[str, ...]] | None = None,
        sets: str | None = None,
        **attributes: Any,
    ) -> None:
        super().__init__(*arguments, **attributes)
        self.group = group
        self.scope = scope
        self.replaces = replaces
        self.needs = needs
        self.sets = sets


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionCommand:
    """A mission on the command line.

    Attributes:
        help: first text of `flightstack fly NAME --help`.
        options: command-line options in addition to those of every mission. The mission accepts no others.
            Those that are not of the embedded world set fields of the mission's options.
        made: module and name of the class of the mission's options.
        values: values of fields that are not simply that of an option.
        world: adds to an embedded world what the mission is for, such as targets and payload.
    """

    help: str
    options: tuple[FlightOption, ...]
    made: tuple[str, str]
    values: Callable[[Given], Mapping[str, Any]] = lambda _given: {}
    world: Callable[[Given, Any, "WorldSpec"], "WorldSpec"] = lambda _given, _options, world: world

    def build(self, given: Given, chosen: frozenset[str], *, vehicles: int) -> "MissionOptions":
        """The mission's options.

        Args:
            given: values of the command line's options. One without a value leaves the field's default.
            chosen: names of the options that the user specified.
            vehicles: size of the team.

        Raises:
            click.UsageError, PlanError: a value is not accepted.
        """
        module, name = self.made
        made = getattr(importlib.import_module(module), name)
        hints = get_type_hints(made)
        values: dict[str, Any] = {}
        specified: set[str] = set()
        for option in self.options:
            if option.scope is Scope.EMBEDDED or option.name is None:
                continue
            own = [f.name for f in fields(made) if option_of(f.name) == option.opts[0]]
            names = own if option.sets is None else [option.sets]
            specified.update(names if option.name in chosen else ())
            value = given[option.name]
            if value is None or value == ():
                continue
            parts = value if len(names) > 1 else (value,) * len(names)
            values |= {name: _typed(hints[name], part) for name, part in zip(names, parts, strict=True)}
        values |= self.values(given)
        options: MissionOptions = made(**values, vehicles=vehicles, given=frozenset(specified))
        return options


def _typed(hint: Any, value: Any) -> Any:
    """A text as a member of an enumeration, if the field has one; another value as it is."""
    kinds = [kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and issubclass(kind, Enum)]
    return kinds[0](value) if kinds else value


def option(*declarations: str, **attributes: Any) -> FlightOption:
    """An option of a mission; its default is shown in the help."""
    show_default = attributes.pop("show_default", True)
    return FlightOption(declarations, group=MISSION_GROUP, show_default=show_default, **attributes)
