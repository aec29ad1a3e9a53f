"""A mission as data: uploaded, stored, flown and written to files. Independent of protocol and vehicle."""

from dataclasses import dataclass
from enum import IntEnum


class MissionType(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionItem:
    """One item of a plan: MISSION_ITEM_INT of the MAVLink mission protocol, with x and y in natural units.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME (global frames: x latitude deg, y longitude deg, z altitude m; local: metres;
            MAV_FRAME_MISSION (2): plain numbers).
        param1..param4: as the command defines; NaN means "not set".
        x, y, z: as the frame defines.
        autocontinue: continue with the next item when this one is finished.
    """

    command: int
    frame: int = 6  # MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    autocontinue: bool = True


class MissionStore:
    """The plan an autopilot holds for one mission type, and the item being flown.

    Attributes:
        items: the stored plan, in order; for ArduPilot item 0 is home.
        current: index of the item being flown or to be flown next.
        plan_id: checksum of the items (0 when empty); equal plans have equal ids.
        version: raised by every change of `items`, so that a task flying the plan notices an upload.
    """

    def __init__(self) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self.current = 0
        self.plan_id = 0
        self.version = 0

    def replace(self, items: tuple[MissionItem, ...], plan_id: int) -> None:
        """Store a whole new plan; the current item goes back to the first."""
        self.items = items
        self.plan_id = plan_id
        self.current = 0
        self.version += 1
