"""MISSION_* messages: building them, and turning items into messages and back.

pymavlink's dialect leaves out the plan identifiers that the MAVLink definition gives as extension fields:
MISSION_COUNT.opaque_id, MISSION_ACK.opaque_id and MISSION_CURRENT.mission_id, fence_id, rally_points_id (all
uint32, 0 = unknown). They are added here; a pymavlink that has them is used as it is. Extension fields take
no part in CRC_EXTRA, so every MAVLink 2 receiver understands both.
"""

import math
import struct
import zlib
from typing import Any, ClassVar, Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.services.channel import NOBODY, Channel, MavlinkMessage, Source

GLOBAL_FRAMES: Final = frozenset((mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT))
RELATIVE_FRAMES: Final = frozenset(
    (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
)
TERRAIN_FRAMES: Final = frozenset(
    (mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT)
)
GEODETIC_FRAMES: Final = GLOBAL_FRAMES | RELATIVE_FRAMES | TERRAIN_FRAMES
UNSET_INT: Final = 2**31 - 1  # x or y of MISSION_ITEM_INT that is not set
_DEG_E7: Final = 1e7
_LOCAL_E4: Final = 1e4
_CRC_HEAD: Final = struct.Struct("<BHB4f")


def _with_extensions(base: Any, names: tuple[str, ...]) -> Any:
    """`base` with uint32 extension fields appended, or `base` itself when it has them."""
    if all(name in base.fieldnames for name in names):
        return base
    packer = struct.Struct(base.unpacker.format + "I" * len(names))
    count = len(base.ordered_fieldnames)

    class Extended(base):  # type: ignore[misc]
        fieldnames: ClassVar[Any] = [*base.fieldnames, *names]
        ordered_fieldnames: ClassVar[Any] = [*base.ordered_fieldnames, *names]
        fieldtypes: ClassVar[Any] = [*base.fieldtypes, *["uint32_t"] * len(names)]
        native_format: ClassVar[Any] = bytearray(packer.format.encode())
        orders: ClassVar[Any] = [*base.orders, *range(count, count + len(names))]
        lengths: ClassVar[Any] = [*base.lengths, *[1] * len(names)]
        array_lengths: ClassVar[Any] = [*base.array_lengths, *[0] * len(names)]
        unpacker = packer

        def __init__(self, **fields: int) -> None:
            super().__init__(**{name: value for name, value in fields.items() if name not in names})
            self._fieldnames = Extended.fieldnames
            for name in names:
                setattr(self, name, fields.get(name, 0))

        def wire_payload(self) -> bytes:
            return packer.pack(*[getattr(self, name) for name in self.ordered_fieldnames])

        def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
            payload = self.wire_payload()
            packed: bytes = self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1)
            return packed

    Extended.__name__ = base.__name__
    return Extended


_Count: Final = _with_extensions(mavlink.MAVLink_mission_count_message, ("opaque_id",))
_Ack: Final = _with_extensions(mavlink.MAVLink_mission_ack_message, ("opaque_id",))
_Current: Final = _with_extensions(
    mavlink.MAVLink_mission_current_message, ("mission_id", "fence_id", "rally_points_id")
)


def send_extended(channel: Channel, message: MavlinkMessage) -> None:
    """Send a message with its extension fields.

    An encoder that works from pymavlink's definitions would leave them out, so the packed payload goes to a
    channel that takes one (`send_payload(message_id, payload)`).
    """
    wire_payload = getattr(message, "wire_payload", None)
    send_payload = getattr(channel, "send_payload", None)
    if wire_payload is None or send_payload is None:
        channel.send(message)
    else:
        send_payload(type(message).id, wire_payload())


def count_message(to: Source, count: int, mission_type: int, plan_id: int = 0) -> MavlinkMessage:
    return _Count(
        target_system=to.system_id,
        target_component=to.component_id,
        count=count,
        mission_type=mission_type,
        opaque_id=plan_id,
    )


def ack_message(to: Source, result: int, mission_type: int, plan_id: int = 0) -> MavlinkMessage:
    return _Ack(
        target_system=to.system_id,
        target_component=to.component_id,
        type=result,
        mission_type=mission_type,
        opaque_id=plan_id,
    )


def current_message(
    *, seq: int, total: int, state: int, mode: int, mission_id: int, fence_id: int, rally_id: int
) -> MavlinkMessage:
    return _Current(
        seq=seq,
        total=total,
        mission_state=state,
        mission_mode=mode,
        mission_id=mission_id,
        fence_id=fence_id,
        rally_points_id=rally_id,
    )


def request_message(to: Source, seq: int, mission_type: int, *, as_int: bool) -> MavlinkMessage:
    """MISSION_REQUEST_INT, or MISSION_REQUEST."""
    message = (
        mavlink.MAVLink_mission_request_int_message if as_int else mavlink.MAVLink_mission_request_message
    )
    return message(to.system_id, to.component_id, seq, mission_type)


def is_geodetic(item: MissionItem) -> bool:
    """True when x and y of an item are latitude and longitude."""
    return item.frame in GEODETIC_FRAMES


def item_from_message(message: MavlinkMessage) -> MissionItem:
    """The item in a MISSION_ITEM or MISSION_ITEM_INT, unchecked; unset coordinates become NaN."""
    x, y = message.x, message.y
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT:
        if message.frame in GEODETIC_FRAMES:
            x, y = (math.nan if value == UNSET_INT else value / _DEG_E7 for value in (x, y))
        elif message.frame != mavlink.MAV_FRAME_MISSION:
            x, y = x / _LOCAL_E4, y / _LOCAL_E4
    return MissionItem(
        command=message.command,
        frame=message.frame,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=x,
        y=y,
        z=message.z,
        autocontinue=bool(message.autocontinue),
    )


def item_message(
    to: Source, item: MissionItem, seq: int, mission_type: int, *, current: bool, as_int: bool
) -> MavlinkMessage:
    """MISSION_ITEM_INT, or MISSION_ITEM, for one item."""
    x: float = item.x
    y: float = item.y
    if as_int:
        scale = (
            _DEG_E7 if is_geodetic(item) else 1.0 if item.frame == mavlink.MAV_FRAME_MISSION else _LOCAL_E4
        )
        x, y = _scaled(x, scale), _scaled(y, scale)
    message = mavlink.MAVLink_mission_item_int_message if as_int else mavlink.MAVLink_mission_item_message
    return message(
        to.system_id,
        to.component_id,
        seq,
        item.frame,
        item.command,
        int(current),
        int(item.autocontinue),
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        x,
        y,
        item.z,
        mission_type,
    )


def _scaled(value: float, scale: float) -> int:
    if not math.isfinite(value):
        return UNSET_INT
    return max(-(2**31), min(UNSET_INT, round(value * scale)))


def message_checksum(message: MavlinkMessage, previous: int) -> int:
    """PX4's plan identifier, continued over one more MISSION_ITEM(_INT).

    CRC-32 (reflected 0xEDB88320, no inversion) over frame, command, autocontinue and the seven parameters as
    they were on the wire (PX4 1.16 mavlink_mission, CrcMissionItem).
    """
    as_int = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT
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
        message = item_message(NOBODY, item, seq, mission_type, current=False, as_int=True)
        checksum = message_checksum(message, checksum)
    return checksum
