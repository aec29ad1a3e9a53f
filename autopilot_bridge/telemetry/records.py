"""NumPy record types with the wire layout of a message's payload, for kernels that fill payloads."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.mavlink.definitions import MessageDefinition
from flightsim.foundation.kernels import kernel

_NUMPY_CODES: Final = {
    "f": "<f4",
    "B": "u1",
    "b": "i1",
    "H": "<u2",
    "h": "<i2",
    "I": "<u4",
    "i": "<i4",
    "Q": "<u8",
}


def record_type(*messages: MessageDefinition, prefixed: bool = False) -> np.dtype[np.void]:
    """A packed record of one message, or of several messages in sequence.

    Args:
        messages: the messages of the fields, in wire order; messages with strings are not supported.
        prefixed: field names have the message's name as a prefix: `attitude__roll`.
    """
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for message in messages:
        for field in message.wire_fields:
            code = _NUMPY_CODES[field.code]
            label = f"{message.name.lower()}__{field.name}" if prefixed else field.name
            fields.append((label, code, (field.length,)) if field.length else (label, code))
    return np.dtype(fields)


@kernel
def whole(value: float, limit: float) -> int:
    """Nearest whole number within +-limit; 0 for not-a-number."""
    if math.isnan(value):
        return 0
    return math.floor(min(limit, max(-limit, value)) + 0.5)
