"""Conversion of frames to pymavlink's message objects."""

import struct
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

from autopilot_bridge.errors import MessageError
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.definitions import MAVLinkMessage, definition
from autopilot_bridge.mavlink.frame import CHECKSUM_SIZE, HEADER_SIZE_V1, HEADER_SIZE_V2, Frame

MessageT = TypeVar("MessageT", bound=MAVLinkMessage)


def decode(frame: Frame) -> MAVLinkMessage:
    """The message in a frame, as pymavlink would return it: fields as attributes, with its header.

    Strings end at their first zero; bytes that are not ASCII become U+FFFD. Never raises for a frame of
    the parser.
    """
    message = _constructor(frame.message_id)(frame.payload)
    raw = frame.raw
    length = raw[1]
    if frame.version == 2:
        start = HEADER_SIZE_V2
        message._header = dialect.MAVLink_header(
            frame.message_id, raw[2], raw[3], length, frame.sequence, frame.system_id, frame.component_id
        )
    else:
        start = HEADER_SIZE_V1
        message._header = dialect.MAVLink_header(
            frame.message_id, 0, 0, length, frame.sequence, frame.system_id, frame.component_id
        )
    end = start + length
    message._msgbuf = raw
    message._payload = raw[start:end]
    message._crc = int.from_bytes(raw[end : end + CHECKSUM_SIZE], "little")
    return message


def decode_as(frame: Frame, kind: type[MessageT]) -> MessageT:
    """The message in a frame whose class the caller knows, because it has selected the frame by its id."""
    message = decode(frame)
    assert isinstance(message, kind), f"{kind.msgname} expected, not {message.get_type()}"
    return message


@cache
def field_reader(name: str, *fields: str) -> Callable[[Frame], tuple[Any, ...]]:
    """A function that reads some scalar fields of the frames of one message, without its other fields.

    Args:
        name: of the message.
        fields: names, in the order on the wire.

    Raises:
        MessageError: the message has no such field, or has them in another order.
    """
    found = definition(name)
    on_the_wire = [field.name for field in found.wire_fields if field.name in fields]
    if on_the_wire != list(fields):
        raise MessageError(f"{name} has the fields {on_the_wire} in this order, not {list(fields)}")
    codes, at = "<", 0
    for field in found.wire_fields:
        if field.name in fields:
            codes += f"{field.offset - at}x{field.code}"
            at = field.offset + field.size
    unpack_from = struct.Struct(codes).unpack_from

    def read(frame: Frame) -> tuple[Any, ...]:
        raw = frame.raw
        if raw[1] >= at and frame.version == 2:  # no field is truncated
            return unpack_from(raw, HEADER_SIZE_V2)
        return unpack_from(frame.payload)

    return read


@cache
def _constructor(message_id: int) -> Callable[[bytes], MAVLinkMessage]:
    """A function that makes the message object from its full-size payload."""
    found = definition(message_id)
    message_class = found.message_class
    assert message_class is not None, f"{found.name} is of another dialect"
    make: Callable[..., MAVLinkMessage] = message_class
    unpack = found.wire.unpack
    positions: dict[str, slice | int] = {}
    strings = set()
    at = 0
    for field in found.wire_fields:
        if field.code == "s":
            strings.add(field.name)
        is_array = field.length and field.code != "s"
        positions[field.name] = slice(at, at + field.length) if is_array else at
        at += field.length if is_array else 1
    plan = [(positions[name], name in strings) for name in found.field_names]
    if not any(isinstance(position, slice) or is_string for position, is_string in plan):
        template = vars(make(*[0] * len(plan)))
        names = [field.name for field in found.wire_fields]

        def construct_scalars(payload: bytes) -> MAVLinkMessage:
            message = message_class.__new__(message_class)
            attributes = vars(message)  # without the constructor, which takes three times as long
            attributes.update(template)
            attributes.update(zip(names, unpack(payload), strict=True))
            return message

        return construct_scalars

    def construct(payload: bytes) -> MAVLinkMessage:
        values = unpack(payload)
        arguments: list[Any] = []
        for position, is_string in plan:
            if isinstance(position, slice):
                arguments.append(list(values[position]))
            elif is_string:
                arguments.append(values[position].rstrip(b"\0"))
            else:
                arguments.append(values[position])
        return make(*arguments)

    return construct
