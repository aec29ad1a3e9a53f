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


@cache
def fields(message: str) -> Callable[..., Any]:
    """Makes the field values of a message, a named tuple, from the fields' names.

    Raises (what is returned):
        TypeError: the message has no field of that name.
    """
    described = definition(message)
    lengths = {field.name: (field.length, field.code) for field in described.wire_fields}
    zeros = [_zero(*lengths[name]) for name in described.field_names]
    return namedtuple(message, described.field_names, defaults=zeros)


def _zero(length: int, code: str) -> Any:
    if code == "s":
        return bytes(length)
    return (0,) * length if length else 0
