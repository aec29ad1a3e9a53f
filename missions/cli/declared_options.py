"""The options of the command line that fields of dataclasses declare (`flightsim.foundation.options`)."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final, TypeVar, get_args, get_origin

import click

from flightsim.foundation.options import OptionError, declared
from flightsim.foundation.user_options import UserOption, choices_of, user_options, written
from missions.cli.options import DeclaredType, in_options
from missions.errors import PlanError

T = TypeVar("T")

Given = Mapping[str, Any]
"""Values of the command line's options by name, with _ in place of -."""
_NONE: Final = ("none",)  # of an option that may be repeated: not even one of the default

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
        sets: the field of the mission's options that it sets, where it is not a field itself.
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


class DeclaredOption(FlightOption):
    """The option of a field that declares itself (`flightsim.foundation.options`).

    Args:
        user: the option as users see it.
        owner: the class of the field.
        group, scope: as of `FlightOption`.
    """

    def __init__(self, user: UserOption, owner: type, group: str, scope: Scope) -> None:
        kind, declared = user.declared.kind, user.option
        self.user = user
        self.owner = owner
        name = f"no-{user.name}" if user.default is True and not user.name.startswith("no-") else user.name
        default = f" [default: {user.default_text}]" if user.default_text and kind is not bool else ""
        texts = get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis
        valued: dict[str, Any] = {"metavar": user.placeholder, "type": DeclaredType(user)}
        if kind is bool:
            valued = {"is_flag": True}
        elif texts and (choices := choices_of(get_args(kind)[0])):
            valued = {"multiple": True, "type": click.Choice(choices)}
        elif texts:
            valued = {"multiple": True, "metavar": user.placeholder, "type": get_args(kind)[0]}
        elif choices := choices_of(kind):
            valued = {"type": click.Choice(choices), "default": written(user.default) or None}
        super().__init__(
            [f"--{name}"],
            group=group,
            scope=scope,
            needs=declared.needs,
            replaces=declared.replaces,
            help=in_options(f"{user.option.help}{default}"),
            show_default=False,
            **valued,
        )

    def values(self, given: Any) -> dict[str, Any]:
        """The values of its fields that a value of the command line makes."""
        if self.user.declared.kind is bool:
            given = not self.user.default
        if given == _NONE and self.multiple:
            given = ()
        names = [field.name for field in self.user.fields]
        parts = given if self.user.together else (given,) * len(names)
        return dict(zip(names, parts, strict=True))


def declared_options(
    kind: type,
    *,
    only: Collection[str] = (),
    without: Collection[str] = (),
    group: str = MISSION_GROUP,
    scope: Scope = Scope.ANY,
) -> tuple[DeclaredOption, ...]:
    """The options of the fields of a class.

    Args:
        kind: the class, on `Options`.
        only: names of the options; none: all of the class.
        without: names of options that are left out.
        group, scope: as of `FlightOption`.
    """
    users = (
        user for user in user_options(kind) if user.name not in without and (user.name in only or not only)
    )
    return tuple(DeclaredOption(user, kind, group, scope) for user in users)


def chosen_names(context: click.Context) -> frozenset[str]:
    """Names of the options that the user specified on the command line."""
    return frozenset(
        name
        for name in context.params
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
    )


def specified(kind: type[T], context: click.Context | None = None, /, **further: Any) -> T:
    """An instance of a class with the values that the user specified of the running command's options.

    Args:
        kind: a class whose fields are options of the command, or one derived from it.
        context: the command with its values; None: the running one.
        further: values of other fields, by name.

    Raises:
        click.UsageError, PlanError: a value is not accepted.
    """
    context = context or click.get_current_context()
    return made(kind, context.command.get_params(context), context.params, chosen_names(context), further)


def made_of_values(kind: type[T], given: Given) -> T:
    """An instance of a class on `Options` with values of the options of its fields, which need not be those
    of the command line: also those that a study was begun with.

    Raises:
        click.UsageError, PlanError: a value is not accepted.
    """
    # by identity: 0 is a value, though it is equal to False
    chosen = {
        name for name, value in given.items() if value is not None and value is not False and value != ()
    }
    return made(kind, declared_options(kind), given, chosen)


def made(
    kind: type[T],
    options: Iterable[click.Parameter],
    given: Given,
    chosen: Collection[str],
    further: Mapping[str, Any] = MappingProxyType({}),
) -> T:
    """An instance of a class on `Options` with the values that the user specified.

    Args:
        kind: the class.
        options: options of a command, among them those of its fields.
        given: values of the command line's options.
        chosen: names of those that the user specified.
        further: values of other fields, by name.

    Raises:
        click.UsageError, PlanError: a value is not accepted.
    """
    values = dict(further)
    mine = [
        option
        for option in options
        if isinstance(option, DeclaredOption) and option.name in chosen and issubclass(kind, option.owner)
    ]
    held: dict[str, dict[str, Any]] = {}
    for option in mine:
        values_of = held.setdefault(option.user.path, {}) if option.user.path else values
        values_of |= {
            name: v for name, v in option.values(given[option.name or ""]).items() if name not in further
        }
    try:
        defaults = {each.name: each.default for each in declared(kind)}
        for name, changes in held.items():
            values[name] = replace(defaults[name], **changes)
        return kind(**values)
    except ValueError as error:
        raise _in_option(error, mine) from error


def _in_option(error: ValueError, options: Iterable[DeclaredOption]) -> Exception:
    """An error of a field as one that names the option which sets it; another one as it is."""

    cause = error if isinstance(error, OptionError) else error.__cause__
    if isinstance(cause, OptionError):
        for option in options:
            if cause.field in (field.name for field in option.user.fields):
                return click.UsageError(f"{option.opts[0]} {cause.reason_for_users}")
    return error if isinstance(error, PlanError) else click.UsageError(in_options(error, own=True))
