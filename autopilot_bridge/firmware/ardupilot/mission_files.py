"""ArduPilot's files of its plans (`@MISSION/mission.dat`, `fence.dat`, ...).

A file is a header (magic number, MAV_MISSION_TYPE, options, first item, number of items) and the items as
MISSION_ITEM_INT has them on the wire.

Source: ArduPilot 4.6, AP_Filesystem/README.md ("@MISSION").
"""

import struct
from collections.abc import Mapping
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink.encoder import payload_packer
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.mission_wire import item_message
from autopilot_bridge.storage.generated import Content, GeneratedStore

_HEADER: Final = struct.Struct("<HHHHH")
_MAGIC: Final = 0x763D
_FILES: Final = {
    "mission.dat": MissionType.MISSION,
    "fence.dat": MissionType.FENCE,
    "rally.dat": MissionType.RALLY,
}


def plan_files(stores: Mapping[MissionType, MissionStore]) -> GeneratedStore:
    """The plans as files, for reading."""
    return GeneratedStore({name: _content(stores[kind], kind) for name, kind in _FILES.items()})


def _content(store: MissionStore, kind: MissionType) -> Content:
    return lambda query: packed(store.items, kind)


def packed(items: tuple[MissionItem, ...], kind: MissionType) -> bytes:
    """The file of a plan."""
    data = bytearray(_HEADER.pack(_MAGIC, kind, 0, 0, len(items)))
    for seq, item in enumerate(items):
        message: MAVLinkMessage = item_message(item, seq, kind, target=(0, 0), current=False)
        data += payload_packer(message.id)(message)
    return bytes(data)
