"""ArduPilot's missions: the protocol, and rules for items (commands, frames, how an item is stored)."""

from dataclasses import replace
from typing import Final

from autopilot_bridge.firmware.data import commands, load_data
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import GEODETIC_FRAMES, GLOBAL_FRAMES, RELATIVE_FRAMES
from autopilot_bridge.services.plans.policy import CRITICAL, WARNING, MissionPolicy, MissionTexts
from autopilot_bridge.services.plans.rules import (
    check_fence,
    check_finite,
    check_params,
    check_position,
    check_rally,
    check_special,
)

_ITEMS: Final = load_data("ardupilot", "mission_items.toml")
POSITION_COMMANDS: Final = commands(_ITEMS["position_commands"])
"""Mission commands with a position."""

PLAIN_COMMANDS: Final = commands(_ITEMS["plain_commands"])
"""Mission commands without a position; their frame is not checked.

The firmware supports some more that are not flown here, so they are refused: NAV_GUIDED_ENABLE with
DO_GUIDED_LIMITS, NAV_SCRIPT_TIME, NAV_ATTITUDE_TIME, NAV_PAYLOAD_PLACE, DO_INVERTED_FLIGHT.
"""

PASSED_OVER: Final = commands(_ITEMS["passed_over"])
"""Accepted and skipped on vehicles without the device, as in the firmware."""

AIRCRAFT_REFUSED: Final = frozenset((dialect.MAV_CMD_NAV_SPLINE_WAYPOINT,))
"""Items that aircraft refuse."""

_PLACE_OPTIONAL: Final = commands(_ITEMS["place_optional"])
"""Ground stations send these without a position, in MAV_FRAME_MISSION (QGroundControl's landing pattern)."""

_YAW_IN_PARAM4: Final = commands(_ITEMS["yaw_in_param4"])


class ArdupilotItemRules:
    """`ItemRules` of ArduPilot 4.6.

    Args:
        aircraft: for ArduPlane.
    """

    def __init__(self, *, aircraft: bool = False) -> None:
        self._refused = AIRCRAFT_REFUSED if aircraft else frozenset()

    def check(self, item: MissionItem, mission_type: MissionType, seq: int, count: int) -> int:
        if mission_type is MissionType.FENCE:
            return check_fence(item)
        if mission_type is MissionType.RALLY:
            return check_rally(item)
        if seq == 0:  # home: its uploaded values are replaced
            return int(dialect.MAV_MISSION_ACCEPTED)
        if item.command in self._refused:
            return int(dialect.MAV_MISSION_UNSUPPORTED)
        placeless = _without_place(item)
        if item.command in POSITION_COMMANDS and not placeless:
            if item.frame not in GEODETIC_FRAMES:
                return int(dialect.MAV_MISSION_UNSUPPORTED_FRAME)
            result = self._check_params(item) or check_position(item)
        elif item.command in PLAIN_COMMANDS or placeless:
            result = self._check_params(item) or check_finite(item)
        else:
            return int(dialect.MAV_MISSION_UNSUPPORTED)
        return result or check_special(item, seq, count)

    def stored(self, item: MissionItem) -> MissionItem:
        return replace(item, frame=dialect.MAV_FRAME_GLOBAL) if _without_place(item) else item

    def read_back(self, item: MissionItem, *, as_int: bool) -> MissionItem:
        if item.frame not in GEODETIC_FRAMES:
            return replace(item, frame=dialect.MAV_FRAME_GLOBAL, x=0.0, y=0.0)
        if item.command in PLAIN_COMMANDS or item.frame in GLOBAL_FRAMES:
            frame = dialect.MAV_FRAME_GLOBAL
        elif item.frame in RELATIVE_FRAMES:
            frame = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
        else:
            frame = dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT
        return replace(item, frame=frame)

    @staticmethod
    def _check_params(item: MissionItem) -> int:
        if item.command == dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW:  # NaN: no angle, or no rate
            return check_params(item, nan_allowed=(True, True, True, True))
        vtol_land = item.command == dialect.MAV_CMD_NAV_VTOL_LAND
        yaw_may_be_nan = vtol_land or item.command in _YAW_IN_PARAM4
        return check_params(item, nan_allowed=(False, False, vtol_land, yaw_may_be_nan))


def _without_place(item: MissionItem) -> bool:
    return item.frame == dialect.MAV_FRAME_MISSION and item.command in _PLACE_OPTIONAL


ARDUPILOT_MISSION_POLICY: Final = MissionPolicy(
    rules=ArdupilotItemRules(),
    texts=MissionTexts(
        timeout=(WARNING, "Mission upload timeout"),
        too_many=(WARNING, "Only {capacity} items are supported"),
        partial_rejected=(WARNING, "Flight plan update rejected"),
        changed_in_flight=(CRITICAL, "Auto mission changed but failed to restart command"),
        float_item=(WARNING, "got MISSION_ITEM; GCS should send MISSION_ITEM_INT"),
        float_request=(WARNING, "got MISSION_REQUEST; use MISSION_REQUEST_INT!"),
        received={
            MissionType.MISSION: "Flight plan received",
            MissionType.FENCE: "Fence received",
            MissionType.RALLY: "Rally points received",
        },
    ),
    capacity={MissionType.MISSION: 650, MissionType.FENCE: 84, MissionType.RALLY: 50},
    retry_us=1_000_000,
    timeout_us=8_000_000,
    timeout_result=dialect.MAV_MISSION_OPERATION_CANCELLED,
    requests_as_int=False,
    wrong_sequence_result=dialect.MAV_MISSION_INVALID_SEQUENCE,
    restart_on_count=True,
    foreign_count_result=dialect.MAV_MISSION_DENIED,
    ordered_download=False,
    home_is_item_0=True,
    partial_writes=True,
    clears_all_types=False,
    refuses_clear_in_flight=True,
    plan_ids=False,
    total_when_empty=0,
    mission_state=True,
    reached_repeats=0,
    sends_current_on_change=False,
    acks_set_current=True,
    guided_items=True,
)
ARDUPLANE_MISSION_POLICY: Final = replace(
    ARDUPILOT_MISSION_POLICY,
    rules=ArdupilotItemRules(aircraft=True),
    capacity={**ARDUPILOT_MISSION_POLICY.capacity, MissionType.MISSION: 655},
)
