"""Declaration of the command-line options of a mission."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from flightsim.foundation.options import Options
from missions.cli.declared_options import (
    MISSION_GROUP,
    DeclaredOption,
    FlightOption,
    Given,
    Scope,
    declared_options,
    made,
)
from missions.cli.later import named

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec
    from missions.base.options import MissionOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionCommand:
    """A mission on the command line.

    Attributes:
        help: first text of `flightstack fly NAME --help`.
        made: module and name of the class of the mission's options. Its fields are the mission's command-line
            options in addition to those of every mission.
        without: names of options that the mission does not have, of its class.
        further: options that are not fields of the class.
        world: module and name of a function that adds to an embedded world what the mission is for, such as
            targets and payload; None: nothing.
        part: module and name of a class whose fields say what that is; None: the mission's options do.
        values: values of fields that follow from several options.
    """

    help: str
    made: tuple[str, str]
    without: tuple[str, ...] = ()
    further: tuple[FlightOption, ...] = ()
    world: tuple[str, str] | None = None
    part: tuple[str, str] | None = None
    values: Callable[[Given, Collection[str]], Mapping[str, Any]] = lambda _given, _chosen: {}

    @property
    def options_class(self) -> type[Options]:
        """The class of the mission's options."""
        return named(self.made)

    @property
    def part_class(self) -> type[Options]:
        """The class of what is true in the embedded world; it must have one."""
        assert self.part is not None
        return named(self.part)

    @property
    def options(self) -> tuple[FlightOption, ...]:
        """The mission's own options. The mission accepts no others beside those of every mission."""
        return _options_of(self)

    def build(self, given: Given, chosen: frozenset[str], *, vehicles: int) -> "MissionOptions":
        """The mission's options.

        Args:
            given: values of the command line's options.
            chosen: names of the options that the user specified.
            vehicles: size of the team.

        Raises:
            click.UsageError, PlanError: a value is not accepted.
        """
        kind = named(self.made)
        own = declared_options(kind, without=self.without)
        values = dict(self.values(given, chosen))
        mine = [option for option in (*own, *self.further) if option.name in chosen]
        fields = (
            field.name
            for option in mine
            if isinstance(option, DeclaredOption)
            for field in option.user.fields
        )
        specified = frozenset(fields) | {option.sets for option in mine if option.sets is not None}
        values |= {"vehicles": vehicles, "given": specified}
        options: MissionOptions = made(kind, own, given, chosen, values)
        return options

    def with_world(
        self, given: Given, chosen: frozenset[str], options: "MissionOptions", world: "WorldSpec"
    ) -> "WorldSpec":
        """An embedded world with what the mission is for.

        Raises:
            click.UsageError, PlanError: a value is not accepted.
        """
        if self.world is None:
            return world
        parts = []
        if self.part is not None:
            kind = named(self.part)
            parts = [made(kind, declared_options(kind, scope=Scope.EMBEDDED), given, chosen)]
        found: WorldSpec = named(self.world)(world, options, *parts)
        return found


@cache
def _options_of(command: MissionCommand) -> tuple[FlightOption, ...]:
    own = declared_options(named(command.made), without=command.without)
    world = () if command.part is None else declared_options(named(command.part), scope=Scope.EMBEDDED)
    return (*own, *command.further, *world)


def option(*declarations: str, **attributes: Any) -> FlightOption:
    """An option of a mission that is not a field of its options."""
    return FlightOption(declarations, group=MISSION_GROUP, **attributes)
