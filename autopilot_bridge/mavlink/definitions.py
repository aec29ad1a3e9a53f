"""Message definitions: the codec's data for each message of the dialect, taken from pymavlink's
classes.

The dialect is `all`: every message of MAVLink's public definitions. Payloads are little-endian with
fields sorted by size, extension fields last (MAVLink guide, "Serialization", field reordering).
"""

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from autopilot_bridge.errors import MessageError
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.missing_messages import MESSAGES

MAVLinkMessage = dialect.MAVLink_message
"""Base of the messages of the dialect: what a message is before its class is known."""

_STRUCT_CODES: Final = {
    "char": "s",
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
    "double": "d",
}


@dataclass(frozen=True, slots=True)
class WireField:
    """One field on the wire.

    Attributes:
        name: field name.
        type: C type as in the definition files ("uint8_t", "float", "char", ...).
        length: elements of the array; 0 for a scalar. A `char` array is one string.
        offset: first byte in the payload.
        size: bytes in the payload.
        code: `struct` code of one element ("s" for strings and single characters).
    """

    name: str
    type: str
    length: int
    offset: int
    size: int
    code: str


@dataclass(frozen=True, slots=True)
class MessageDefinition:
    """One message of the dialect.

    Attributes:
        message_id: 24-bit id.
        name: as in the definition files, "HEARTBEAT".
        crc_extra: the byte that makes the checksum depend on the definition.
        message_class: pymavlink's class, whose constructor takes `field_names` in order; None where it has
            none.
        field_names: in the order of the definition file.
        wire_fields: in the order on the wire.
        wire: struct of the whole payload, one value per array element (strings: one value).
        size: payload size in bytes, extension fields included.
        target_system_offset, target_component_offset: offsets in the payload; None when the message has
            no target.
    """

    message_id: int
    name: str
    crc_extra: int
    message_class: type[MAVLinkMessage] | None
    field_names: tuple[str, ...]
    wire_fields: tuple[WireField, ...]
    wire: struct.Struct
    size: int
    target_system_offset: int | None
    target_component_offset: int | None


def define(
    *,
    message_id: int,
    name: str,
    crc_extra: int,
    field_names: tuple[str, ...],
    wire_fields: Iterable[tuple[str, str, int]],
    message_class: type[MAVLinkMessage] | None = None,
) -> MessageDefinition:
    """The definition of a message, of this dialect or another one.

    Args:
        message_id, name, crc_extra, field_names, message_class: as in `MessageDefinition`.
        wire_fields: in the order on the wire: name, C type, length of the array or 0.
    """
    fields = []
    offset = 0
    for field, kind, length in wire_fields:
        code = _STRUCT_CODES[kind]
        size = struct.calcsize(f"<{length or 1}{code}")
        fields.append(WireField(field, kind, length, offset, size, code))
        offset += size
    offsets = {field.name: field.offset for field in fields}
    return MessageDefinition(
        message_id=message_id,
        name=name,
        crc_extra=crc_extra,
        message_class=message_class,
        field_names=field_names,
        wire_fields=tuple(fields),
        wire=struct.Struct("<" + "".join(_field_format(field) for field in fields)),
        size=offset,
        target_system_offset=offsets.get("target_system"),
        target_component_offset=offsets.get("target_component"),
    )


def define_class(message_class: type[MAVLinkMessage]) -> MessageDefinition:
    """The definition of one of pymavlink's classes, of any dialect."""
    names = tuple(message_class.fieldnames)
    types = dict(zip(names, message_class.fieldtypes, strict=True))
    lengths = zip(message_class.ordered_fieldnames, message_class.array_lengths, strict=True)
    return define(
        message_id=message_class.id,
        name=message_class.msgname,
        crc_extra=message_class.crc_extra,
        field_names=names,
        wire_fields=[(name, types[name], length) for name, length in lengths],
        message_class=message_class,
    )


def _field_format(field: WireField) -> str:
    return f"{field.length or 1}{field.code}" if field.length or field.code == "s" else field.code


DEFINITIONS: Final = MappingProxyType(
    {key: define_class(value) for key, value in {**dialect.mavlink_map, **MESSAGES}.items()}
)
"""Every message of the dialect by id, and those that `missing_messages` adds."""

_BY_NAME: Final = MappingProxyType({item.name: item for item in DEFINITIONS.values()})


def definition(id_or_name: int | str) -> MessageDefinition:
    """The definition of a message by id or by name ("HEARTBEAT", in any case).

    Raises:
        MessageError: the dialect has no such message.
    """
    found = (
        _BY_NAME.get(id_or_name) or _BY_NAME.get(id_or_name.strip().upper())
        if isinstance(id_or_name, str)
        else DEFINITIONS.get(id_or_name)
    )
    if found is None:
        raise MessageError(
            f"no MAVLink message {id_or_name!r} in dialect '{dialect.DIALECT}'; "
            f"accepted: a message name such as 'HEARTBEAT' or an id such as 0"
        )
    return found
