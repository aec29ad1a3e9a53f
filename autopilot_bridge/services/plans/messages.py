"""MISSION_* messages: building them, and the identifiers of plans.

pymavlink's dialect leaves out the plan identifiers that the MAVLink definition gives as extension fields:
MISSION_COUNT.opaque_id, MISSION_ACK.opaque_id and MISSION_CURRENT.mission_id, fence_id, rally_points_id (all
uint32, 0 = unknown). They are added here; a pymavlink that has them is used unchanged. Extension fields are
not part of CRC_EXTRA, so every MAVLink 2 receiver understands both.
"""

import struct
import zlib
from collections.abc import Callable
from typing import ClassVar, Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import item_message
from autopilot_bridge.services.channel import Channel, Source

_CRC_HEAD: Final = struct.Struct("<BHB4f")


def _with_extensions(base: type[MAVLinkMessage], names: tuple[str, ...]) -> Callable[..., MAVLinkMessage]:
    """`base` with uint32 extension fields appended, or `base` itself when it has them."""
    if all(name in base.fieldnames for name in names):
        return base
    packer = struct.Struct(base.unpacker.format + "I" * len(names))
    count = len(base.ordered_fieldnames)

    class Extended(base):  # type: ignore[misc,valid-type]
        fieldnames: ClassVar[list[str]] = [*base.fieldnames, *names]
        ordered_fieldnames: ClassVar[list[str]] = [*base.ordered_fieldnames, *names]
        fieldtypes: ClassVar[list[str]] = [*base.fieldtypes, *["uint32_t"] * len(names)]
        native_format = bytearray(packer.format.encode())
        orders: ClassVar[list[int]] = [*base.orders, *range(count, count + len(names))]
        lengths: ClassVar[list[int]] = [*base.lengths, *[1] * len(names)]
        array_lengths: ClassVar[list[int]] = [*base.array_lengths, *[0] * len(names)]
        unpacker = packer

        def __init__(self, **fields: int) -> None:
            super().__init__(**{name: value for name, value in fields.items() if name not in names})
            self._fieldnames = Extended.fieldnames
            for name in names:
                setattr(self, name, fields.get(name, 0))

        def wire_payload(self) -> bytes:
            return packer.pack(*[getattr(self, name) for name in self.ordered_fieldnames])

        def pack(self, mav: dialect.MAVLink, force_mavlink1: bool = False) -> bytes:
            payload = self.wire_payload()
            return self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1)

    Extended.__name__ = base.__name__
    return Extended


_Count: Final = _with_extensions(dialect.MAVLink_mission_count_message, ("opaque_id",))
_Ack: Final = _with_extensions(dialect.MAVLink_mission_ack_message, ("opaque_id",))
_Current: Final = _with_extensions(
    dialect.MAVLink_mission_current_message, ("mission_id", "fence_id", "rally_points_id")
)


def send_extended(channel: Channel, message: MAVLinkMessage) -> None:
    """Send a message with its extension fields.

    An encoder based on pymavlink's definitions would leave them out, so the packed payload is passed to a
    channel that supports it (`send_payload(message_id, payload)`).
    """
    payload = extended_payload(message)
    send_payload = getattr(channel, "send_payload", None)
    if payload is None or send_payload is None:
        channel.send(message)
    else:
        send_payload(type(message).id, payload)


def extended_payload(message: MAVLinkMessage) -> bytes | None:
    """The payload of a message with its extension fields; None where pymavlink's definition has them."""
    wire_payload = getattr(message, "wire_payload", None)
    return None if wire_payload is None else wire_payload()


def count_message(to: Source, count: int, mission_type: int, plan_id: int = 0) -> MAVLinkMessage:
    return _Count(
        target_system=to.system_id,
        target_component=to.component_id,
        count=count,
        mission_type=mission_type,
        opaque_id=plan_id,
    )


def ack_message(to: Source, result: int, mission_type: int, plan_id: int = 0) -> MAVLinkMessage:
    return _Ack(
        target_system=to.system_id,
        target_component=to.component_id,
        type=result,
        mission_type=mission_type,
        opaque_id=plan_id,
    )


def current_message(
    *, seq: int, total: int, state: int, mode: int, mission_id: int, fence_id: int, rally_id: int
) -> MAVLinkMessage:
    return _Current(
        seq=seq,
        total=total,
        mission_state=state,
        mission_mode=mode,
        mission_id=mission_id,
        fence_id=fence_id,
        rally_points_id=rally_id,
    )


def request_message(to: Source, seq: int, mission_type: int, *, as_int: bool) -> MAVLinkMessage:
    """MISSION_REQUEST_INT, or MISSION_REQUEST."""
    message = (
        dialect.MAVLink_mission_request_int_message if as_int else dialect.MAVLink_mission_request_message
    )
    return message(to.system_id, to.component_id, seq, mission_type)


def message_checksum(
    message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message, previous: int
) -> int:
    """PX4's plan identifier, continued over one more MISSION_ITEM(_INT).

    CRC-32 (reflected 0xEDB88320, no inversion) over frame, command, autocontinue and the seven parameters as
    they were on the wire (PX4 1.16 mavlink_mission, CrcMissionItem).
    """
    as_int = message.get_msgId() == dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT
    head = _CRC_HEAD.pack(
        message.frame,
        message.command,
        message.autocontinue,
        message.param1,
        message.param2,
        message.param3,
        message.param4,
    )
    tail = struct.pack("<iif" if as_int else "<fff", message.x, message.y, message.z)
    return zlib.crc32(head + tail, previous ^ 0xFFFFFFFF) ^ 0xFFFFFFFF


def plan_checksum(items: tuple[MissionItem, ...], mission_type: MissionType = MissionType.MISSION) -> int:
    """Identifier of a plan as PX4 would compute it from an upload in MISSION_ITEM_INT; 0 when empty."""
    checksum = 0
    for seq, item in enumerate(items):
        message = item_message(item, seq, mission_type, target=(0, 0), current=False)
        checksum = message_checksum(message, checksum)
    return checksum
