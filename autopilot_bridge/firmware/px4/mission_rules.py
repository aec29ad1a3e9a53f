"""PX4's missions: the protocol, and rules for items (commands, frames, how an item is stored)."""

import math
from dataclasses import replace
from functools import partial
from typing import Any, Final

from autopilot_bridge.firmware.data import commands, load_data
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_feasibility.px4 import PARAMETERS, Px4MissionRules, mission_problems
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, RELATIVE_FRAMES
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.plans.policy import CRITICAL, INFO, MissionPolicy, MissionTexts
from autopilot_bridge.services.plans.rules import (
    ACCEPTED,
    CIRCLE_COMMANDS,
    POLYGON_COMMANDS,
    check_fence,
    check_finite,
    check_params,
    check_position,
    check_rally,
    check_special,
)

_ITEMS: Final = load_data("px4", "mission_items.toml")
POSITION_COMMANDS: Final = commands(_ITEMS["position_commands"])
"""Mission commands accepted in a global frame."""

PLAIN_COMMANDS: Final = commands(_ITEMS["plain_commands"])
"""Mission commands accepted in MAV_FRAME_MISSION.

The firmware supports CONDITION_GATE and OBLIQUE_SURVEY too, which are not flown here, so they are refused.
"""

PASSED_OVER: Final = commands(_ITEMS["passed_over"])
"""Accepted and skipped, as in the firmware."""

_POSITION_FRAMES: Final = GLOBAL_FRAMES | RELATIVE_FRAMES
_UNSET_EVERYWHERE: Final = (True, True, True, True)


class Px4ItemRules:
    """`ItemRules` of PX4 1.16."""

    def check(self, item: MissionItem, mission_type: MissionType, seq: int, count: int) -> int:
        if item.frame not in _POSITION_FRAMES and item.frame != dialect.MAV_FRAME_MISSION:
            return int(dialect.MAV_MISSION_UNSUPPORTED_FRAME)
        if mission_type is MissionType.FENCE:
            return check_fence(item, empty_circles=True)
        if mission_type is MissionType.RALLY:
            return check_rally(item)
        if item.frame == dialect.MAV_FRAME_MISSION:
            if item.command not in PLAIN_COMMANDS:
                return int(dialect.MAV_MISSION_UNSUPPORTED)
            result = check_finite(item)
        else:
            if item.command not in POSITION_COMMANDS:
                return int(dialect.MAV_MISSION_UNSUPPORTED)
            result = check_params(item, nan_allowed=_UNSET_EVERYWHERE) or check_position(item)
        return result or check_special(item, seq, count) or self._check_roi(item)

    def stored(self, item: MissionItem) -> MissionItem:
        """Only the parameters that PX4 stores of an item with a position; the others read back as 0."""
        if item.frame == dialect.MAV_FRAME_MISSION:
            return item
        p1 = p2 = p3 = p4 = 0.0
        match item.command:
            case dialect.MAV_CMD_NAV_WAYPOINT:
                p1, p2, p4 = _number(item.param1), _number(item.param2), _heading(item.param4)
            case dialect.MAV_CMD_NAV_LOITER_UNLIM:
                p3, p4 = _number(item.param3), _heading(item.param4)
            case dialect.MAV_CMD_NAV_LOITER_TIME:
                p1, p2 = _number(item.param1), float(item.param2 > 0.0)
                p3, p4 = _number(item.param3), float(item.param4 > 0.0)
            case dialect.MAV_CMD_NAV_LAND:
                p2, p4 = float(int(_number(item.param2))), _heading(item.param4)
            case (
                dialect.MAV_CMD_NAV_TAKEOFF | dialect.MAV_CMD_NAV_VTOL_TAKEOFF | dialect.MAV_CMD_NAV_VTOL_LAND
            ):
                p4 = _heading(item.param4)
            case dialect.MAV_CMD_NAV_LOITER_TO_ALT:
                p1, p2, p4 = float(item.param1 > 0.0), _number(item.param2), float(item.param4 > 0.0)
            case dialect.MAV_CMD_NAV_ROI | dialect.MAV_CMD_DO_SET_ROI:
                p1 = item.param1
        if item.command in POLYGON_COMMANDS:
            p1 = float(round(item.param1))
        elif item.command in CIRCLE_COMMANDS:
            p1 = item.param1
        return replace(item, param1=p1, param2=p2, param3=p3, param4=p4)

    def read_back(self, item: MissionItem, *, as_int: bool) -> MissionItem:
        if item.frame in RELATIVE_FRAMES:
            frame = (
                dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT if as_int else dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
            )
        elif item.frame in GLOBAL_FRAMES:
            frame = dialect.MAV_FRAME_GLOBAL_INT if as_int else dialect.MAV_FRAME_GLOBAL
        else:
            return item
        return replace(item, frame=frame)

    @staticmethod
    def _check_roi(item: MissionItem) -> int:
        if item.command not in (dialect.MAV_CMD_NAV_ROI, dialect.MAV_CMD_DO_SET_ROI):
            return int(ACCEPTED)
        allowed = (
            (dialect.MAV_ROI_NONE, dialect.MAV_ROI_WPNEXT, dialect.MAV_ROI_WPINDEX)
            if item.frame == dialect.MAV_FRAME_MISSION
            else (dialect.MAV_ROI_NONE, dialect.MAV_ROI_LOCATION)
        )
        return int(ACCEPTED if item.param1 in allowed else dialect.MAV_MISSION_INVALID_PARAM1)


def _number(value: float) -> float:
    return 0.0 if math.isnan(value) else value


def _heading(degrees: float) -> float:
    """Heading in 0..360 deg; NaN (keep or follow the course) stays."""
    return degrees % 360.0


def _problems(
    items: tuple[MissionItem, ...], parameters: ParameterStore, *, fixed_wing: bool = False, **situation: Any
) -> tuple[str, ...]:
    values = {
        name: parameters.get(name) if name in parameters else usual for name, usual in PARAMETERS.items()
    }
    return mission_problems(items, Px4MissionRules.of(values, fixed_wing=fixed_wing), **situation)


PX4_MISSION_POLICY: Final = MissionPolicy(
    rules=Px4ItemRules(),
    texts=MissionTexts(
        upload_busy=(CRITICAL, "WPM: REJ. CMD: Busy"),
        download_open=(CRITICAL, "WPM: IGN MISSION_COUNT: Busy"),
        uploading=(INFO, "Mission download request ignored, already active"),
        clear_busy=(CRITICAL, "WPM: IGN CLEAR CMD: Busy"),
        set_current_busy=(CRITICAL, "WPM: IGN WP CURR CMD: Busy"),
        no_transfer=(CRITICAL, "IGN MISSION_ITEM: No transfer"),
        partner_mismatch=(CRITICAL, "REJ. MIS ITEM: partner id mismatch"),
        unexpected_request=(CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected"),
        not_in_list=(CRITICAL, "WPM: WP CURR CMD: Not in list"),
        invalid_item=(CRITICAL, "IGN MISSION_ITEM: Invalid item"),
        timeout=(CRITICAL, "Operation timeout"),
        home_outside_fence=(CRITICAL, "Geofence invalid, doesn't contain Home position"),
    ),
    capacity={MissionType.MISSION: 10_000, MissionType.FENCE: 64, MissionType.RALLY: 32},
    retry_us=250_000,
    timeout_us=5_000_000,
    timeout_result=None,
    requests_as_int=True,
    wrong_sequence_result=None,
    restart_on_count=False,
    foreign_count_result=dialect.MAV_MISSION_ERROR,
    ordered_download=True,
    home_is_item_0=False,
    partial_writes=False,
    clears_all_types=True,
    refuses_clear_in_flight=False,
    plan_ids=True,
    total_when_empty=65535,
    mission_state=False,
    reached_repeats=10,
    sends_current_on_change=True,
    acks_set_current=False,
    guided_items=False,
    feasibility=_problems,
)
PX4_PLANE_MISSION_POLICY: Final = replace(PX4_MISSION_POLICY, feasibility=partial(_problems, fixed_wing=True))
