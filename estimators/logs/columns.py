"""Payloads as columns: many messages of one kind are decoded together, without an object per message."""

from collections.abc import Mapping
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import MessageDefinition, WireField
from autopilot_bridge.mavlink.frame import HEADER_SIZE_V1, HEADER_SIZE_V2, MAGIC_V2
from flightsim.foundation.kernels import kernel

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
    data: NDArray[np.uint8], starts: NDArray[np.uint32] | NDArray[np.int64], definition: MessageDefinition
) -> Columns:
    """Decode messages of one definition into columns.

    Truncated payloads are filled with zeros; additional bytes of a newer definition are ignored.

    Args:
        data: bytes of the log.
        starts: positions at which the frames begin.
        definition: definition of their message.
    """
    count = len(starts)
    fields = definition.wire_fields
    layout = np.empty((len(fields), 3), dtype=np.int64)  # offset in the payload, size, offset in the buffer
    room = 0
    for row, field in zip(layout, fields, strict=True):
        row[:] = field.offset, field.size, room
        room += -(-count * field.size // _ALIGNMENT) * _ALIGNMENT
    buffer = np.empty(room, dtype=np.uint8)
    scratch = np.empty(_ROWS_AT_ONCE * definition.size, dtype=np.uint8)
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


def decode_records(
    data: NDArray[np.uint8], starts: NDArray[np.uint32] | NDArray[np.int64], definition: MessageDefinition
) -> NDArray[np.void]:
    """Decode messages of one definition into records (`record_dtype`); arguments as of `decode_columns`."""
    size = definition.size
    buffer = np.empty(len(starts) * size, dtype=np.uint8)
    scratch = np.empty(_ROWS_AT_ONCE * size, dtype=np.uint8)
    _gather(data, starts, size, np.array([[0, size, 0]]), scratch, buffer)
    return buffer.view(record_dtype(definition))


@kernel
def _gather(
    data: NDArray[np.uint8],
    starts: NDArray[np.uint32] | NDArray[np.int64],
    size: int,
    layout: NDArray[np.int64],
    scratch: NDArray[np.uint8],
    buffer: NDArray[np.uint8],
) -> None:
    """Copy payloads to rows of `scratch` and, while they are in the cache, from there to the columns."""
    stride = size
    rows = _ROWS_AT_ONCE
    first = 0
    while first < len(starts):
        count = min(rows, len(starts) - first)
        for row in range(count):
            start = starts[first + row]
            at = start + (HEADER_SIZE_V2 if data[start] == MAGIC_V2 else HEADER_SIZE_V1)
            length = np.int64(min(data[start + 1], size))
            byte = 0
            while byte + 8 <= length:
                _copy_8(data, at + byte, scratch, row * stride + byte)
                byte += 8
            while byte < length:
                scratch[row * stride + byte] = data[at + byte]
                byte += 1
            while byte < size:
                scratch[row * stride + byte] = 0
                byte += 1
        for field in range(len(layout)):
            offset = layout[field, 0]
            width = layout[field, 1]
            to = layout[field, 2] + first * width
            if width == 4:
                for row in range(count):
                    _copy_4(scratch, row * stride + offset, buffer, to + 4 * row)
            elif width == 2:
                for row in range(count):
                    _copy_2(scratch, row * stride + offset, buffer, to + 2 * row)
            elif width == 8:
                for row in range(count):
                    _copy_8(scratch, row * stride + offset, buffer, to + 8 * row)
            else:
                for row in range(count):
                    for byte in range(width):
                        buffer[to + row * width + byte] = scratch[row * stride + offset + byte]
        first += count


# Loads come before stores: only then can the compiler merge them into one load and one store.
@kernel
def _copy_2(source: NDArray[np.uint8], at: int, target: NDArray[np.uint8], to: int) -> None:
    i = np.uint64(at)
    j = np.uint64(to)
    one = np.uint64(1)
    a = source[i]
    b = source[i + one]
    target[j] = a
    target[j + one] = b


@kernel
def _copy_4(source: NDArray[np.uint8], at: int, target: NDArray[np.uint8], to: int) -> None:
    i = np.uint64(at)
    j = np.uint64(to)
    a = source[i]
    b = source[i + np.uint64(1)]
    c = source[i + np.uint64(2)]
    d = source[i + np.uint64(3)]
    target[j] = a
    target[j + np.uint64(1)] = b
    target[j + np.uint64(2)] = c
    target[j + np.uint64(3)] = d


@kernel
def _copy_8(source: NDArray[np.uint8], at: int, target: NDArray[np.uint8], to: int) -> None:
    i = np.uint64(at)
    j = np.uint64(to)
    a = source[i]
    b = source[i + np.uint64(1)]
    c = source[i + np.uint64(2)]
    d = source[i + np.uint64(3)]
    e = source[i + np.uint64(4)]
    f = source[i + np.uint64(5)]
    g = source[i + np.uint64(6)]
    h = source[i + np.uint64(7)]
    target[j] = a
    target[j + np.uint64(1)] = b
    target[j + np.uint64(2)] = c
    target[j + np.uint64(3)] = d
    target[j + np.uint64(4)] = e
    target[j + np.uint64(5)] = f
    target[j + np.uint64(6)] = g
    target[j + np.uint64(7)] = h
