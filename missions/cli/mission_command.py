"""Declaration of the command-line options of a mission."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec
    from missions.options import MissionOptions

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
    """

    def __init__(
        self,
        *arguments: Any,
        group: str,
        scope: Scope = Scope.ANY,
        replaces: tuple[str, ...] = (),
        **attributes: Any,
    ) -> None:
        super().__init__(*arguments, **attributes)
        self.group = group
        self.scope = scope
        self.replaces = replaces


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionCommand:
    """A mission on the command line.

    Attributes:
        help: first text of `flightstack fly NAME --help`.
        options: command-line options in addition to those of every mission. The mission accepts no others.
        build: creates the mission's options from the given values. `chosen` names the fields that the user
            specified; common values are passed unchanged.
        world: adds to an embedded world what the mission is for, such as targets and payload.
        fields: the fields of the mission's options that each command-line option sets, when the names differ.
    """

    help: str
    options: tuple[FlightOption, ...]
    build: Callable[[Given, Mapping[str, Any]], "MissionOptions"]
    fields: Mapping[str, tuple[str, ...]]
    world: Callable[[Given, Any, "WorldSpec"], "WorldSpec"] = lambda _given, _options, world: world

    def chosen_fields(self, chosen: frozenset[str]) -> frozenset[str]:
        """Fields of the mission's options that the user specified on the command line."""
        found: set[str] = set()
        for name in chosen:
            found.update(
                self.fields.get(name, (name, f"{name}_m", f"{name}_m_s", f"{name}_s", f"{name}_rad"))
            )
        return frozenset(found)


def option(*declarations: str, **attributes: Any) -> FlightOption:
    """An option of a mission; its default is shown in the help."""
    show_default = attributes.pop("show_default", True)
    return FlightOption(declarations, group=MISSION_GROUP, show_default=show_default, **attributes)
