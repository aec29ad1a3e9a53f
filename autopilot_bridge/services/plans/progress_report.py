"""The progress of the mission being flown: MISSION_CURRENT and MISSION_ITEM_REACHED."""

from collections.abc import Mapping
from typing import Final, Protocol

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mission_plan import MissionStore, MissionType
from autopilot_bridge.services.channel import Broadcast, send_to_all
from autopilot_bridge.services.plans.messages import current_message, send_extended
from autopilot_bridge.services.plans.policy import MissionPolicy

REPEAT_INTERVAL_US: Final = 1_000_000
_MODE_FLYING: Final = 1
_MODE_UNKNOWN: Final = 0  # observed from ArduPilot outside AUTO


class MissionProgress(Protocol):
    """The task that flies missions, as the mission protocol sees it (`MissionStore.current` is the item)."""

    @property
    def active(self) -> bool:
        """The mission is being flown (mission mode, armed or not)."""
        ...

    @property
    def complete(self) -> bool:
        """The last item was finished, and the mission mode was not left since."""
        ...


class NoProgress:
    """The progress without a task that flies missions."""

    active = False
    complete = False


class MissionReport:
    """Sends the progress of a mission on all channels."""

    def __init__(
        self,
        policy: MissionPolicy,
        stores: Mapping[MissionType, MissionStore],
        broadcast: Broadcast,
        progress: MissionProgress,
    ) -> None:
        self._policy = policy
        self._stores = stores
        self._mission = stores[MissionType.MISSION]
        self._broadcast = broadcast
        self._progress = progress
        self._announced = (self._mission.current, self._mission.version)
        self._reached = -1
        self._unsent = False
        self._repeats_left = 0
        self._repeat_at_us = 0

    def current_message(self) -> MAVLinkMessage:
        """MISSION_CURRENT with the present state."""
        mission = self._mission
        count = len(mission.items)
        total = count - 1 if self._policy.home_is_item_0 else count
        ids = (
            [
                self._stores[kind].plan_id
                for kind in (MissionType.MISSION, MissionType.FENCE, MissionType.RALLY)
            ]
            if self._policy.plan_ids
            else [0, 0, 0]
        )
        return current_message(
            seq=max(0, min(mission.current, 65535)),
            total=total if total > 0 else self._policy.total_when_empty,
            state=self._state(total) if self._policy.mission_state else 0,
            mode=_MODE_FLYING if self._policy.mission_state and self._progress.active else _MODE_UNKNOWN,
            mission_id=ids[0],
            fence_id=ids[1],
            rally_id=ids[2],
        )

    def item_reached(self, seq: int) -> None:
        """An item is finished; the next `tick` reports it.

        Of items that are finished at the same time only the last is reported: a waypoint directly before a
        DO_ item is not reported, as in both firmwares.
        """
        self._reached = seq
        self._unsent = True

    def forget_reached(self) -> None:
        """Do not report items of the old plan: a new plan is being uploaded."""
        self._unsent = False
        self._repeats_left = 0

    def tick(self, time_us: int) -> None:
        mission = self._mission
        state = (mission.current, mission.version)
        if state != self._announced:
            self._announced = state
            if self._policy.sends_current_on_change and mission.items:
                for channel in self._broadcast.channels:
                    send_extended(channel, self.current_message())
        if self._unsent:
            self._unsent = False
            self._repeats_left = self._policy.reached_repeats
            self._repeat_at_us = time_us + REPEAT_INTERVAL_US
            send_to_all(self._broadcast, dialect.MAVLink_mission_item_reached_message(self._reached))
        elif self._repeats_left and time_us >= self._repeat_at_us:
            self._repeats_left -= 1
            self._repeat_at_us += REPEAT_INTERVAL_US
            send_to_all(self._broadcast, dialect.MAVLink_mission_item_reached_message(self._reached))

    def _state(self, total: int) -> int:
        if total <= 0:
            return int(dialect.MISSION_STATE_NO_MISSION)
        if not self._progress.active:
            return int(dialect.MISSION_STATE_NOT_STARTED)
        if self._progress.complete:
            return int(dialect.MISSION_STATE_COMPLETE)
        return int(dialect.MISSION_STATE_ACTIVE)
