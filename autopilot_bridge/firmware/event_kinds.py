"""Events of MAVLink's events interface: what a kind of event is, its number, its arguments on the wire.

Source: mavlink.io/en/services/events.html and the JSON schema of libevents (version 1).
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

from autopilot_bridge.firmware.texts import Severity
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.event_ids import event_sub_id

ARGUMENT_BYTES: Final = 40
_CODES: Final[Mapping[str, str]] = {
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "float": "f",
}


class LogLevel(IntEnum):
    """Levels of events beyond those of `Severity`."""

    PROTOCOL = 8
    DISABLED = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class EventEnum:
    """An enumeration that arguments may have as their type.

    Attributes:
        name: as in the JSON, ending in `_t`.
        type: C type on the wire.
        entries: value -> (name, description).
        bits: the values are bits of a set.
    """

    name: str
    type: str
    entries: Mapping[int, tuple[str, str]]
    bits: bool = False


class Argument(NamedTuple):
    """An argument of an event: a C type, or an enumeration."""

    name: str
    type: "str | EventEnum"

    @property
    def code(self) -> str:
        """`struct` code on the wire."""
        return _CODES[self.type if isinstance(self.type, str) else self.type.type]

    @property
    def type_name(self) -> str:
        """As in the JSON."""
        return self.type if isinstance(self.type, str) else self.type.name


@dataclass(frozen=True, slots=True, kw_only=True)
class EventKind:
    """A kind of event.

    Attributes:
        name: unique; its hash is the number.
        message: one line; `{1}` stands for the first argument.
        level: severity for the pilot; 8 is for programs only.
        group: "default", "arming_check" or "health".
        type: "summary" for the frame of a report, else empty.
        arguments: in order.
    """

    name: str
    message: str
    level: int = Severity.INFO
    group: str = "default"
    type: str = ""
    arguments: tuple[Argument, ...] = ()

    @property
    def sub_id(self) -> int:
        """Lower 24 bits of the event's number."""
        return event_sub_id(self.name)

    @property
    def event_id(self) -> int:
        """EVENT.id."""
        return AUTOPILOT_COMPONENT << 24 | self.sub_id

    def pack(self, values: tuple[float, ...]) -> bytes:
        """EVENT.arguments: the values, without padding between them."""
        code = "<" + "".join(argument.code for argument in self.arguments)
        return struct.pack(code, *values).ljust(ARGUMENT_BYTES, b"\0")


class Occurrence(NamedTuple):
    """An event that happened: its kind and the values of its arguments."""

    kind: EventKind
    values: tuple[float, ...] = ()
    level: int | None = None  # None: the kind's


def definitions(
    namespace: str, kinds: tuple[EventKind, ...], mode_groups: Mapping[int, int]
) -> dict[str, object]:
    """The JSON that clients decode events with (COMP_METADATA_TYPE_EVENTS).

    Args:
        namespace: of the kinds.
        kinds: all that there are.
        mode_groups: HEARTBEAT.custom_mode of each group of modes in a report of checks.
    """
    enums: dict[str, object] = {}
    groups: dict[str, dict[str, dict[str, object]]] = {}
    for kind in kinds:
        entry: dict[str, object] = {"name": kind.name, "message": kind.message}
        if kind.type:
            entry["type"] = kind.type
        if kind.arguments:
            entry["arguments"] = [{"type": each.type_name, "name": each.name} for each in kind.arguments]
        groups.setdefault(kind.group, {"events": {}})["events"][str(kind.sub_id)] = entry
        for argument in kind.arguments:
            if isinstance(argument.type, EventEnum):
                enums[argument.type.name] = {
                    "type": argument.type.type,
                    "description": "",
                    **({"is_bitfield": True} if argument.type.bits else {}),
                    "entries": {
                        str(value): {"name": name, "description": description}
                        for value, (name, description) in argument.type.entries.items()
                    },
                }
    return {
        "version": 1,
        "components": {
            str(AUTOPILOT_COMPONENT): {
                "namespace": namespace,
                "enums": enums,
                "event_groups": groups,
                "navigation_mode_groups": {
                    "groups": {str(group): [mode] for group, mode in mode_groups.items()}
                },
                "supported_protocols": ["health_and_arming_check"],
            }
        },
    }
