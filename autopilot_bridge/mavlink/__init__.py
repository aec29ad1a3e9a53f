"""The MAVLink wire, without I/O: definitions, parser, encoder, decoder.

Messages are pymavlink's own objects of the dialect `all` (`dialect`), made by its classes or by `decode`.
"""

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.decoder import decode, decode_as, field_reader
from autopilot_bridge.mavlink.definitions import (
    DEFINITIONS,
    MAVLinkMessage,
    MessageDefinition,
    WireField,
    definition,
)
from autopilot_bridge.mavlink.encoder import FrameEncoder
from autopilot_bridge.mavlink.frame import Frame
from autopilot_bridge.mavlink.intake import Intake
from autopilot_bridge.mavlink.names import command_name, enum_name
from autopilot_bridge.mavlink.packet import Packet
from autopilot_bridge.mavlink.parser import FrameParser, ParserCounters, SourceCounters
from autopilot_bridge.mavlink.signing import LinkSigning, LinkSigningPolicy, SigningKey, SigningState

__all__ = [
    "DEFINITIONS",
    "Frame",
    "FrameEncoder",
    "FrameParser",
    "Intake",
    "LinkSigning",
    "LinkSigningPolicy",
    "MAVLinkMessage",
    "MessageDefinition",
    "Packet",
    "ParserCounters",
    "SigningKey",
    "SigningState",
    "SourceCounters",
    "WireField",
    "command_name",
    "decode",
    "decode_as",
    "definition",
    "dialect",
    "enum_name",
    "field_reader",
]
