"""Messages of MAVLink's `common` set that PyPI's pymavlink leaves out: state and version of a link, times to
targets, component metadata and events.

Classes of the same shape as pymavlink's, from the definitions in common.xml, so that they are encoded and
decoded like all others.

Source: mavlink.io/en/messages/common.html, messages 8, 300, 380, 397 and 410 to 413; checksum seeds by the
rule of the MAVLink guide ("Serialization", CRC_EXTRA).
"""

import struct
from typing import Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as dialect

_CODES: Final = {
    "uint8_t": "B",
    "char": "s",
    "uint16_t": "H",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
}

Field = tuple[str, str, int]
"""Type, name, length of the array or 0."""


def crc_extra(name: str, ordered: list[Field]) -> int:
    """The byte that makes a message's checksum depend on its definition (fields without extensions)."""
    text = f"{name} "
    data = text.encode()
    for kind, field, length in ordered:
        data += f"{kind} {field} ".encode() + (bytes((length,)) if length else b"")
    crc = int(mcrf4xx(data))
    return (crc & 0xFF) ^ (crc >> 8)


def _code(kind: str, length: int) -> str:
    """`struct` code of a field."""
    return f"{length}{_CODES[kind]}" if length else _CODES[kind]


def _message_class(message_id: int, name: str, fields: list[Field]) -> type[dialect.MAVLink_message]:
    """A class like pymavlink's, whose constructor takes the fields in order."""
    ordered = sorted(
        fields, key=lambda field: -struct.calcsize(_CODES[field[0]])
    )  # stable: the order on the wire
    names = [field for _, field, _ in fields]
    wire = struct.Struct("<" + "".join(_code(kind, length) for kind, _, length in ordered))
    strings = {field for kind, field, _ in fields if kind == "char"}

    def construct(self: dialect.MAVLink_message, *values: object) -> None:
        if len(values) != len(names):
            raise TypeError(f"{name} takes {len(names)} fields: {', '.join(names)}")
        dialect.MAVLink_message.__init__(self, message_id, name)
        self._fieldnames = names
        for field, value in zip(names, values, strict=True):
            if field in strings and isinstance(value, bytes):
                setattr(self, f"_{field}_raw", value)
                value = value.split(b"\0", 1)[0].decode("ascii", errors="replace")
            setattr(self, field, value)

    def pack(self: dialect.MAVLink_message, mav: dialect.MAVLink, force_mavlink1: bool = False) -> bytes:
        values: list[object] = []
        for kind, field, length in ordered:
            value = getattr(self, f"_{field}_raw" if kind == "char" else field)
            values += value if length and kind != "char" else (value,)
        packed: bytes = self._pack(mav, self.crc_extra, wire.pack(*values), force_mavlink1=force_mavlink1)
        return packed

    return type(
        f"MAVLink_{name.lower()}_message",
        (dialect.MAVLink_message,),
        {
            "__init__": construct,
            "pack": pack,
            "unpacker": wire,
            "id": message_id,
            "msgname": name,
            "fieldnames": names,
            "ordered_fieldnames": [field for _, field, _ in ordered],
            "fieldtypes": [kind for kind, _, _ in fields],
            "fielddisplays_by_name": {},
            "fieldenums_by_name": {},
            "fieldunits_by_name": {},
            "array_lengths": [length for _, _, length in ordered],
            "crc_extra": crc_extra(name, ordered),
        },
    )


LinkNodeStatus: Final = _message_class(
    8,
    "LINK_NODE_STATUS",
    [
        ("uint64_t", "timestamp", 0),
        ("uint8_t", "tx_buf", 0),
        ("uint8_t", "rx_buf", 0),
        ("uint32_t", "tx_rate", 0),
        ("uint32_t", "rx_rate", 0),
        ("uint16_t", "rx_parse_err", 0),
        ("uint16_t", "tx_overflows", 0),
        ("uint16_t", "rx_overflows", 0),
        ("uint32_t", "messages_sent", 0),
        ("uint32_t", "messages_received", 0),
        ("uint32_t", "messages_lost", 0),
    ],
)
ProtocolVersion: Final = _message_class(
    300,
    "PROTOCOL_VERSION",
    [
        ("uint16_t", "version", 0),
        ("uint16_t", "min_version", 0),
        ("uint16_t", "max_version", 0),
        ("uint8_t", "spec_version_hash", 8),
        ("uint8_t", "library_version_hash", 8),
    ],
)
TimeEstimateToTarget: Final = _message_class(
    380,
    "TIME_ESTIMATE_TO_TARGET",
    [
        ("int32_t", "safe_return", 0),
        ("int32_t", "land", 0),
        ("int32_t", "mission_next_item", 0),
        ("int32_t", "mission_end", 0),
        ("int32_t", "commanded_action", 0),
    ],
)
ComponentMetadata: Final = _message_class(
    397,
    "COMPONENT_METADATA",
    [("uint32_t", "time_boot_ms", 0), ("uint32_t", "file_crc", 0), ("char", "uri", 100)],
)
EventMessage: Final = _message_class(
    410,
    "EVENT",
    [
        ("uint8_t", "destination_component", 0),
        ("uint8_t", "destination_system", 0),
        ("uint32_t", "id", 0),
        ("uint32_t", "event_time_boot_ms", 0),
        ("uint16_t", "sequence", 0),
        ("uint8_t", "log_levels", 0),
        ("uint8_t", "arguments", 40),
    ],
)
CurrentEventSequence: Final = _message_class(
    411, "CURRENT_EVENT_SEQUENCE", [("uint16_t", "sequence", 0), ("uint8_t", "flags", 0)]
)
RequestEvent: Final = _message_class(
    412,
    "REQUEST_EVENT",
    [
        ("uint8_t", "target_system", 0),
        ("uint8_t", "target_component", 0),
        ("uint16_t", "first_sequence", 0),
        ("uint16_t", "last_sequence", 0),
    ],
)
ResponseEventError: Final = _message_class(
    413,
    "RESPONSE_EVENT_ERROR",
    [
        ("uint8_t", "target_system", 0),
        ("uint8_t", "target_component", 0),
        ("uint16_t", "sequence", 0),
        ("uint16_t", "sequence_oldest_available", 0),
        ("uint8_t", "reason", 0),
    ],
)

MESSAGES: Final = {
    each.id: each
    for each in (
        LinkNodeStatus,
        ProtocolVersion,
        TimeEstimateToTarget,
        ComponentMetadata,
        EventMessage,
        CurrentEventSequence,
        RequestEvent,
        ResponseEventError,
    )
    if each.id not in dialect.mavlink_map  # a newer pymavlink has its own
}
