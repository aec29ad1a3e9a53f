"""The MAVLink wire, without I/O: definitions, parser, encoder, decoder.

Messages are pymavlink's own objects of the dialect `all` (`dialect`), made by its classes or by `decode`.
"""

from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.mavlink.decoder import decode
from autopilot_bridge.mavlink.definitions import (
    DEFINITIONS,
    MAVLinkMessage,
    MessageDefinition,
    WireField,
    definition,
)
from autopilot_bridge.mavlink.encoder import FrameEncoder
from autopilot_bridge.mavlink.frame import Frame
from autopilot_bridge.mavlink.parser import FrameParser, ParserCounters, SourceCounters

__all__ = [
    "DEFINITIONS",
    "Frame",
    "FrameEncoder",
    "FrameParser",
    "MAVLinkMessage",
    "MessageDefinition",
    "ParserCounters",
    "SourceCounters",
    "WireField",
    "decode",
    "definition",
    "dialect",
]
