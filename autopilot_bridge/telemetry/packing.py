"""Packing of field values directly into payload bytes, without a message object.

Streams run at hundreds of messages a second; each produces only a tuple of values in definition order.
Integer fields saturate at their range instead of failing, as in the firmware.
"""

import math
import struct
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any

from autopilot_bridge.mavlink.definitions import MessageDefinition

Values = Sequence[Any]
Pack = Callable[[Values], bytes]

_RANGES = {
    "B": (0, 0xFF),
    "b": (-0x80, 0x7F),
    "H": (0, 0xFFFF),
    "h": (-0x8000, 0x7FFF),
    "I": (0, 0xFFFFFFFF),
    "i": (-0x80000000, 0x7FFFFFFF),
    "Q": (0, 0xFFFFFFFFFFFFFFFF),
    "q": (-0x8000000000000000, 0x7FFFFFFFFFFFFFFF),
}
_FLOAT_MAX = 3.4028234663852886e38


def values_packer(message: MessageDefinition) -> Pack:
    """A function that packs values in the order of `message.field_names` into the payload on the wire.

    Array fields need a sequence of their full length, strings bytes.
    """
    order = [message.field_names.index(field.name) for field in message.wire_fields]
    fields = message.wire_fields
    codes: list[str] = []
    for field in fields:
        codes += [field.code] * (field.length if field.length and field.code != "s" else 1)
    pack = message.wire.pack

    if not any(field.length and field.code != "s" for field in fields):
        reorder = itemgetter(*order) if len(order) > 1 else None

        def pack_scalars(values: Values) -> bytes:
            wire_values = (values[order[0]],) if reorder is None else reorder(values)
            try:
                return pack(*wire_values)
            except (struct.error, OverflowError, TypeError, ValueError):
                return pack(*map(_saturated, wire_values, codes))

        return pack_scalars

    def pack_arrays(values: Values) -> bytes:
        wire_values: list[Any] = []
        for index, field in zip(order, fields, strict=True):
            if field.length and field.code != "s":
                wire_values.extend(values[index])
            else:
                wire_values.append(values[index])
        try:
            return pack(*wire_values)
        except (struct.error, OverflowError, TypeError, ValueError):
            return pack(*map(_saturated, wire_values, codes))

    return pack_arrays


def _saturated(value: Any, code: str) -> Any:
    if code == "s":
        return value
    if code in "fd":
        return max(-_FLOAT_MAX, min(_FLOAT_MAX, value)) if code == "f" and math.isfinite(value) else value
    low, high = _RANGES[code]
    if isinstance(value, float):
        if math.isnan(value):
            return 0
        value = high if value > high else low if value < low else round(value)
    return max(low, min(high, value))
