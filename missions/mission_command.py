"""How a mission declares what it takes from the command line."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from missions.options import MissionOptions

Given = Mapping[str, Any]
"""Values of the command line's options by name, with _ for -."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionCommand:
    """A mission on the command line.

    Attributes:
        names: of the missions that take these options.
        help: what `flightstack fly NAME --help` says first.
        options: beside those of every mission.
        build: the mission's options from what was given. `chosen` names the fields of the options that
            were; common values are passed on as they are.
        fields: which fields of the mission's options each command-line option decides on, where the names
            differ.
    """

    names: tuple[str, ...]
    help: str
    options: tuple[click.Option, ...]
    build: Callable[[Given, Mapping[str, Any]], "MissionOptions"]
    fields: Mapping[str, tuple[str, ...]]

    def chosen_fields(self, chosen: frozenset[str]) -> frozenset[str]:
        """Fields of the mission's options that were chosen on the command line."""
        found: set[str] = set()
        for name in chosen:
            found.update(
                self.fields.get(name, (name, f"{name}_m", f"{name}_m_s", f"{name}_s", f"{name}_rad"))
            )
        return frozenset(found)


def option(*declarations: str, **attributes: Any) -> click.Option:
    """An option of a mission, with its default shown."""
    return click.Option(declarations, show_default=attributes.pop("show_default", True), **attributes)
