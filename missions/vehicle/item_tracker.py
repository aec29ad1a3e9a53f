"""Progress of a vehicle in an uploaded mission, from messages that may be lost, repeated or reordered.

Sans-IO: `ItemTracker` uses MISSION_ITEM_REACHED, MISSION_CURRENT and positions. Each of them is sufficient
evidence alone:

* MISSION_ITEM_REACHED: the item and all items before it are done. PX4 1.16.1 and ArduPilot 4.6.3 send it for
  a DO_ item, and do not send it for the waypoint directly before that item; PX4 repeats the newest one at 1
  Hz, ten times.
* MISSION_CURRENT: all items before the one that is flown to are done. ArduPilot also reports when all are
  done.
* Positions: a waypoint is done when the vehicle was within its radius and left it, or when it has stayed
  there.

The place in the mission never goes back: evidence of an earlier place is ignored.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.wire_units import place_of
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, RELATIVE_FRAMES
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

LAST_NAV: Final = dialect.MAV_CMD_NAV_LAST
"""Commands up to this one are flown; later ones are executed on the way."""
LANDINGS: Final = frozenset((dialect.MAV_CMD_NAV_LAND, dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH))
"""Commands that bring the vehicle to the ground and end a mission."""
THROUGH: Final = frozenset((dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_CMD_NAV_SPLINE_WAYPOINT))
"""Commands that contain a place to pass."""

_TAKEOFF: Final = dialect.MAV_CMD_NAV_TAKEOFF
_DO_JUMP: Final = dialect.MAV_CMD_DO_JUMP
_MOST_STEPS: Final = 20_000
_SETTLED_S: Final = 5.0
_CLIMBED_M: Final = 1.0  # below a takeoff's altitude; above this height the takeoff is about to end
_CIRCLE_M: Final = 80.0
_NO_MISSION: Final = 0xFFFF  # MISSION_CURRENT.seq
_HEARTBEATS_AWAY: Final = 3
_LEAST_M_PER_DEG: Final = 100_000.0  # of latitude, below the true 110,574 m: rejects distant positions
_STARTED: Final = (dialect.MISSION_STATE_ACTIVE, dialect.MISSION_STATE_PAUSED)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownOrder:
    """The items of a mission in the order in which they are executed; jumps are followed.

    Attributes:
        indices: indices of the items, without the jumps; they end with the first landing or return.
        endless: whether a jump repeats forever, or gives more than 20000 items in total.
        again_from: place in `indices` from which an endless mission repeats; None: not known.
    """

    indices: tuple[int, ...]
    endless: bool = False
    again_from: int | None = None

    @classmethod
    def of(cls, items: Sequence[MissionItem]) -> "FlownOrder":
        """The order of a mission's items; DO_JUMP contains its target's index in `items`."""
        indices: list[int] = []
        repeats: dict[int, int] = {}
        index = 0
        for _ in range(_MOST_STEPS):
            if not 0 <= index < len(items):
                return cls(indices=tuple(indices))
            item = items[index]
            if item.command == _DO_JUMP:
                done = repeats.get(index, 0)
                if item.param2 < 0:
                    target = int(item.param1)
                    again = max((k for k, i in enumerate(indices) if i == target), default=None)
                    return cls(indices=tuple(indices), endless=True, again_from=again)
                if done < item.param2:
                    repeats[index] = done + 1
                    index = int(item.param1)
                    continue
            else:
                indices.append(index)
                if item.command in LANDINGS:
                    return cls(indices=tuple(indices))
            index += 1
        return cls(indices=tuple(indices), endless=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionStep:
    """One item at one place of the flown order.

    Attributes:
        index: index of the item.
        command: MAV_CMD of the item.
        place: position at which the item is done; None: positions do not show that it is done.
        radius_m: radius of the place; infinite: any position that is not lower than the place counts.
        stay_s: time within the radius after which the item counts as done; infinite: only messages show that
            it is done.
        through: the item is done when the vehicle was within the radius and left it.
    """

    index: int
    command: int = dialect.MAV_CMD_NAV_WAYPOINT
    place: GeodeticPosition | None = None
    radius_m: float = 0.0
    stay_s: float = math.inf
    through: bool = False
    _frame: LocalFrame | None = field(init=False, repr=False, compare=False, default=None)

    def __post_init__(self) -> None:
        if self.place is not None:
            object.__setattr__(self, "_frame", LocalFrame(self.place))

    @property
    def flown(self) -> bool:
        """Whether the item is flown, and not executed on the way."""
        return self.command <= LAST_NAV

    def contains(self, lat_deg: float, lon_deg: float, alt_m: float) -> bool:
        """Whether a position is within the radius."""
        if self.place is None or self._frame is None:
            return False
        if math.isinf(self.radius_m):
            return alt_m >= self.place.alt_m
        if abs(lat_deg - self.place.lat_deg) * _LEAST_M_PER_DEG > self.radius_m:
            return False
        return math.hypot(*self._frame.ned_from_geodetic(lat_deg, lon_deg, alt_m)) <= self.radius_m


def mission_steps(
    items: Sequence[MissionItem], order: FlownOrder, home: GeodeticPosition, acceptance_m: float
) -> tuple[MissionStep, ...]:
    """The steps of a mission, for an `ItemTracker`.

    Args:
        items: items with their places set (0, 0 is not a place).
        order: order of the items.
        home: reference of heights in relative frames.
        acceptance_m: radius of a waypoint that specifies none, or a smaller one.
    """
    return tuple(_step(index, items[index], home, acceptance_m) for index in order.indices)


def _step(index: int, item: MissionItem, home: GeodeticPosition, acceptance_m: float) -> MissionStep:
    placed = math.isfinite(item.x + item.y + item.z) and (item.x, item.y) != (0.0, 0.0)
    through = item.command in THROUGH
    if item.command == dialect.MAV_CMD_NAV_LOITER_UNLIM:  # no vehicle reports it as reached
        radius_m, stay_s = 1.5 * abs(item.param3 or _CIRCLE_M) + 20.0, 0.0
    elif through:
        wait_s = item.param1 if item.param1 > 0.0 else 0.0
        through = wait_s == 0.0
        own_m = item.param2 if math.isfinite(item.param2) else 0.0
        radius_m, stay_s = max(acceptance_m, own_m), wait_s + _SETTLED_S
    elif item.command == _TAKEOFF:
        radius_m, stay_s = math.inf, _SETTLED_S
    else:
        placed = False
    if not placed or item.frame not in GLOBAL_FRAMES | RELATIVE_FRAMES:
        return MissionStep(index=index, command=item.command)
    alt_m = item.z if item.frame in GLOBAL_FRAMES else home.alt_m + item.z
    if item.command == _TAKEOFF:
        alt_m -= _CLIMBED_M
    place = GeodeticPosition(lat_deg=item.x, lon_deg=item.y, alt_m=alt_m)
    return MissionStep(
        index=index, command=item.command, place=place, radius_m=radius_m, stay_s=stay_s, through=through
    )


class ItemTracker:
    """Follows a mission; see the module.

    Args:
        steps: steps of the mission, in the order of execution.
        again_from: step from which an endless mission repeats; None: it does not.
        first: sequence number of item 0 on the link.

    Attributes:
        behind: number of finished steps. It never decreases; in an endless mission it exceeds the number of
            steps.
        reached: item and time of each finished step, in order.
    """

    def __init__(
        self, steps: Sequence[MissionStep], again_from: int | None = None, *, first: int = 0
    ) -> None:
        self.first = first
        self.behind = 0
        self.reached: list[tuple[int, int]] = []
        self._steps = tuple(steps)
        self._again_from = again_from
        self._near_us: int | None = None
        self._started = False
        self._ahead = self._next_flown()

    @property
    def current(self) -> int:
        """Index of the item that is being flown; the last one when all are done."""
        return self._step(min(self.behind, self._end - 1)).index if self._steps else 0

    @property
    def finished(self) -> bool:
        """Whether all steps are done; never with an endless mission."""
        return self._again_from is None and self.behind >= len(self._steps)

    @property
    def over(self) -> bool:
        """Whether all items that are flown are done; items that are only executed at the end may remain."""
        rest = self._steps[self.behind :]
        return self._again_from is None and not any(step.flown for step in rest)

    @property
    def coming_down(self) -> bool:
        """Whether a landing or return at the mission's end is in progress or done."""
        return self.lands and self.behind >= len(self._steps) - 1

    @property
    def at_the_last_place(self) -> bool:
        """Whether the vehicle was within the radius of the last waypoint, and no other item is left."""
        if self._again_from is not None or self._near_us is None:
            return False
        rest = [step for step in self._steps[self.behind :] if step.flown and step.command not in LANDINGS]
        return len(rest) == 1 and rest[0].through

    @property
    def lands(self) -> bool:
        """Whether the mission ends on the ground."""
        ends = bool(self._steps) and self._steps[-1].command in LANDINGS
        return ends and self._again_from is None

    def place_of(self, index: int) -> int:
        """The first step of an item, or of the item after it if it has no step (a jump)."""
        return next((k for k, step in enumerate(self._steps) if step.index >= index), len(self._steps) - 1)

    def on_message(self, message: MAVLinkMessage, time_us: int) -> None:
        """Process a MISSION_ITEM_REACHED, MISSION_CURRENT or GLOBAL_POSITION_INT."""
        if isinstance(message, dialect.MAVLink_mission_item_reached_message):
            self.on_reached(message.seq - self.first, time_us)
        elif isinstance(message, dialect.MAVLink_mission_current_message):
            self.on_current(message.seq - self.first, time_us, message.mission_state)
        elif isinstance(message, dialect.MAVLink_global_position_int_message):
            at = place_of(message)
            if at is not None:
                self.on_position(at.lat_deg, at.lon_deg, at.alt_m, time_us)

    def on_reached(self, index: int, time_us: int) -> None:
        """Process a MISSION_ITEM_REACHED; the index counts from 0."""
        if self.behind and self._step(self.behind - 1).index == index:
            return  # repeated
        place = self._place_of(index)
        if place is not None:
            self._go_to(place + 1, time_us)

    def on_current(self, index: int, time_us: int, state: int = 0) -> None:
        """Process a MISSION_CURRENT; the index counts from 0, `state` is its MISSION_STATE (0: not known)."""
        # before that, "complete" refers to the previous flight
        self._started = self._started or state in _STARTED
        if state == dialect.MISSION_STATE_COMPLETE and self._started and self._again_from is None:
            self._go_to(len(self._steps), time_us)
            return
        place = self._place_of(index)
        if place is not None:
            self._go_to(place, time_us)

    def on_position(self, lat_deg: float, lon_deg: float, alt_m: float, time_us: int) -> None:
        """Process a position."""
        place, step = self._ahead
        if step is None or step.place is None:
            return
        if step.contains(lat_deg, lon_deg, alt_m):
            if self._near_us is None:
                self._near_us = time_us
            if time_us - self._near_us >= step.stay_s * 1e6:
                self._go_to(place + 1, self._near_us)
        elif self._near_us is not None:
            near_us, self._near_us = self._near_us, None
            if step.through:
                self._go_to(place + 1, near_us)

    def _next_flown(self) -> tuple[int, MissionStep | None]:
        """The next step that is flown, and its place in the order; None: there is none."""
        ahead = ((place, self._step(place)) for place in range(self.behind, self._end))
        return next(((place, step) for place, step in ahead if step.flown), (self._end, None))

    @property
    def _end(self) -> int:
        """End of the steps that are considered; an endless mission has one more round ahead."""
        count = len(self._steps)
        return count if self._again_from is None else max(count, self.behind) + count - self._again_from

    def _step(self, place: int) -> MissionStep:
        count = len(self._steps)
        if place < count or self._again_from is None:
            return self._steps[place]
        return self._steps[self._again_from + (place - count) % (count - self._again_from)]

    def _place_of(self, index: int) -> int | None:
        """The step ahead to which a message about an item refers; None: there is none, or the message is old.

        When jumps repeat an item, the message may refer to a finished step; the nearer step is used.
        """
        now = self.behind
        ahead = next((k for k in range(now, self._end) if self._step(k).index == index), None)
        if ahead is None:
            last = max((step.index for step in self._steps), default=index)
            beyond = self._again_from is None and last < index < _NO_MISSION - self.first
            return len(self._steps) if beyond else None
        oldest = max(0, now - len(self._steps))
        done = next((k for k in range(now - 1, oldest - 1, -1) if self._step(k).index == index), None)
        return None if done is not None and now - done <= ahead - now else ahead

    def _go_to(self, place: int, time_us: int) -> None:
        if place <= self.behind:
            return
        self.reached += [(self._step(k).index, time_us) for k in range(self.behind, place) if k < self._end]
        self.behind = place
        self._near_us = None
        self._ahead = self._next_flown()


class MissionModeWatch:
    """Detects that a vehicle has left the mission's mode, by three consecutive heartbeats.

    The message that explains another mode (the end of the mission) may come shortly after the first of them.
    """

    def __init__(self, mission_mode: int) -> None:
        self._mission_mode = mission_mode
        self._away = 0

    def left(self, custom_mode: int) -> bool:
        """Process a heartbeat; returns whether it is the third in a row outside the mission's mode."""
        self._away = 0 if custom_mode == self._mission_mode else self._away + 1
        return self._away >= _HEARTBEATS_AWAY
