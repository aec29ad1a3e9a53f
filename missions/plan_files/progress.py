"""How far a vehicle has come in an uploaded mission file, by what it says."""

import math
from typing import Any, Final

from autopilot_bridge.geodesy import LocalFrame
from missions import telemetry
from missions.errors import MissionError, VehicleTimeout
from missions.notes import PATTERN
from missions.plan_files.document import (
    DO_JUMP,
    NAV_LAND,
    NAV_LOITER_UNLIM,
    NAV_RETURN_TO_LAUNCH,
    MissionDocument,
)
from missions.plan_files.route import Route, Stop, has_curves
from missions.vehicle.adapter import Mode
from missions.vehicle.vehicle import Vehicle

_LAST_NAV: Final = 95
_HEARTBEATS_AWAY: Final = 3
_CIRCLE_M: Final = 80.0
_NAMES: Final = ("MISSION_ITEM_REACHED", "MISSION_CURRENT", "HEARTBEAT", "GLOBAL_POSITION_INT")


class MissionWatch:
    """Follows a mission from its start to its end; notes which items were reached, and the phases.

    Args:
        vehicle: flies it.
        document, route: what is flown.
        scored: the places a track is compared with.
        first: number of the mission's first item on the wire.
    """

    def __init__(
        self, vehicle: Vehicle, document: MissionDocument, route: Route, scored: tuple[Stop, ...], first: int
    ) -> None:
        items = document.items
        self._vehicle, self._document, self._first = vehicle, document, first
        self._endless = route.endless
        self._stops = tuple(stop for stop in route.stops if stop.command != NAV_LAND)
        self._scored_from = scored[0].index if scored else -1
        self._phase = "mission" if has_curves(scored) else PATTERN
        self._jumps = any(item.command == DO_JUMP for item in items)
        self._final = max(
            (
                k
                for k, item in enumerate(items)
                if item.command <= _LAST_NAV and item.command not in (NAV_LAND, NAV_RETURN_TO_LAUNCH)
            ),
            default=-1,
        )
        self._done = 0  # places of the route that were reached
        self._current = 0
        self._highest = -1
        self._away = 0

    async def until_the_end(self, limit_s: float) -> bool:
        """Wait until all is flown: the last place, or the ground where the mission lands.

        Raises:
            MissionError: the vehicle left the mission.
            VehicleTimeout: it took too long.
        """
        vehicle = self._vehicle
        with vehicle.messages(*_NAMES) as stream:
            try:
                async with vehicle.deadline(limit_s, self._awaited):
                    async for message in stream:
                        if self._take(message):
                            return True
            except TimeoutError:
                raise VehicleTimeout(
                    f"no {self._awaited()} within {limit_s:.0f} s; {vehicle.heard()}"
                ) from None
        return False

    def _awaited(self) -> str:
        return f"end of the mission ({self._here()} of {len(self._document.items)})"

    def _here(self) -> str:
        return self._document.item_name(self._current)

    @property
    def _flown(self) -> bool:
        coming_down = self._document.items[self._current].command in (NAV_LAND, NAV_RETURN_TO_LAUNCH)
        if coming_down and self._current > self._final:
            return True
        return self._done >= len(self._stops) and self._highest >= self._final and not self._endless

    def _take(self, message: Any) -> bool:
        kind = message.get_type()
        if kind == "HEARTBEAT":
            return self._heartbeat(message)
        if kind == "MISSION_ITEM_REACHED":
            self._reached(message.seq - self._first)
        elif kind == "MISSION_CURRENT":
            self._goes_to(message.seq - self._first)
        elif self._stays_here():
            self._reached(self._current)
        return self._flown and not self._document.lands

    def _goes_to(self, index: int) -> None:
        """Items before the one it goes to were reached, also those whose message was lost."""
        if not 0 <= index < len(self._document.items):
            return
        self._current = index
        while not self._jumps and self._done < len(self._stops) and self._stops[self._done].index < index:
            self._reached(self._stops[self._done].index)

    def _reached(self, index: int) -> None:
        notes, clock = self._vehicle.notes, self._vehicle.clock
        items = self._document.items
        if not 0 <= index < len(items):
            return
        again = bool(notes.reached) and notes.reached[-1][0] == index  # PX4 repeats each for ten seconds
        if again or (not self._jumps and index <= self._highest):
            return
        notes.reached.append((index, clock.stamp_us))
        self._highest = max(self._highest, index)
        notes.progress = min(1.0, (index + 1) / len(items))
        ahead = (k for k in range(self._done, len(self._stops)) if self._stops[k].index == index)
        self._done = next(ahead, self._done - 1) + 1  # messages may have been lost: places between are done
        if index == self._scored_from and notes.current == "takeoff":
            notes.begin(self._phase, clock.stamp_us)
        if self._flown and notes.current == self._phase:
            notes.begin("return", clock.stamp_us)

    def _heartbeat(self, message: Any) -> bool:
        vehicle = self._vehicle
        modes = vehicle.adapter.modes
        if not vehicle.armed and not vehicle.may_be_armed:
            if self._flown and self._document.lands:
                return True
            raise MissionError(f"the vehicle disarmed at {self._here()}; {vehicle.heard()}")
        if message.custom_mode == modes[Mode.MISSION]:
            self._away = 0
            return False
        if message.custom_mode == modes[Mode.RETURN] and self._flown and self._document.lands:
            return True  # the mission's own return
        self._away += 1
        if self._away < _HEARTBEATS_AWAY:
            return False
        mode = vehicle.adapter.mode_name(message.custom_mode)
        raise MissionError(
            f"the vehicle left the mission for mode {mode} at {self._here()}; {vehicle.heard()}"
        )

    def _stays_here(self) -> bool:
        """Whether it has come to a place to stay at for ever, which no vehicle calls reached."""
        item = self._document.items[self._current]
        if item.command != NAV_LOITER_UNLIM:
            return False
        stop = next((s for s in self._stops if s.index == self._current), None)
        position = self._vehicle.latest(telemetry.Position)
        if stop is None or position is None:
            return False
        north, east, _ = LocalFrame(self._vehicle.home).ned_from_geodetic(
            position.lat_deg, position.lon_deg, position.alt_m
        )
        away_m = math.hypot(north - stop.position_ned_m[0], east - stop.position_ned_m[1])
        return away_m < 1.5 * abs(item.param3 or _CIRCLE_M) + 20.0
