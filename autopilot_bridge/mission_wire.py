"""Conversion between mission items and messages: MISSION_ITEM_INT and MISSION_ITEM, and their frames.

Source: MAVLink mission protocol, https://mavlink.io/en/services/mission.html.
"""

import math
from typing import Final, Protocol

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem

GLOBAL_FRAMES: Final = frozenset((dialect.MAV_FRAME_GLOBAL, dialect.MAV_FRAME_GLOBAL_INT))
"""Altitudes above mean sea level."""
RELATIVE_FRAMES: Final = frozenset(
    (dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
)
"""Altitudes above home."""
TERRAIN_FRAMES: Final = frozenset(
    (dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT, dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT)
)
"""Altitudes above the ground."""
GEODETIC_FRAMES: Final = GLOBAL_FRAMES | RELATIVE_FRAMES | TERRAIN_FRAMES
UNSET_INT: Final = 2**31 - 1
"""x or y of MISSION_ITEM_INT that is not set."""
_DEG_E7: Final = 1e7
_LOCAL_E4: Final = 1e4


class HasItem(Protocol):
    """MISSION_ITEM_INT or MISSION_ITEM, of pymavlink or of `estimators.wire`."""

    command: int
    frame: int
    param1: float
    param2: float
    param3: float
    param4: float
    z: float
    autocontinue: int

    @property
    def x(self) -> float: ...

    @property
    def y(self) -> float: ...


def is_geodetic(item: MissionItem) -> bool:
    """True when x and y of an item are latitude and longitude."""
    return item.frame in GEODETIC_FRAMES


def item_from_message(
    message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message,
) -> MissionItem:
    """The item in a MISSION_ITEM or MISSION_ITEM_INT, unchecked; unset coordinates become NaN."""
    if isinstance(message, dialect.MAVLink_mission_item_int_message):
        return item_from_int(message)
    return _item(message, message.x, message.y)


def item_from_int(message: HasItem) -> MissionItem:
    """The item in a MISSION_ITEM_INT, unchecked; unset coordinates become NaN."""
    x: float = message.x
    y: float = message.y
    if message.frame in GEODETIC_FRAMES:
        x, y = (math.nan if value == UNSET_INT else value / _DEG_E7 for value in (x, y))
    elif message.frame != dialect.MAV_FRAME_MISSION:
        x, y = x / _LOCAL_E4, y / _LOCAL_E4
    return _item(message, x, y)


def _item(message: HasItem, x: float, y: float) -> MissionItem:
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
    item: MissionItem,
    seq: int,
    mission_type: int,
    *,
    target: tuple[int, int],
    current: bool,
    as_int: bool = True,
    unset: int = UNSET_INT,
) -> dialect.MAVLink_mission_item_int_message | dialect.MAVLink_mission_item_message:
    """MISSION_ITEM_INT (degrees in 1e-7, local metres in 1e-4), or MISSION_ITEM, for one item.

    Args:
        target: system and component of the receiver.
        current: it is the item to be flown.
        as_int: MISSION_ITEM_INT.
        unset: value in MISSION_ITEM_INT of an x or y that is not set (NaN).
    """
    head = (*target, seq, item.frame, item.command, int(current), int(item.autocontinue))
    parameters = (item.param1, item.param2, item.param3, item.param4)
    if not as_int:
        return dialect.MAVLink_mission_item_message(
            *head, *parameters, item.x, item.y, item.z, int(mission_type)
        )
    scale = _DEG_E7 if is_geodetic(item) else 1.0 if item.frame == dialect.MAV_FRAME_MISSION else _LOCAL_E4
    x, y = _scaled(item.x, scale, unset), _scaled(item.y, scale, unset)
    return dialect.MAVLink_mission_item_int_message(*head, *parameters, x, y, item.z, int(mission_type))


def _scaled(value: float, scale: float, unset: int) -> int:
    if not math.isfinite(value):
        return unset
    return max(-(2**31), min(UNSET_INT, round(value * scale)))
