"""Heights that are commanded to a vehicle: below home only where the user allows it.

Most ground is level enough that a height below home is a mistake: a down value with the wrong sign, or an
altitude above mean sea level that was meant above home. On a slope it can be right, so it can be allowed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, RELATIVE_FRAMES, TERRAIN_FRAMES
from missions.errors import PlanError
from missions.vehicle.items import FLOWN_TO, item_name

HOME_DRIFT_M: Final = 0.5
"""A height counts as below home from here on. A vehicle sets its home again until it leaves the ground: PX4's
moved by 0.34 m.
"""

_WITH_HEIGHT: Final = FLOWN_TO - {dialect.MAV_CMD_NAV_LAND} | {dialect.MAV_CMD_NAV_RALLY_POINT}

_HOW_ALLOWED: Final = "where the ground is lower than home, allow it with `allow_below_home`"


@dataclass(frozen=True, slots=True, kw_only=True)
class LowItem:
    """An item below home, or below the ground.

    Attributes:
        index: index of the item.
        item: the item.
        height_m: above home, or above the ground in a terrain frame; negative.
    """

    index: int
    item: MissionItem
    height_m: float

    @property
    def in_ground(self) -> bool:
        """Whether the height is below the ground itself, not only below home."""
        return self.item.frame in TERRAIN_FRAMES


def low_items(items: Sequence[MissionItem], home_alt_m: float | None) -> list[LowItem]:
    """The items below home or below the ground; each height is judged in its own frame.

    Args:
        items: items of a mission, or rally points. Landings are left out.
        home_alt_m: altitude of home above mean sea level; None: not known, and heights above mean sea level
            are left out.
    """
    found = []
    for index, item in enumerate(items):
        if item.command not in _WITH_HEIGHT:
            continue
        if item.frame in RELATIVE_FRAMES | TERRAIN_FRAMES:
            height_m = item.z
        elif item.frame in GLOBAL_FRAMES and home_alt_m is not None:
            height_m = item.z - home_alt_m
        else:
            continue
        if height_m < -HOME_DRIFT_M:
            found.append(LowItem(index=index, item=item, height_m=height_m))
    return found


def refuse_low_items(
    items: Sequence[MissionItem],
    home_alt_m: float | None,
    *,
    below_home_allowed: bool,
    name: Callable[[int, int], str] = item_name,
) -> None:
    """Refuse items below home, unless that is allowed, and items below the ground.

    Args:
        items, home_alt_m: see `low_items`.
        below_home_allowed: the user allows heights below home.
        name: name of an item from its index and its command.

    Raises:
        PlanError: names the items, their altitudes and how far they are below.
    """
    low = [found for found in low_items(items, home_alt_m) if found.in_ground or not below_home_allowed]
    if not low:
        return
    in_ground = [found for found in low if found.in_ground]
    first, *others = in_ground or low
    where, depth_m = name(first.index, first.item.command), -first.height_m
    others_text = ", ".join(name(found.index, found.item.command) for found in others)
    more = f"; also {others_text}" if others else ""
    if in_ground:
        raise PlanError(
            f"{where}: altitude {first.item.z:g} m above the ground is {depth_m:.0f} m below it{more}; "
            "accepted: 0 or more"
        )
    if first.item.frame in GLOBAL_FRAMES:
        altitude = f"altitude {first.item.z:g} m above mean sea level"
        home = f" ({home_alt_m:.0f} m above mean sea level)"
        change = "give altitudes above home (frame 3), or "
    else:
        altitude, home, change = f"altitude {first.item.z:g} m", "", ""
    raise PlanError(f"{where}: {altitude} is {depth_m:.0f} m below home{home}{more}; {change}{_HOW_ALLOWED}")


class HeightRule:
    """Whether heights below home may be commanded to one vehicle.

    Attributes:
        below_home_allowed: the user allows them.
    """

    def __init__(self) -> None:
        self.below_home_allowed = False

    def check(self, height_m: float, what: str) -> None:
        """Refuse a height above home that is below home, unless that is allowed.

        Args:
            height_m: height above home; NaN is refused too.
            what: what is commanded, for the error: "goto".

        Raises:
            PlanError: names the height; nothing was sent.
        """
        if height_m >= -HOME_DRIFT_M or (self.below_home_allowed and height_m < 0.0):
            return
        if not height_m < 0.0:
            raise PlanError(f"{what}: a height of {height_m} m can't be flown; accepted: a finite height")
        raise PlanError(
            f"{what}: {-height_m:.1f} m below home is refused (heights are positive up, NED's down is "
            f"positive down); {_HOW_ALLOWED}"
        )
