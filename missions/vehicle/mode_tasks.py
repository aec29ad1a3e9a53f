"""Evidence that a flight mode has done its task, so that the autopilot leaves it by itself. Sans-IO.

A take-off is done at its height; a mission when its last place or its return is reached. A return of
ArduPlane goes on with the stored landing if there is one: the autopilot then reports that its mission is at
the landing, and "Landing sequence start" (ArduPilot 4.6.3, AP_Mission.cpp: jump_to_landing_sequence).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from missions.kind import VehicleKind
from missions.vehicle.firmware import Firmware, Mode
from missions.vehicle.item_tracker import ItemTracker, MissionStep

_SLACK_M: Final[Mapping[VehicleKind, float]] = {VehicleKind.MULTICOPTER: 1.5, VehicleKind.FIXED_WING: 15.0}
"""Below a take-off's altitude, at least."""
_SLACK_SHARE: Final = 1.5
"""Of the radius within which a take-off's altitude counts as reached: heights of the estimate differ."""
_TAKEOFFS: Final = (dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_NAV_VTOL_TAKEOFF)
LANDING_PARTS: Final = (dialect.MAV_CMD_DO_LAND_START, dialect.MAV_CMD_DO_RETURN_PATH_START)
_LANDING_TEXTS: Final = (
    "Landing sequence start",
    "Landing sequence active",
    "Return path started",
    "Return path active",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredPlan:
    """The plan that this program uploaded to a vehicle.

    Attributes:
        steps: its steps in the order in which they are executed.
        again_from: step from which it repeats for ever; None: it ends.
        first: sequence number of its first item on the link.
        landing: sequence number on the link of the first item that begins a landing (DO_LAND_START) or the
            way to it; None: there is none.
    """

    steps: tuple[MissionStep, ...]
    again_from: int | None
    first: int
    landing: int | None = None

    def tracker(self) -> ItemTracker:
        """A tracker of a flight along the plan, from its beginning."""
        return ItemTracker(self.steps, self.again_from, first=self.first)


class ModeTasks:
    """What the modes of one vehicle have to do, and what they have done.

    Args:
        firmware: of the vehicle.

    Attributes:
        plan: the stored plan; None: this program has uploaded none.
        altitude_radius_m: distance within which the autopilot takes the altitude of a take-off for reached.
    """

    def __init__(self, firmware: Firmware) -> None:
        self._firmware = firmware
        self._plan: StoredPlan | None = None
        self._tracker: ItemTracker | None = None
        self._mode: int | None = None
        self._complete = False
        self._reached = -1
        self._current = -1
        self._landing_reported = False
        self._total = 0
        self.altitude_radius_m = 0.0
        self._takeoff_alt_m: float | None = None
        self._alt_m: float | None = None
        self._on_ground = False

    @property
    def plan(self) -> StoredPlan | None:
        """The stored plan."""
        return self._plan

    @plan.setter
    def plan(self, plan: StoredPlan) -> None:
        self._plan = plan
        self._tracker = plan.tracker()

    def on_sent(self, message: MAVLinkMessage) -> None:
        """Note the altitude of a take-off that is commanded."""
        if isinstance(message, dialect.MAVLink_command_long_message) and message.command in _TAKEOFFS:
            self._takeoff_alt_m = message.param7  # PX4: above mean sea level; NaN: its own default

    def on_mode(self, custom_mode: int) -> None:
        """Process the newest mode that is commanded or has followed: a mission begins anew when its mode is
        entered.
        """
        modes = self._firmware.modes
        before, self._mode = self._mode, custom_mode
        if custom_mode == before:
            return
        if custom_mode == modes[Mode.MISSION]:
            self._complete, self._reached = False, -1
            self._tracker = None if self._plan is None else self._plan.tracker()
        elif custom_mode == modes[Mode.RETURN]:
            self._landing_reported = False

    @property
    def _in_mission(self) -> bool:
        return self._mode == self._firmware.modes[Mode.MISSION]

    def on_text(self, text: str) -> None:
        """Process a text of the autopilot."""
        self._landing_reported = self._landing_reported or text.startswith(_LANDING_TEXTS)

    def on_mission_message(self, message: MAVLinkMessage, time_us: int) -> None:
        """Process a MISSION_CURRENT or MISSION_ITEM_REACHED."""
        if self._tracker is not None:
            self._tracker.on_message(message, time_us)
        if isinstance(message, dialect.MAVLink_mission_item_reached_message):
            self._reached = max(self._reached, message.seq)
        elif isinstance(message, dialect.MAVLink_mission_current_message):
            self._current, self._total = message.seq, message.total
            self._complete = self._in_mission and message.mission_state == dialect.MISSION_STATE_COMPLETE

    def on_position(self, lat_deg: float, lon_deg: float, alt_m: float, time_us: int) -> None:
        """Process a position."""
        self._alt_m = alt_m
        if self._tracker is not None and self._in_mission:
            self._tracker.on_position(lat_deg, lon_deg, alt_m, time_us)

    def on_landed_state(self, landed_state: int) -> None:
        """Process an EXTENDED_SYS_STATE."""
        self._on_ground = landed_state == dialect.MAV_LANDED_STATE_ON_GROUND

    def done(self, before: int, after: int) -> bool:
        """Whether the autopilot may have gone from one custom mode to the other by itself."""
        modes = self._firmware.modes
        if before == modes[Mode.MISSION]:
            return self._mission_done(after)
        if before == modes[Mode.TAKEOFF]:
            return self._risen
        if before == modes[Mode.RETURN]:
            # a QuadPlane's QRTL: it ends as RTL does, and a pilot's looks the same
            return after != modes[Mode.MISSION] or self._landing_begun
        return False

    @property
    def _landing_begun(self) -> bool:
        """Whether the autopilot's mission has gone on with its landing. A pilot who commands the mission
        resumes it where it was left.
        """
        landing = None if self._plan is None else self._plan.landing
        return self._landing_reported or (landing is not None and self._current >= landing)

    @property
    def _risen(self) -> bool:
        if self._takeoff_alt_m is None or self._alt_m is None:
            return False
        slack_m = max(_SLACK_M[self._firmware.kind], _SLACK_SHARE * self.altitude_radius_m)
        return not self._alt_m < self._takeoff_alt_m - slack_m  # also with the default altitude, NaN

    def _mission_done(self, after: int) -> bool:
        tracker = self._tracker
        if tracker is None:
            return self._complete or 0 < self._total <= self._reached + 1
        returning = self._firmware.modes[Mode.RETURN]
        if after in (returning, *self._firmware.modes_instead.get(returning, ())):
            if dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH in self._last_commands:
                return tracker.coming_down or tracker.at_the_last_place
            if self._ends_in_hold:
                return False
        if tracker.lands:
            return tracker.finished or self._on_ground
        return tracker.over or tracker.at_the_last_place

    @property
    def _ends_in_hold(self) -> bool:
        """Whether the autopilot holds at the end of a mission (PX4), and returns only by an item."""
        modes = self._firmware.modes
        return modes[Mode.HOLD] in self._firmware.modes_following.get(modes[Mode.MISSION], ())

    @property
    def _last_commands(self) -> tuple[int, ...]:
        """Command of the last step; empty: there is none."""
        return tuple(step.command for step in self._plan.steps[-1:]) if self._plan is not None else ()
