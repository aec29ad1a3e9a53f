"""Messages in, MAVLink 2 frames out, byte for byte what pymavlink packs, at a fraction of its cost."""

import struct
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from operator import attrgetter
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx

from autopilot_bridge.errors import MessageError
from autopilot_bridge.mavlink.definitions import MAVLinkMessage, MessageDefinition, WireField, definition
from autopilot_bridge.mavlink.frame import MAGIC_V2

_pack_head: Final = struct.Struct("<BBHB").pack
_pack_checksum: Final = struct.Struct("<H").pack
_MAX_PAYLOAD: Final = 255
_PACK_ERRORS: Final = (struct.error, OverflowError, TypeError, ValueError, AttributeError)


class FrameEncoder:
    """Packs the messages of one component on one link, and owns the sequence counter.

    Args:
        system_id, component_id: the sender, 1..255.
    """

    def __init__(self, system_id: int, component_id: int) -> None:
        for name, value in (("system_id", system_id), ("component_id", component_id)):
            if not 1 <= value <= 255:
                raise ValueError(f"{name} {value} is not in 1..255")
        self.system_id = system_id
        self.component_id = component_id
        self.sequence = 0
        self._messages: dict[int, tuple[bytes, bytes, Callable[[MAVLinkMessage], bytes]]] = {}

    def encode(self, message: MAVLinkMessage) -> bytes:
        """The frame of a message, with its payload truncated as in MAVLink 2. The message is not changed.

        Raises:
            MessageError: a field does not fit its type on the wire, or an array has the wrong length.
        """
        message_id = type(message).id  # from the class: some messages have a field of that name
        known = self._messages.get(message_id) or self._prepare(message_id)
        try:
            payload = known[2](message)
        except _PACK_ERRORS as error:
            raise MessageError(explain_pack_error(message)) from error
        return self._frame(known, payload)

    def encode_payload(self, message_id: int, payload: bytes) -> bytes:
        """The frame of a packed payload (wire order, zeros at the end kept or not).

        Raises:
            MessageError: the dialect has no such message, or the payload is longer than 255 bytes.
        """
        if len(payload) > _MAX_PAYLOAD:
            raise MessageError(
                f"payload of {len(payload)} bytes for message {message_id}: at most {_MAX_PAYLOAD}"
            )
        return self._frame(self._messages.get(message_id) or self._prepare(message_id), payload)

    def encode_payloads(self, payloads: Iterable[tuple[int, bytes]]) -> list[bytes]:
        """The frames of several packed payloads (message id, bytes of at most 255), in order.

        As `encode_payload` for each, but without its check of the length: for streams, where separate calls
        would cost more time.
        """
        messages, sequence, frames = self._messages, self.sequence, []
        for message_id, payload in payloads:
            sender, extra, _ = messages.get(message_id) or self._prepare(message_id)
            payload = payload.rstrip(b"\0") or b"\0"
            frame = _pack_head(MAGIC_V2, len(payload), 0, sequence) + sender + payload
            sequence = (sequence + 1) & 0xFF
            frames.append(frame + _pack_checksum(mcrf4xx(frame[1:] + extra)))
        self.sequence = sequence
        return frames

    def _prepare(self, message_id: int) -> tuple[bytes, bytes, Callable[[MAVLinkMessage], bytes]]:
        found = definition(message_id)
        sender = bytes((self.system_id, self.component_id)) + message_id.to_bytes(3, "little")
        known = (sender, bytes([found.crc_extra]), payload_packer(message_id))
        self._messages[message_id] = known
        return known

    def _frame(self, known: tuple[bytes, bytes, Callable[[MAVLinkMessage], bytes]], payload: bytes) -> bytes:
        payload = payload.rstrip(b"\0") or b"\0"
        sequence = self.sequence
        self.sequence = (sequence + 1) & 0xFF
        frame = _pack_head(MAGIC_V2, len(payload), 0, sequence) + known[0] + payload
        return frame + _pack_checksum(mcrf4xx(frame[1:] + known[1]))


@cache
def payload_packer(message_id: int) -> Callable[[MAVLinkMessage], bytes]:
    """A function that packs a message of this id into its full-size payload.

    It raises `struct.error` and similar errors for values that do not fit; `FrameEncoder.encode` explains
    them.
    """
    found = definition(message_id)
    fields = found.wire_fields
    pack = struct.Struct("<" + "".join(_packed_format(field) for field in fields)).pack
    attributes = [_attribute(field) for field in fields]
    values_of: Callable[[MAVLinkMessage], tuple[Any, ...]] = attrgetter(*attributes)
    if len(fields) == 1:  # an attrgetter of one name returns no tuple
        only = attrgetter(attributes[0])
        values_of = lambda message: (only(message),)  # noqa: E731

    if not any(field.length and field.code != "s" for field in fields):
        return lambda message: pack(*values_of(message))

    def pack_with_arrays(message: MAVLinkMessage) -> bytes:
        flat: list[Any] = []
        for field, value in zip(fields, values_of(message), strict=True):
            if not field.length or field.code == "s":
                flat.append(value)
                continue
            if len(value) != field.length:
                raise ValueError
            if field.code == "B":
                flat.append(bytes(value))
            else:
                flat.extend(value)
        return pack(*flat)

    return pack_with_arrays


def explain_pack_error(message: MAVLinkMessage) -> str:
    """Which field of a message can't be packed, and why."""
    found: MessageDefinition = definition(type(message).id)
    for field in found.wire_fields:
        value = getattr(message, _attribute(field), None)
        wrong_length = _wrong_length(field, value)
        if wrong_length is not None:
            return f"{found.name}.{field.name} has {wrong_length} elements; accepted: exactly {field.length}"
        try:
            if field.length and field.code != "s":
                struct.pack(f"<{field.length}{field.code}", *value)  # type: ignore[misc]
            else:
                struct.pack(f"<{_packed_format(field)}", value)
        except _PACK_ERRORS as error:
            return f"{found.name}.{field.name} = {value!r} does not fit {field.type}: {error}"
    return f"{found.name} can't be packed: {message}"


def _wrong_length(field: WireField, value: Any) -> int | None:
    if field.length and field.code != "s" and isinstance(value, Sequence) and len(value) != field.length:
        return len(value)
    return None


def _attribute(field: WireField) -> str:
    # pymavlink keeps the bytes of a string besides its decoded text.
    return f"_{field.name}_raw" if field.type == "char" else field.name


def _packed_format(field: WireField) -> str:
    if field.code == "s" or (field.length and field.code == "B"):
        return f"{field.length or 1}s"  # bytes are packed as one value
    return f"{field.length}{field.code}" if field.length else field.code
