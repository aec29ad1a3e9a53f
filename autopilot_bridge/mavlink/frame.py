"""One verified MAVLink frame, as it was on the wire."""

from collections.abc import Callable
from functools import partial
from typing import Any, Final, NamedTuple

from autopilot_bridge.mavlink.definitions import DEFINITIONS, MessageDefinition

MAGIC_V1: Final = 0xFE
MAGIC_V2: Final = 0xFD
HEADER_SIZE_V1: Final = 6
HEADER_SIZE_V2: Final = 10
CHECKSUM_SIZE: Final = 2
OVERHEAD_V1: Final = HEADER_SIZE_V1 + CHECKSUM_SIZE
OVERHEAD_V2: Final = HEADER_SIZE_V2 + CHECKSUM_SIZE
SIGNATURE_SIZE: Final = 13
INCOMPAT_SIGNED: Final = 0x01


class Frame(NamedTuple):
    """A frame with a correct checksum and a message of the dialect (MAVLink guide, "Serialization").

    Attributes:
        raw: all bytes of the frame, magic to checksum (or signature).
        message_id: id of the message.
        system_id, component_id: the sender.
        sequence: the sender's frame counter, 0..255.
        version: 1 or 2.
        signed: the frame carries a signature (which the parser does not verify; `LinkSigning.admit` does).
    """

    raw: bytes
    message_id: int
    system_id: int
    component_id: int
    sequence: int
    version: int = 2
    signed: bool = False

    @classmethod
    def of(cls, raw: bytes) -> "Frame":
        """The frame in bytes that an encoder has made, or that a parser has checked before."""
        if raw[0] == MAGIC_V2:
            message_id = raw[7] | raw[8] << 8 | raw[9] << 16
            return cls(raw, message_id, raw[5], raw[6], raw[4], 2, bool(raw[2] & INCOMPAT_SIGNED))
        return cls(raw, raw[5], raw[3], raw[4], raw[2], 1)

    def __repr__(self) -> str:
        return (
            f"Frame({self.definition.name}, from {self.system_id}/{self.component_id}, "
            f"sequence {self.sequence}, {len(self.raw)} bytes)"
        )

    @property
    def definition(self) -> MessageDefinition:
        """Definition of the message."""
        return DEFINITIONS[self.message_id]

    @property
    def payload(self) -> bytes:
        """Payload at its full size: truncated zeros restored, bytes of a newer definition cut off."""
        raw = self.raw
        start = HEADER_SIZE_V2 if self.version == 2 else HEADER_SIZE_V1
        size = DEFINITIONS[self.message_id].size
        length = raw[1]
        if length >= size:
            return raw[start : start + size]
        return raw[start : start + length].ljust(size, b"\0")

    @property
    def target_system(self) -> int:
        """System the message is addressed to; 0 for all of them and for messages without a target."""
        return self._target(DEFINITIONS[self.message_id].target_system_offset)

    @property
    def target_component(self) -> int:
        """Component the message is addressed to; 0 for all of them and for messages without a target."""
        return self._target(DEFINITIONS[self.message_id].target_component_offset)

    def _target(self, offset: int | None) -> int:
        raw = self.raw
        if offset is None or offset >= raw[1]:  # a truncated target is zero
            return 0
        return raw[(HEADER_SIZE_V2 if self.version == 2 else HEADER_SIZE_V1) + offset]


new_frame: Final[Callable[[tuple[Any, ...]], Frame]] = partial(tuple.__new__, Frame)
"""A frame from the tuple of all its attributes, in half the time of the constructor."""
