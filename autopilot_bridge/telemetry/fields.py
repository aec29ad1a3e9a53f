"""Field values of a streamed message by their names, in the order of its definition.

    GPS_RAW_INT = fields("GPS_RAW_INT")
    values = GPS_RAW_INT(time_usec=1_000_000, fix_type=3)

What is not named is zero. The values are a tuple, which `packing` packs as it is.
"""

from collections import namedtuple
from collections.abc import Callable
from functools import cache
from typing import Any

from autopilot_bridge.mavlink.definitions import definition


class FieldValues(tuple[object, ...]):
    """A named tuple of the fields of a message, made by `fields`."""

    __slots__ = ()
    _replace: Callable[..., "FieldValues"]


@cache
def fields(message: str) -> Callable[..., FieldValues]:
    """Makes the field values of a message, a named tuple, from the fields' names.

    Raises (what is returned):
        TypeError: the message has no field of that name.
    """
    described = definition(message)
    lengths = {field.name: (field.length, field.code) for field in described.wire_fields}
    zeros = [_zero(*lengths[name]) for name in described.field_names]
    values = namedtuple(message, described.field_names, defaults=zeros)  # type: ignore[misc]
    return type(message, (values, FieldValues), {"__slots__": ()})


def _zero(length: int, code: str) -> Any:
    if code == "s":
        return bytes(length)
    return (0,) * length if length else 0
