"""Parameters of an autopilot: definitions and the store of their values. Independent of protocol and
flavour.
"""

import math
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from enum import IntEnum
from typing import Final

MAX_NAME_LENGTH: Final = 16  # PARAM_VALUE.param_id


class ParameterType(IntEnum):
    """The members of MAV_PARAM_TYPE that the firmwares use."""

    INT8 = 2
    INT16 = 4
    UINT32 = 5
    INT32 = 6
    REAL32 = 9


INTEGER_LIMITS: Final[Mapping[ParameterType, tuple[int, int]]] = {
    ParameterType.INT8: (-128, 127),
    ParameterType.INT16: (-32768, 32767),
    ParameterType.UINT32: (0, 2**32 - 1),
    ParameterType.INT32: (-(2**31), 2**31 - 1),
}
_FLOAT32: Final = struct.Struct("<f")
_FLOAT32_MAX: Final = 3.4028234663852886e38

ChangeCallback = Callable[[str, float], None]
"""Called with (name, new value) after a parameter changed."""


class ParameterError(ValueError):
    """A parameter has an unknown name or an unacceptable value; the message names both and what is
    accepted.
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterDefinition:
    """One parameter of a firmware.

    Attributes:
        name: up to 16 ASCII characters.
        type: storage type; float parameters are single precision.
        default: initial value, in `unit`.
        minimum, maximum: documented range, in `unit`; None where the firmware documents none.
        used: range of the values that the vehicle acts on, where it differs from the documented one; a stored
            value beyond it acts as its nearer end.
        unit: as the firmware documents it; empty for plain numbers.
        description: one line.
        reboot_required: a change takes effect after the next boot only.
    """

    name: str
    type: ParameterType
    default: float
    minimum: float | None = None
    maximum: float | None = None
    used: tuple[float, float] | None = None
    unit: str = ""
    description: str = ""
    reboot_required: bool = False

    def __post_init__(self) -> None:
        if not 1 <= len(self.name) <= MAX_NAME_LENGTH or not self.name.isascii():
            raise ValueError(f"parameter name {self.name!r} is not 1 to {MAX_NAME_LENGTH} ASCII characters")
        if self.minimum is not None and self.maximum is not None and self.minimum > self.maximum:
            raise ValueError(f"{self.name}: minimum {self.minimum} is above maximum {self.maximum}")
        if self.used is not None and not self.used[0] <= self.used[1]:
            raise ValueError(f"{self.name}: used {self.used[0]} is above {self.used[1]}")
        self.convert(self.default)

    @property
    def is_integer(self) -> bool:
        return self.type is not ParameterType.REAL32

    def accepted(self) -> str:
        """The accepted values in words, for error messages: '0..60 s', 'a whole number in -128..127'."""
        low: float
        high: float
        low, high = INTEGER_LIMITS.get(self.type, (-math.inf, math.inf))
        low = low if self.minimum is None else self.minimum
        high = high if self.maximum is None else self.maximum
        kind = "a whole number" if self.is_integer else "a number"
        if math.isinf(low) and math.isinf(high):
            return f"a finite number{self._unit_suffix}"
        if math.isinf(high):
            return f"{kind} of at least {low:g}{self._unit_suffix}"
        if math.isinf(low):
            return f"{kind} of at most {high:g}{self._unit_suffix}"
        return f"{kind} in {_number(low)}..{_number(high)}{self._unit_suffix}"

    @property
    def _unit_suffix(self) -> str:
        return f" {self.unit}" if self.unit else ""

    def convert(self, value: float) -> float:
        """`value` as this parameter stores it: an int, or a float rounded to single precision.

        Raises:
            ParameterError: not finite, not whole for an integer, or beyond the storage type.
        """
        if not math.isfinite(value):
            raise ParameterError(f"{self.name} = {value}: not finite; accepted is {self.accepted()}")
        if not self.is_integer:
            if abs(value) > _FLOAT32_MAX:
                raise ParameterError(
                    f"{self.name} = {value}: beyond single precision; accepted is {self.accepted()}"
                )
            rounded: float = _FLOAT32.unpack(_FLOAT32.pack(value))[0]
            return rounded
        whole = int(value)
        low, high = INTEGER_LIMITS[self.type]
        if whole != value or not low <= whole <= high:
            raise ParameterError(f"{self.name} = {value}: accepted is {self.accepted()}")
        return whole

    def limited(self, value: float) -> float:
        """`value` within `used`, or within the documented range: a ground station can store anything, and the
        vehicle must stay flyable.
        """
        low, high = self.used or (self.minimum, self.maximum)
        if high is not None and value > high:
            return high
        return low if low is not None and value < low else value

    def check_range(self, value: float) -> None:
        """Raise ParameterError when `value` is outside the documented range."""
        tolerance = 1e-6 * abs(value)  # limits are written in decimal, values are single precision
        if (self.minimum is not None and value < self.minimum - tolerance) or (
            self.maximum is not None and value > self.maximum + tolerance
        ):
            raise ParameterError(f"{self.name} = {value:g}: accepted is {self.accepted()}")


class ParameterStore:
    """The parameter values of one autopilot, in the order the firmware lists them.

    Args:
        definitions: the firmware's table, in listing order.
        overrides: values that replace defaults from the start (vehicle and user settings), range-checked.

    Raises:
        ParameterError: an override with an unknown name or an unacceptable value.
        ValueError: the same name twice in the table.
    """

    def __init__(
        self, definitions: Iterable[ParameterDefinition], overrides: Mapping[str, float] | None = None
    ) -> None:
        self._definitions = tuple(definitions)
        self._index = {definition.name: i for i, definition in enumerate(self._definitions)}
        self._folded = {name.upper(): i for name, i in self._index.items()}
        if len(self._folded) != len(self._definitions):
            names = [definition.name.upper() for definition in self._definitions]
            twice = sorted({name for name in names if names.count(name) > 1})
            raise ValueError(f"parameters defined twice: {', '.join(twice)}")
        self._values = [definition.convert(definition.default) for definition in self._definitions]
        self._subscribers: list[ChangeCallback] = []
        self._fixed: set[str] = set()
        for name, value in (overrides or {}).items():
            self.set(name, value)

    @property
    def count(self) -> int:
        return len(self._definitions)

    @property
    def definitions(self) -> tuple[ParameterDefinition, ...]:
        """All definitions, in listing order."""
        return self._definitions

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def by_index(self, index: int) -> ParameterDefinition:
        """Definition at a listing index, 0 to count - 1; IndexError beyond (negative ones too)."""
        if not 0 <= index < len(self._definitions):
            raise IndexError(f"parameter index {index} is not in 0..{len(self._definitions) - 1}")
        return self._definitions[index]

    def find(self, name: str, *, ignore_case: bool = False) -> ParameterDefinition | None:
        """Definition by name, or None."""
        index = self._folded.get(name.upper()) if ignore_case else self._index.get(name)
        return None if index is None else self._definitions[index]

    def index_of(self, name: str) -> int:
        """Listing index of a parameter; ParameterError when there is none of that name."""
        index = self._index.get(name)
        if index is None:
            raise ParameterError(f"no parameter {name!r}{self._suggestion(name)}")
        return index

    def get(self, name: str) -> float:
        """Value of a parameter: an int for integer types, else a single-precision float.

        Raises:
            ParameterError: unknown name.
        """
        return self._values[self.index_of(name)]

    def limited(self, name: str) -> float:
        """Value of a parameter, within what the vehicle acts on (`ParameterDefinition.limited`).

        Raises:
            ParameterError: unknown name.
        """
        index = self.index_of(name)
        return self._definitions[index].limited(self._values[index])

    def set(self, name: str, value: float, *, check_range: bool = True) -> bool:
        """Change a parameter and notify the subscribers; True when the value is new.

        `check_range=False` takes values outside the documented range, as the firmwares do over MAVLink; the
        storage type still limits them.

        Raises:
            ParameterError: unknown name, unacceptable value, or one that is fixed; nothing is changed.
        """
        index = self.index_of(name)
        definition = self._definitions[index]
        stored = definition.convert(value)
        if check_range:
            definition.check_range(stored)
        if stored == self._values[index]:
            return False
        if name in self._fixed:
            raise ParameterError(
                f"{name} = {value:g}: it is {self._values[index]:g} and can't be changed here"
            )
        self._values[index] = stored
        for callback in tuple(self._subscribers):
            callback(name, stored)
        return True

    def fix(self, name: str, value: float) -> None:
        """Set a parameter to a value that can't be changed from now on.

        Raises:
            ParameterError: unknown name or unacceptable value.
        """
        self.set(name, value)
        self._fixed.add(name)

    def is_fixed(self, name: str) -> bool:
        """Whether a parameter's value is fixed and can't be changed."""
        return name in self._fixed

    def subscribe(self, callback: ChangeCallback) -> Callable[[], None]:
        """Call `callback(name, value)` after every change; returns a function that ends the subscription."""
        self._subscribers.append(callback)

        def unsubscribe() -> None:
            if callback in self._subscribers:
                self._subscribers.remove(callback)

        return unsubscribe

    def as_dict(self) -> dict[str, float]:
        """All values by name, in listing order."""
        return {
            definition.name: value for definition, value in zip(self._definitions, self._values, strict=True)
        }

    def _suggestion(self, name: str) -> str:
        close = get_close_matches(name.upper(), self._index, n=3, cutoff=0.6)
        return f"; did you mean {' or '.join(close)}?" if close else ""


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) and abs(value) < 1e10 else f"{value:g}"
