"""Types of options, and messages that name fields by the options that set them."""

import math
import re
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, get_args

import click

from flightsim.foundation.options import name_for_users
from flightsim.foundation.plain_text import plain_text
from flightsim.foundation.user_options import UserOption, user_options
from missions.cli.later import named
from missions.cli.option_classes import OPTIONS, PARTS, RUNS

FIRMWARE_HELP: Final = (
    "Real firmware that flies the vehicles in lockstep with the world: px4=FOLDER (with bin/px4 and etc) or "
    "ardupilot=FILE. Without a build it is FLIGHTSTACK_PX4, FLIGHTSTACK_ARDUCOPTER or FLIGHTSTACK_ARDUPLANE. "
    "[default: the emulated autopilot]"
)
WORLD_HELP: Final = (
    "Description of the world (TOML, docs/world.md). An option that is also given overrides the file's value."
)
STRICT_HELP: Final = "Names in the --params file that the vehicle does not have are an error, not left out."


if TYPE_CHECKING:
    from flightsim.foundation.conversion import Conversion

if TYPE_CHECKING:  # click makes it generic in its stubs, and not everywhere when it runs
    _ParamType = click.ParamType[Any]
else:
    _ParamType = click.ParamType


class DeclaredType(_ParamType):
    """The type of the option of a field that declares itself: its values are those of the field.

    Args:
        user: the option as users see it.
    """

    def __init__(self, user: UserOption) -> None:
        self.name = user.placeholder or "flag"
        self._user = user

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value, or a usage error that names it."""
        from flightsim.foundation.conversion import Conversion, Refused

        count = self._count
        texts = Conversion(text=True)
        try:
            if not isinstance(value, str):  # of a study's folder, whose values have types
                return value if count > 1 else Conversion(text=False).value(self._user.declared.kind, value)
            if count == 1:
                found = self._in_radians(self._one(texts, value))
                if found is None:
                    raise Refused(value, "an angle")
                return found
            parts = re.split(f"[{self._user.option.separators}]", value.lower())
            numbers = [self._in_radians(texts.value(float, part)) for part in parts]
            if not all(map(math.isfinite, numbers)):
                raise Refused(value, "finite numbers")
        except Refused as error:
            self.fail(self._refusal(value, str(error)), param, ctx)
        if len(numbers) == 1 and count > 1 and self._user.option.lone is not None:
            lone = numbers[0] if self._user.option.lone == "same" else float(self._user.option.lone)
            numbers += [lone] * (count - 1)
        if len(numbers) != count:
            self.fail(self._refusal(value, ""), param, ctx)
        return tuple(numbers)

    @property
    def _count(self) -> int:
        """How many numbers it takes."""
        kind = self._user.declared.kind
        return len(self._user.fields) if self._user.together else len(get_args(kind) or (kind,))

    def _one(self, texts: "Conversion", value: str) -> Any:
        kind = self._user.declared.kind
        if kind is float and value.strip().lower() == "nan":
            return math.nan  # the field refuses it, and says what it accepts
        return texts.value(kind, value)

    def _in_radians(self, value: Any) -> Any:
        if not self._user.declared.in_degrees:
            return value
        return math.radians(value) if math.isfinite(value) else None

    def _refusal(self, value: str, reason: str) -> str:
        declared = self._user.declared
        if self._count == 1:
            return (
                f"{value} is not an angle; give degrees, such as 90." if declared.in_degrees else f"{reason}."
            )
        if self._user.option.lone is None:
            return f"{value!r} is not a place; give {self._user.placeholder} in metres."
        return (
            f"{value!r} is not one or two numbers without units, such as 3{self._user.option.separators[0]}4."
        )


_FIELD: Final = re.compile(r"`([a-z]\w*(?:, [a-z]\w*)*)(?:=([\w:-]+))?`")
_OF_REQUESTS: Final[Mapping[str, str]] = MappingProxyType(
    {"arguments": "arg", "parameters": "params", "seed": "seed", "settings": "set"}
)
"""Names for users of what is no field that declares itself."""


@cache
def _names() -> Mapping[str, str]:
    """Names for users of the fields of all missions and of their worlds."""
    classes = [named(place) for place in (*RUNS, *PARTS.values(), *reversed(list(OPTIONS.values())))]
    names: dict[str, str] = {}
    for user in (user for kind in classes for user in user_options(kind)):
        names |= {field.name: user.name for field in user.fields}
    return MappingProxyType({**names, **_OF_REQUESTS})


def option_of(field: str) -> str:
    """The option that sets a field of a request or of a mission's options."""
    return f"--{_names().get(field, name_for_users(field))}"


def in_options(message: object, *, own: bool = False) -> str:
    """A message with the options in place of the fields that it names.

    Errors name fields in backquotes: `` `altitude_m` ``, with a value: `` `via=setpoints` ``, or several
    fields that one option sets: `` `width_m, height_m` ``.

    Args:
        message: the message.
        own: only with options that the running command has; other fields are parameters of an estimator,
            which `--set` names as the message does.
    """
    context = click.get_current_context() if own else None
    known = (
        None if context is None else {name for p in context.command.get_params(context) for name in p.opts}
    )

    def options(found: re.Match[str]) -> str:
        names, value = found.groups()
        if value is None:
            shown = list(dict.fromkeys(map(option_of, names.split(", "))))
        else:
            shown = [f"--no-{name_for_users(names)}" if value == "False" else f"{option_of(names)} {value}"]
        if known is not None and not known.issuperset(text.split(" ")[0] for text in shown):
            return found.group().strip("`")
        return " or ".join(shown)

    return _FIELD.sub(options, str(message))


def report(message: object) -> None:
    """Print one line about the command on stderr."""
    click.echo(f"flightstack: {plain_text(in_options(message))}", err=True)
