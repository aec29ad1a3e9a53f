"""Messages as estimators read them: light named tuples of wire values, the same from a link and from a log.

pymavlink's message objects cost some ten microseconds each; these cost a tenth, and a log makes them from
columns. Values are in the units on the wire (degE7, mG, millimetres, ... of the definition files); the user
of a value converts it.
"""

import keyword
from collections import namedtuple
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any, ClassVar, Final, TypeGuard, TypeVar, overload

from autopilot_bridge.mavlink import DEFINITIONS, Frame, MessageDefinition


class Message(tuple[Any, ...]):
    """A message of any class: a named tuple made by `message_class`.

    It has the fields of the definition (with a trailing underscore if the name is a Python keyword, or
    `name`, which is the message's own) after these. Arrays are tuples; strings end at their first zero. The
    classes with their fields are in `estimators.wire`.

    Attributes:
        name: "ATTITUDE".
        src_system, src_component: ids of the sender.
    """

    __slots__ = ()
    name: ClassVar[str]
    message_id: ClassVar[int]
    _fields: ClassVar[tuple[str, ...]]
    _make: "ClassVar[Callable[[Iterable[object]], Message]]"
    src_system: int
    src_component: int


MessageT = TypeVar("MessageT", bound=Message)
ResultT = TypeVar("ResultT")
OwnerT = TypeVar("OwnerT")
Handlers = dict[str, Callable[[int, Message], ResultT]]

SOURCE_FIELDS: Final = ("src_system", "src_component")
_CLASS_ATTRIBUTES: Final = ("name", "message_id")


def field_name(name: str) -> str:
    """Name of the attribute that holds a field."""
    return f"{name}_" if keyword.iskeyword(name) or name in _CLASS_ATTRIBUTES else name


def message_class(found: MessageDefinition) -> type[Message]:
    """The named tuple of one message definition; always the same class for a definition of the dialect."""
    return _dialect_class(found.message_id) if DEFINITIONS.get(found.message_id) is found else _make(found)


def is_a(message: Message, kind: type[MessageT]) -> TypeGuard[MessageT]:
    """Whether it is a message of this name; a log of another dialect has classes of its own."""
    return message.name == kind.name


@overload
def on(kind: type[MessageT], handle: Callable[[int, MessageT], ResultT]) -> Handlers[ResultT]: ...


@overload
def on(
    kind: type[MessageT], handle: Callable[[int, OwnerT, MessageT], ResultT]
) -> dict[str, Callable[[int, OwnerT, Message], ResultT]]: ...


def on(kind: type[Message], handle: Callable[..., ResultT]) -> dict[str, Callable[..., ResultT]]:
    """The entry of a table of handlers, by name: `handle` takes the messages of this class."""
    return {kind.name: handle}


def read_message(frame: Frame) -> Message:
    """Decode the message in a frame of the parser; never raises."""
    return _reader(frame.message_id)(frame)


def read_as(frame: Frame, kind: type[MessageT]) -> MessageT:
    """The message in a frame whose class the caller knows, because it has selected the frame by its id."""
    message = read_message(frame)
    assert isinstance(message, kind), f"{kind.name} expected, not {message.name}"
    return message


def rows(
    made: type[Message], system_id: int, component_id: int, columns: Iterable[Iterable[Any]]
) -> Iterator[Message]:
    """Make messages from columns, one column per field in the order of the definition's `wire_fields`.

    Args:
        made: class returned by `message_class`.
        columns: Python values (`ndarray.tolist()`), tuples for arrays.
    """
    make = made._make
    for values in zip(*columns, strict=True):
        yield make((system_id, component_id, *values))


def text(raw: bytes) -> str:
    """Decode a string field up to its first zero; bytes that are not ASCII become U+FFFD."""
    return raw.split(b"\0", 1)[0].decode("ascii", "replace")


def _make(found: MessageDefinition) -> type[Message]:
    names = [*SOURCE_FIELDS, *(field_name(field.name) for field in found.wire_fields)]
    fields = namedtuple(found.name, names)  # type: ignore[misc]  # names are known only at run time
    own = {"__slots__": (), "name": found.name, "message_id": found.message_id}
    return type(found.name, (fields, Message), own)


@cache
def _dialect_class(message_id: int) -> type[Message]:
    return _make(DEFINITIONS[message_id])


@cache
def _reader(message_id: int) -> Callable[[Frame], Message]:
    found = DEFINITIONS[message_id]
    make = _dialect_class(message_id)._make
    unpack = found.wire.unpack
    if all(not field.length and field.code != "s" for field in found.wire_fields):
        return lambda frame: make((frame.system_id, frame.component_id, *unpack(frame.payload)))

    def read(frame: Frame) -> Message:
        values = iter(unpack(frame.payload))
        parts: list[object] = [frame.system_id, frame.component_id]
        for field in found.wire_fields:
            if field.code == "s":
                parts.append(text(next(values)))
            elif field.length:
                parts.append(tuple(next(values) for _ in range(field.length)))
            else:
                parts.append(next(values))
        return make(parts)

    return read
