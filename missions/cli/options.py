"""Types of options, and messages that name fields by the options that set them."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, get_args

import click

from flightsim.foundation.options import UserOption


class FiniteRange(click.FloatRange):
    """A range of numbers that excludes infinity and NaN, which would compare as if it were in every range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a usage error that names it."""
        number: float = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


SLOWEST: Final = 0.001
SPEEDUP: Final = FiniteRange(min=SLOWEST, max=1e6)
"""Simulated seconds per wall second."""

SECONDS: Final = FiniteRange(min=0.0, max=86_400.0)
"""A time of up to a day."""


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

        if not isinstance(value, str):
            return value
        count = self._count
        texts = Conversion(text=True)
        try:
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


def degrees(value: str | float) -> float:
    """An angle in degrees, as radians: a type of options."""
    found = _numbers([str(value)])
    if not found:
        raise click.BadParameter(f"{value} is not an angle; give degrees, such as 90.")
    return math.radians(found[0])


def coordinates(names: str) -> Callable[[str], tuple[float, ...]]:
    """The type of options that give so many coordinates, metres, separated by commas."""

    def convert(text: str) -> tuple[float, ...]:
        found = _numbers(text.split(","))
        if len(found) != names.count(",") + 1:
            raise click.BadParameter(f"{text!r} is not a place; give {names} in metres.")
        return found

    convert.__name__ = names
    return convert


def pair(names: str, separators: str, second: float | None = None) -> Callable[[str], tuple[float, float]]:
    """The type of options that give two numbers, such as 100x80 or 3:4.

    Args:
        names: of the numbers, for the help.
        separators: characters that may separate them.
        second: the second number where one is given; None: the same as the first.
    """

    def convert(text: str) -> tuple[float, float]:
        found = _numbers(re.split(f"[{separators}]", text.lower()))
        if len(found) not in (1, 2):
            raise click.BadParameter(
                f"{text!r} is not one or two numbers without units, such as 3{separators[0]}4."
            )
        return found[0], found[1] if len(found) == 2 else found[0] if second is None else second

    convert.__name__ = names
    return convert


def _numbers(texts: Sequence[str]) -> tuple[float, ...]:
    """The finite numbers that the texts are; none, if one is not."""
    try:
        found = tuple(map(float, texts))
    except ValueError:
        return ()
    return found if all(map(math.isfinite, found)) else ()


PLACE: Final = coordinates("NORTH,EAST")
SIDES: Final = pair("SIDE[,SIDE]", "x,")

_FIELD: Final = re.compile(r"`([a-z]\w*(?:, [a-z]\w*)*)(?:=([\w:-]+))?`")
_UNIT: Final = re.compile(r"_(ne_m|m_s|a_m2|nt|hz|rad|deg|m|s)$")
_NAMES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "arguments": "--arg",
        "clutter_per_scan": "--clutter",
        "compensation_file": "--compensation",
        "false_count": "--false-anomalies",
        "gps_fault=False": "--no-gps-fault",
        "height_m": "--size",
        "map_file": "--map",
        "parameters": "--params",
        "phase_x_rad": "--phase",
        "phase_y_rad": "--phase",
        "settings": "--set",
        "sigma_across_m": "--sigma",
        "sigma_along_m": "--sigma",
        "terrain_file": "--terrain",
        "width_m": "--size",
    }
)
"""Options of fields that are not the field's name without its unit."""


def option_of(field: str) -> str:
    """The option that sets a field of a request or of a mission's options."""
    return _NAMES.get(field, "--" + _UNIT.sub("", field).replace("_", "-"))


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
            shown = [_NAMES.get(f"{names}={value}", f"{option_of(names)} {value}")]
        if known is not None and not known.issuperset(text.split(" ")[0] for text in shown):
            return found.group().strip("`")
        return " or ".join(shown)

    return _FIELD.sub(options, str(message))


def report(message: object) -> None:
    """Print one line about the command on stderr."""
    from autopilot_bridge.mavlink.plain_text import plain_text

    click.echo(f"flightstack: {plain_text(in_options(message))}", err=True)
