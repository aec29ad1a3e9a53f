"""Monitoring of the geofence: which walls are enabled, which are breached, and when a breach is a new one.

Source: PX4 1.16 navigator/geofence, ArduPilot 4.6 AC_Fence (check, backup fences, auto-enable).
"""

import math
from typing import Final

from autopilot_bridge.commander.events import Event, FenceBreached, FenceSwitched
from autopilot_bridge.commander.geofence import Geofence
from autopilot_bridge.commander.geofence_parameters import AutoEnable, FenceParameters, FenceType
from autopilot_bridge.mission_plan import MissionStore
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.vectors import Vector

_NOTHING: Final = FenceType(0)
_MAX_COUNT: Final = 65500  # ArduPilot's counter stops there
_TAKEN_OFF_M: Final = 2.0


class FenceWatch:
    """The state of the geofence of one vehicle.

    Args:
        plan: the store of the uploaded fence.

    Attributes:
        geofence: the walls.
        broken: the walls that the vehicle is outside of now.
        breaches: number of new breaches so far.
        breach_time_us: time of the newest breach.
        distance_m: how far outside the height limits and the circle the vehicle is.
    """

    def __init__(self, plan: MissionStore) -> None:
        self.geofence = Geofence(plan)
        self.broken = _NOTHING
        self.breaches = 0
        self.breach_time_us = 0
        self.distance_m = 0.0
        self._off = _NOTHING
        self._auto_on = False
        self._above_floor = False
        self._armed = False
        self._backup_m: dict[FenceType, float] = {}
        self._home: Vector | None = None

    def present(self, parameters: FenceParameters) -> bool:
        """A geofence is set up, enabled or not."""
        return parameters.has_cylinder or (parameters.shapes and self.geofence.uploaded)

    def enabled(self, parameters: FenceParameters) -> bool:
        """The geofence is enabled."""
        return bool(self.active(parameters))

    def active(self, parameters: FenceParameters) -> FenceType:
        """The walls that are enabled now."""
        if not (parameters.enabled or self._auto_on):
            return _NOTHING
        return parameters.walls & ~self._off

    def switch(self, walls: FenceType, *, on: bool) -> None:
        """Switch some of the walls (DO_FENCE_ENABLE), until they are switched again."""
        self._off = self._off & ~walls if on else self._off | walls

    def forget_switches(self) -> None:
        """Only the parameters decide which walls are enabled."""
        self._off = _NOTHING
        self._auto_on = False

    def allows(self, place_ned_m: Vector, frame: LocalFrame | None, parameters: FenceParameters) -> bool:
        """True when a position is inside all enabled walls."""
        walls = self.active(parameters)
        return not self.geofence.broken(place_ned_m, self._home, frame, parameters, walls)

    def update(
        self,
        place_ned_m: Vector | None,
        home_ned_m: Vector | None,
        frame: LocalFrame | None,
        parameters: FenceParameters,
        *,
        time_us: int,
        armed: bool,
        airborne: bool,
        landing: bool,
    ) -> list[Event]:
        """Check the vehicle's position (None: not known, nothing changes); returns the events."""
        events: list[Event] = []
        self._home = home_ned_m
        if not (self.broken or self._auto_on or self.present(parameters)):
            self._armed = armed
            return events
        height_m = -math.inf
        if place_ned_m is not None and home_ned_m is not None:
            height_m = home_ned_m[2] - place_ned_m[2]
        self._switch_itself(events, parameters, time_us, armed, airborne, landing, height_m)
        if not airborne or landing:
            self._above_floor = False
        elif height_m > parameters.height_min_m:
            self._above_floor = True
        walls = self.active(parameters)
        if not self._above_floor:
            walls &= ~FenceType.HEIGHT_MIN
        if not walls:
            self.broken, self.distance_m = _NOTHING, 0.0
            self._backup_m.clear()
            return events
        if place_ned_m is None:
            return events
        broken = self.geofence.broken(place_ned_m, home_ned_m, frame, parameters, walls)
        beyond = _beyond(place_ned_m, home_ned_m, parameters, broken)
        new = (broken & ~self.broken) | self._backups(broken, beyond)
        self._set_backups(new, broken, beyond, parameters)
        self.distance_m = max(beyond.values(), default=0.0)
        self.broken = broken
        if new:
            self.breaches = min(_MAX_COUNT, self.breaches + 1)
            self.breach_time_us = time_us
            if parameters.counts_breaches and armed:
                events.append(FenceBreached(time_us=time_us, walls=int(new)))
        return events

    def _backups(self, broken: FenceType, beyond: dict[FenceType, float]) -> FenceType:
        """Walls that are breached again, farther out."""
        again = _NOTHING
        for wall, limit_m in self._backup_m.items():
            if wall in broken and beyond.get(wall, 0.0) >= limit_m:
                again |= wall
        return again

    def _set_backups(
        self, new: FenceType, broken: FenceType, beyond: dict[FenceType, float], p: FenceParameters
    ) -> None:
        for wall in list(self._backup_m):
            if wall not in broken:
                del self._backup_m[wall]
        for wall, away_m in beyond.items():
            step_m = p.backup_radius_m if wall is FenceType.CIRCLE else p.backup_height_m
            if wall in new and step_m > 0.0:
                self._backup_m[wall] = away_m + step_m

    def _switch_itself(
        self,
        events: list[Event],
        parameters: FenceParameters,
        time_us: int,
        armed: bool,
        airborne: bool,
        landing: bool,
        height_m: float,
    ) -> None:
        """Switch the geofence automatically (FENCE_AUTOENABLE)."""
        rule, before = parameters.auto_enable, self._auto_on
        if rule is AutoEnable.OFF or parameters.enabled:
            self._auto_on = False
            self._armed = armed
            return
        if not armed:
            self._auto_on = False
        elif rule is AutoEnable.WHEN_ARMED:
            self._auto_on = self._auto_on or not self._armed
        elif landing and rule is AutoEnable.ON_TAKEOFF:
            self._auto_on = False
        elif airborne and height_m > _TAKEN_OFF_M and not landing:
            self._auto_on = True
        self._armed = armed
        if self._auto_on is not before:
            walls = int(parameters.walls & ~self._off)
            events.append(FenceSwitched(time_us=time_us, walls=walls, on=self._auto_on))


def _beyond(
    place: Vector, home: Vector | None, parameters: FenceParameters, broken: FenceType
) -> dict[FenceType, float]:
    """How far outside each breached wall of the cylinder a position is, m."""
    if home is None:
        return {}
    height_m = home[2] - place[2]
    away = {
        FenceType.CIRCLE: math.hypot(place[0] - home[0], place[1] - home[1]) - parameters.radius_m,
        FenceType.HEIGHT_MAX: height_m - parameters.height_max_m,
        FenceType.HEIGHT_MIN: parameters.height_min_m - height_m,
    }
    return {wall: distance_m for wall, distance_m in away.items() if wall in broken}
