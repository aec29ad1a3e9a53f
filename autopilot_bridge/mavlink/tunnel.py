"""Payloads of TUNNEL messages, each declared once: a class whose fields say how they stand on the wire.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class VehicleRange:
        number: Annotated[int, Wire("H", "counts the measurements", modulo=True)]
        range_m: Annotated[float, Wire("f", "slant range, m, not negative", least=0.0)]

    VEHICLE_RANGE = Tunnel(VehicleRange, 0xF519)

The order of the fields is that on the wire, after a version and, where there is one, a kind or a count. All
numbers are little-endian. `message` packs a value; `read` checks type, version, length and bounds, and never
raises; `docs_table` is the table in the docs.
"""

import dataclasses
import math
import re
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar, get_type_hints

from autopilot_bridge.mavlink import dialect

PAYLOAD_SIZE: Final = 128
_VERSION: Final = 1
_TYPES: Final = {
    **{"B": "uint8", "H": "uint16", "I": "uint32", "Q": "uint64", "i": "int32"},
    **{"e": "float16", "f": "float32", "d": "float64"},
}
_UNIT: Final = re.compile(r"_(us|px|deg|(ned_|frd_)?(m|m2|rad|rad2|m_s))$")

ValueT = TypeVar("ValueT")


class _ImpossibleError(Exception):
    """A number that the declaration excludes; it does not leave this module."""


@dataclass(frozen=True, slots=True)
class Wire:
    """How a field stands on the wire: one number, or several of one type. Numbers are finite.

    Attributes:
        code: `struct` code with the number of numbers: "H", "3f"; with "x" for a byte of zero after it.
        text: what it means, with its unit, for the docs.
        name: in the docs; "": as the field, without its unit.
        least, most, above: bounds of each number.
        nan: NaN is accepted.
        modulo: a counter, of which the lowest bits are sent.
        send, receive: conversion of the field's value to what is sent, and back.
    """

    code: str
    text: str
    name: str = ""
    least: float = -math.inf
    most: float = math.inf
    above: float = -math.inf
    nan: bool = False
    modulo: bool = False
    send: Callable[[Any], Any] | None = None
    receive: Callable[[Any], Any] | None = None
    _layout: struct.Struct = dataclasses.field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_layout", struct.Struct(f"<{self.code}"))

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return self._layout.size

    @property
    def type(self) -> str:
        """The type in the docs: "3 x float32"."""
        count, code = re.fullmatch(r"(\d*)(\w)x?", self.code).groups()  # type: ignore[union-attr]
        return f"{count} x {_TYPES[code]}" if count else _TYPES[code]

    def pack(self, value: Any) -> bytes:
        """The bytes of a value."""
        sent = value if self.send is None else self.send(value)
        if self.modulo:
            sent &= (1 << 8 * struct.calcsize(f"<{self.code.rstrip('x')}")) - 1
        return self._layout.pack(*sent) if self.code[0].isdigit() else self._layout.pack(sent)

    def read(self, data: bytes, at: int) -> Any:
        """The value at a place in the bytes."""
        numbers = self._layout.unpack_from(data, at)
        least, most, above = self.least, self.most, self.above
        for number in numbers:  # comparisons with NaN are false; infinite is no bound
            if not (least <= number <= most and above < number < math.inf) and not (
                self.nan and number != number
            ):
                raise _ImpossibleError
        received = numbers if self.code[0].isdigit() else numbers[0]
        return received if self.receive is None else self.receive(received)

    def rows(self, field: str, at: int, step: str = "") -> Iterator[str]:
        """Its row of the table in the docs."""
        yield f"| {at}{step} | {self.type} | {self.name or _UNIT.sub('', field)} | {self.text} |"
        if self.code.endswith("x"):
            yield f"| {at + self.size - 1}{step} | uint8 | | 0 |"


def flag(text: str) -> Wire:
    """A truth in bit 0 of a byte of flags."""
    return Wire("B", f"bit 0: {text}", "flags", send=int, receive=lambda number: bool(number & 1))


class Record(Generic[ValueT]):
    """The fields of a class on the wire.

    Args:
        kind: a dataclass; each field has a `Wire`, `Many` or `Record` in its annotation.
        possible: whether a value is possible whose numbers are.
    """

    def __init__(self, kind: type[ValueT], possible: Callable[[ValueT], bool] | None = None) -> None:
        hints = get_type_hints(kind, include_extras=True)
        names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
        self.fields: dict[str, Any] = {name: hints[name].__metadata__[0] for name in names}
        self.size: int = sum(wire.size for wire in self.fields.values())
        self._kind, self._possible = kind, possible

    def pack(self, value: ValueT) -> bytes:
        """The bytes of a value."""
        return b"".join(wire.pack(getattr(value, name)) for name, wire in self.fields.items())

    def read(self, data: bytes, at: int, count: int = 0) -> ValueT:
        """The value at a place in the bytes; `count` is the number of elements of `Many`."""
        values = {}
        for name, wire in self.fields.items():
            if isinstance(wire, Many):
                values[name] = wire.read(data, at, count)
            else:
                values[name] = wire.read(data, at)
            at += wire.size
        value = self._kind(**values)
        if self._possible is not None and not self._possible(value):
            raise _ImpossibleError
        return value

    def rows(self, _field: str, at: int, step: str = "") -> Iterator[str]:
        """The rows of the table in the docs."""
        for name, wire in self.fields.items():
            yield from wire.rows(name, at, step)
            at += wire.size


@dataclass(frozen=True, slots=True)
class Many:
    """Any number of elements, whose count stands after the version.

    Attributes:
        element: one of them.
        count: what the count means, for the docs.
        capacity: how many are sent, the missing ones as zeros; 0: as many as there are, at the payload's end.
    """

    element: Wire | Record[Any]
    count: str
    capacity: int = 0

    @property
    def size(self) -> int:
        """Bytes on the wire of the elements that are always sent."""
        return self.capacity * self.element.size

    def counted(self, value: Sequence[Any]) -> int:
        """The count that is sent."""
        return min(len(value), self.capacity) if self.capacity else len(value)

    def pack(self, value: Sequence[Any]) -> bytes:
        """The bytes of the elements."""
        packed = b"".join(map(self.element.pack, value[: self.counted(value)]))
        return packed.ljust(self.size, b"\0")

    def read(self, data: bytes, at: int, count: int) -> tuple[Any, ...]:
        """The elements from a place in the bytes on."""
        if count > self.capacity > 0 or len(data) < at + count * self.element.size:
            raise _ImpossibleError
        return tuple(self.element.read(data, at + k * self.element.size) for k in range(count))

    def rows(self, field: str, at: int, _step: str = "") -> Iterator[str]:
        """The rows of the table in the docs."""
        yield from self.element.rows(field, at, f" + {self.element.size} i")


class Tunnel(Generic[ValueT]):
    """One payload of TUNNEL messages.

    Args:
        kind: class of its values, as of `Record`.
        payload_type: from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE).
        subtype: number after the version, and its text, where payloads of one type have several kinds.
        possible: as of `Record`.
    """

    def __init__(
        self,
        kind: type[ValueT],
        payload_type: int,
        *,
        subtype: tuple[int, str] | None = None,
        possible: Callable[[ValueT], bool] | None = None,
    ) -> None:
        self.payload_type = payload_type
        self._record = Record(kind, possible)
        self._subtype = subtype
        many = [(name, wire) for name, wire in self._record.fields.items() if isinstance(wire, Many)]
        self._many: tuple[str, Many] | None = many[0] if many else None
        self._start = 1 if subtype is None and self._many is None else 2

    @property
    def room(self) -> int:
        """How many elements fit into a message."""
        free = PAYLOAD_SIZE - self._start - self._record.size
        return 0 if self._many is None else free // self._many[1].element.size

    def message(self, value: ValueT, *, target_system: int = 0) -> dialect.MAVLink_tunnel_message:
        """The message of a value, to the components of one system, or of all (0)."""
        head = [_VERSION] if self._subtype is None else [_VERSION, self._subtype[0]]
        if self._many is not None:
            name, many = self._many
            head.append(many.counted(getattr(value, name)))
        payload = bytes(head) + self._record.pack(value)
        return dialect.MAVLink_tunnel_message(
            target_system, 0, self.payload_type, len(payload), list(payload.ljust(PAYLOAD_SIZE, b"\0"))
        )

    def read(self, payload_type: int, length: int, payload: Sequence[int]) -> ValueT | None:
        """The content of a message; None for other payloads and for malformed ones. It never raises.

        Args:
            payload_type, length, payload: fields of the message.
        """
        if payload_type != self.payload_type or not self._start + self._record.size <= length <= len(payload):
            return None
        data = bytes(payload[:length])
        if data[0] != _VERSION or (self._subtype is not None and data[1] != self._subtype[0]):
            return None
        try:
            return self._record.read(data, self._start, data[1])
        except _ImpossibleError:
            return None

    def rows(self) -> Iterator[str]:
        """The rows of the table in the docs."""
        yield f"| 0 | uint8 | version | {_VERSION} |"
        if self._subtype is not None:
            yield f"| 1 | uint8 | kind | {self._subtype[0]}: {self._subtype[1]} |"
        if self._many is not None:
            yield f"| 1 | uint8 | count | {self._many[1].count} |"
        yield from self._record.rows("", self._start)


def docs_table(payload: Tunnel[Any] | Record[Any]) -> str:
    """The table of a payload, or of a record in payloads, in docs/mavlink."""
    rows = payload.rows() if isinstance(payload, Tunnel) else payload.rows("", 0)
    return "\n".join(["| bytes | type | field | |", "|---|---|---|---|", *rows])
