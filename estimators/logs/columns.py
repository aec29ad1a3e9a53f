"""Payloads as columns: many messages of one kind, decoded together, without an object per message."""

from collections.abc import Mapping
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import MessageDefinition, WireField
from autopilot_bridge.mavlink.frame import HEADER_SIZE_V1, HEADER_SIZE_V2, MAGIC_V2
from flightsim.kernels import kernel

Columns = Mapping[str, NDArray[Any]]
"""Fields by name, in the order on the wire: shape (n,), (n, length) for arrays; strings as bytes ("S")."""

_ALIGNMENT: Final = 64
_ROWS_AT_ONCE: Final = 128


def field_dtype(field: WireField) -> np.dtype[Any]:
    """A field as a numpy type: subarrays for arrays, "S" for strings."""
    if field.code == "s":
        return np.dtype(f"S{field.length or 1}")
    element = np.dtype(f"<{field.code}")
    return np.dtype((element, (field.length,))) if field.length else element


@cache
def _record_dtype(fields: tuple[WireField, ...], size: int) -> np.dtype[np.void]:
    return np.dtype(
        {
            "names": [field.name for field in fields],
            "formats": [field_dtype(field) for field in fields],
            "offsets": [field.offset for field in fields],
            "itemsize": size,
        }
    )


def record_dtype(definition: MessageDefinition) -> np.dtype[np.void]:
    """The full-size payload of a message as a numpy record, packed as on the wire."""
    return _record_dtype(definition.wire_fields, definition.size)


def decode_columns(
    data: NDArray[np.uint8], starts: NDArray[np.int64], definition: MessageDefinition
) -> Columns:
    """Columns of messages of one definition.

    Truncated payloads are filled with zeros, bytes of a newer definition are left out.

    Args:
        data: bytes of the log.
        starts: where the frames begin.
        definition: of the message that they hold.
    """
    count = len(starts)
    fields = definition.wire_fields
    layout = np.empty((len(fields), 3), dtype=np.int64)  # offset in the payload, size, offset in the buffer
    room = 0
    for row, field in zip(layout, fields, strict=True):
        row[:] = field.offset, field.size, room
        room += -(-count * field.size // _ALIGNMENT) * _ALIGNMENT
    buffer = np.empty(room, dtype=np.uint8)
    scratch = np.empty((_ROWS_AT_ONCE, definition.size + 8), dtype=np.uint8)
    _gather(data, starts, definition.size, layout, scratch, buffer)
    columns = {}
    for field, (_, size, at) in zip(fields, layout.tolist(), strict=True):
        raw = buffer[at : at + count * size]
        if field.code == "s":
            columns[field.name] = raw.view(f"S{size}")
        else:
            column = raw.view(f"<{field.code}")
            columns[field.name] = column.reshape(count, field.length) if field.length else column
    return columns


@kernel
def _gather(
    data: NDArray[np.uint8],
    starts: NDArray[np.int64],
    size: int,
    layout: NDArray[np.int64],
    scratch: NDArray[np.uint8],
    buffer: NDArray[np.uint8],
) -> None:
    """Payloads into rows of `scratch`, and from there, while they are in the cache, into the columns."""
    rows = len(scratch)
    first = 0
    while first < len(starts):
        count = min(rows, len(starts) - first)
        for row in range(count):
            start = starts[first + row]
            at = start + (HEADER_SIZE_V2 if data[start] == MAGIC_V2 else HEADER_SIZE_V1)
            length = min(np.int64(data[start + 1]), size)
            for byte in range(length):
                scratch[row, byte] = data[at + byte]
            for byte in range(length, size):
                scratch[row, byte] = 0
        for field in range(len(layout)):
            offset = layout[field, 0]
            width = layout[field, 1]
            to = layout[field, 2] + first * width
            for row in range(count):
                for byte in range(width):
                    buffer[to + byte] = scratch[row, offset + byte]
                to += width
        first += count
