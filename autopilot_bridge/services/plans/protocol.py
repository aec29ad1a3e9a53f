"""The MAVLink mission protocol, autopilot side, of PX4 and ArduPilot.

Source: MAVLink mission protocol (mavlink.io/en/services/mission.html); `MissionPolicy` holds the differences
between the firmwares. Missions, fences and rally points share the protocol, each with its own store.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from autopilot_bridge.commander.events import Event, MissionItemReached
from autopilot_bridge.dispatch import receives, streams
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.mission_wire import item_from_message
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Announce, Broadcast, Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.plans.download import MissionDownloads
from autopilot_bridge.services.plans.messages import (
    ack_message,
    extended_payload,
    plan_checksum,
    send_extended,
)
from autopilot_bridge.services.plans.policy import CRITICAL, INFO, MissionPolicy, Text
from autopilot_bridge.services.plans.progress_report import MissionProgress, MissionReport, NoProgress
from autopilot_bridge.services.plans.rules import fence_excludes
from autopilot_bridge.services.plans.sessions import Sessions, mission_type_of
from autopilot_bridge.services.plans.upload import MissionUploads
from flightsim.foundation.geodesy import GeodeticPosition


class _Judged(NamedTuple):
    """The inputs of a feasibility check of the stored mission."""

    version: int
    landed: bool
    home_alt_m: float | None
    fence: object


class FenceJudge(Protocol):
    """Checks whether the items of a mission stay inside the geofence."""

    @property
    def state(self) -> object:
        """A value that stays equal as long as the answers stay the same."""
        ...

    def excludes(self, item: MissionItem) -> bool:
        """True when a position of the item lies outside."""
        ...


HomeOf = Callable[[], GeodeticPosition | None]
_GUIDED_ITEM = 2  # MISSION_ITEM.current of a guided-mode target
_PROBLEMS_REPORTED = 3  # a mission at a wrong place has one problem for each item


def new_stores() -> dict[MissionType, MissionStore]:
    """An empty store for each mission type."""
    return {mission_type: MissionStore() for mission_type in MissionType}


class MissionService(Microservice):
    """Uploads, downloads, clearing and progress of an autopilot's plans.

    Args:
        policy: the firmware's behaviour.
        stores: one store per mission type; a plan is replaced completely or not at all.
        broadcast: all channels of the autopilot.
        announce: sends STATUSTEXTs.
        home: the home position; None while it is not set.
        progress: the task that flies missions.
        set_current: makes that task continue from another item; False: refused. The service sets
            `MissionStore.current` itself when this is None.
        on_plan_changed: called after a plan was replaced or cleared.
        on_guided_item: uses an item as a target for guided mode; False: refused (ArduPilot only).
        parameters: limits for missions of an aircraft; None: the firmware's defaults.
        fence: the fence that missions must stay inside (PX4); None: none.
        landed: whether the vehicle stands on the ground.
    """

    def __init__(
        self,
        policy: MissionPolicy,
        stores: Mapping[MissionType, MissionStore],
        broadcast: Broadcast,
        announce: Announce,
        *,
        home: HomeOf,
        progress: MissionProgress | None = None,
        set_current: Callable[[int], bool] | None = None,
        on_plan_changed: Callable[[MissionType], None] | None = None,
        on_guided_item: Callable[[MissionItem], bool] | None = None,
        parameters: ParameterStore | None = None,
        fence: FenceJudge | None = None,
        landed: Callable[[], bool] = lambda: True,
    ) -> None:
        self._policy = policy
        self._stores = dict(stores)
        self._announce = announce
        self._home = home
        self._progress: MissionProgress = progress if progress is not None else NoProgress()
        self._set_current = set_current
        self._on_plan_changed = on_plan_changed
        self._on_guided_item = on_guided_item
        self._parameters = ParameterStore(()) if parameters is None else parameters
        self._fence = fence
        self._landed = landed
        self._sessions = Sessions()
        self._uploads = MissionUploads(policy, self._stores, self._sessions, announce, self._store_plan)
        self._downloads = MissionDownloads(policy, self._stores, self._sessions, announce, self._read_plan)
        self._report = MissionReport(policy, self._stores, broadcast, self._progress)
        self._judged: tuple[_Judged, tuple[str, ...]] | None = None
        self._parameters.subscribe(self._forget_judgement)

    @property
    def stores(self) -> Mapping[MissionType, MissionStore]:
        return self._stores

    @streams(dialect.MAVLink_mission_current_message)
    def _current(self) -> bytes | None:
        return extended_payload(self.current_message())

    def current_message(self) -> MAVLinkMessage:
        """MISSION_CURRENT with the present state, for the streams."""
        return self._report.current_message()

    def follow(self, event: Event) -> None:
        """Report an item that the flying task has finished."""
        if isinstance(event, MissionItemReached):
            self.item_reached(event.index)

    def item_reached(self, seq: int) -> None:
        """The flying task has finished an item: the next `tick` sends MISSION_ITEM_REACHED."""
        if 0 <= seq <= 65535:
            self._report.item_reached(seq)

    def problems(self, *, landed: bool = True) -> tuple[str, ...]:
        """Why the stored mission may not be flown, in the firmware's words; empty when it may."""
        feasibility = self._policy.feasibility
        if feasibility is None:
            return ()
        store, home, fence = self._stores[MissionType.MISSION], self._home(), self._fence
        home_alt_m = None if home is None else home.alt_m
        key = _Judged(store.version, landed, home_alt_m, None if fence is None else fence.state)
        if self._judged is None or self._judged[0] != key:
            problems = feasibility(
                store.items,
                self._parameters,
                home_alt_m=home_alt_m,
                landed=landed,
                outside=None if fence is None else fence.excludes,
            )
            self._judged = (key, problems)
        return self._judged[1]

    def _forget_judgement(self, name: str, value: float) -> None:
        self._judged = None  # may depend on parameters

    def has_mission(self) -> bool:
        """A mission is stored (ArduPilot's home item does not count)."""
        return len(self._stores[MissionType.MISSION].items) > int(self._policy.home_is_item_0)

    def mission_valid(self, *, landed: bool = True) -> bool:
        """A mission is stored, and it may be flown."""
        return self.has_mission() and not self.problems(landed=landed)

    def set_current(self, seq: int) -> bool:
        """Continue from item `seq`; False when there is no such item or the flying task refuses."""
        store = self._stores[MissionType.MISSION]
        if not 0 <= seq < len(store.items):
            return False
        if self._set_current is not None:
            return self._set_current(seq)
        store.current = seq
        return True

    def tick(self, time_us: int) -> None:
        self._uploads.tick(time_us)
        self._downloads.tick(time_us)
        self._report.tick(time_us)

    @receives(dialect.MAVLink_mission_count_message)
    def _on_count(self, message: dialect.MAVLink_mission_count_message, source: Source, time_us: int) -> None:
        self._report.forget_reached()
        self._uploads.on_count(message, source, time_us)

    @receives(dialect.MAVLink_mission_item_message, dialect.MAVLink_mission_item_int_message)
    def _on_item(
        self,
        message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message,
        source: Source,
        time_us: int,
    ) -> None:
        if not self._take_guided_item(message, source):
            self._uploads.on_item(message, source, time_us)

    @receives(dialect.MAVLink_mission_write_partial_list_message)
    def _on_partial(
        self, message: dialect.MAVLink_mission_write_partial_list_message, source: Source, time_us: int
    ) -> None:
        self._uploads.on_partial(message, source, time_us)

    @receives(dialect.MAVLink_mission_ack_message)
    def _on_ack(self, message: dialect.MAVLink_mission_ack_message, source: Source, time_us: int) -> None:
        self._downloads.on_ack(message, source)
        self._uploads.on_ack(message, source, time_us)

    @receives(dialect.MAVLink_mission_request_list_message)
    def _on_list(
        self, message: dialect.MAVLink_mission_request_list_message, source: Source, time_us: int
    ) -> None:
        self._downloads.on_list(message, source, time_us, uploader=self._uploads.partner)

    @receives(dialect.MAVLink_mission_request_message, dialect.MAVLink_mission_request_int_message)
    def _on_request(
        self,
        message: dialect.MAVLink_mission_request_message | dialect.MAVLink_mission_request_int_message,
        source: Source,
        time_us: int,
    ) -> None:
        self._downloads.on_request(message, source, time_us, uploader=self._uploads.partner)

    @receives(dialect.MAVLink_mission_clear_all_message)
    def _on_clear(
        self, message: dialect.MAVLink_mission_clear_all_message, source: Source, time_us: int
    ) -> None:
        uploader = self._uploads.partner
        mission_type = mission_type_of(message.mission_type)
        if self._policy.clears_all_types:
            uploading_here = uploader is not None and uploader.channel is source.channel
            if uploading_here or self._sessions.of(source.channel).download is not None:
                self._say(self._policy.texts.clear_busy)
                return
            result = dialect.MAV_MISSION_ACCEPTED
            wanted = [mission_type] if mission_type is not None else []
            if message.mission_type == dialect.MAV_MISSION_TYPE_ALL:
                wanted = list(MissionType)
        elif mission_type is None:
            result, wanted = dialect.MAV_MISSION_UNSUPPORTED, []
        elif uploader is not None or (
            mission_type is MissionType.MISSION
            and self._policy.refuses_clear_in_flight
            and self._progress.active
        ):
            result, wanted = dialect.MAV_MISSION_ERROR, []
        else:
            result, wanted = dialect.MAV_MISSION_ACCEPTED, [mission_type]
        for kind in wanted:
            self._replace(kind, (), 0)
        source.channel.send(ack_message(source, result, message.mission_type))

    @receives(dialect.MAVLink_mission_set_current_message)
    def _on_set_current(
        self, message: dialect.MAVLink_mission_set_current_message, source: Source, time_us: int
    ) -> None:
        uploader = self._uploads.partner
        texts = self._policy.texts
        session = self._sessions.of(source.channel)
        busy = session.download is not None or (uploader is not None and uploader.channel is source.channel)
        if texts.set_current_busy is not None and busy:
            self._say(texts.set_current_busy)
            return
        if message.seq >= len(self._stores[MissionType.MISSION].items):
            self._say(texts.not_in_list)
            return
        if self.set_current(message.seq) and self._policy.acks_set_current:
            send_extended(source.channel, self._report.current_message())

    def _take_guided_item(
        self,
        message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message,
        source: Source,
    ) -> bool:
        if not self._policy.guided_items or message.current != _GUIDED_ITEM or self._on_guided_item is None:
            return False
        item = item_from_message(message)
        result = self._policy.rules.check(item, MissionType.MISSION, 1, 2)
        if result == dialect.MAV_MISSION_ACCEPTED and not self._on_guided_item(item):
            result = dialect.MAV_MISSION_ERROR
        source.channel.send(ack_message(source, result, message.mission_type))
        return True

    def _read_plan(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        items = self._stores[mission_type].items
        if items and mission_type is MissionType.MISSION and self._policy.home_is_item_0:
            return (self._home_item(items[0]), *items[1:])
        return items

    def _home_item(self, otherwise: MissionItem) -> MissionItem:
        home = self._home()
        if home is None:
            return otherwise
        return MissionItem(
            command=dialect.MAV_CMD_NAV_WAYPOINT,
            frame=dialect.MAV_FRAME_GLOBAL,
            x=home.lat_deg,
            y=home.lon_deg,
            z=home.alt_m,
        )

    def _store_plan(
        self, mission_type: MissionType, items: tuple[MissionItem, ...], checksum: int, current: int
    ) -> None:
        flying = mission_type is MissionType.MISSION and self._progress.active
        if self._policy.home_is_item_0:
            self._store_ardupilot_plan(mission_type, items, flying=flying)
            return
        store = self._stores[mission_type]
        unchanged = bool(items) and checksum == store.plan_id and len(items) == len(store.items)
        if unchanged and flying:
            return  # PX4 continues when the mission being flown is uploaded again
        self._replace(mission_type, items, checksum)
        if items:
            store.current = current
        home = self._home()
        fence = mission_type is MissionType.FENCE
        if fence and home is not None and fence_excludes(items, home.lat_deg, home.lon_deg):
            self._say(self._policy.texts.home_outside_fence)
        if mission_type is not MissionType.RALLY:
            # The firmware has events for these only, which few clients show.
            for problem in self.problems(landed=self._landed())[:_PROBLEMS_REPORTED]:
                self._announce(CRITICAL, problem)

    def _store_ardupilot_plan(
        self, mission_type: MissionType, items: tuple[MissionItem, ...], *, flying: bool
    ) -> None:
        if items and mission_type is MissionType.MISSION:
            items = (self._home_item(_finite_home(items[0])), *items[1:])
        store = self._stores[mission_type]
        flown = store.current
        self._replace(mission_type, items, plan_checksum(items, mission_type))
        if flying:
            store.current = min(flown, max(0, len(items) - 1))  # the leg being flown is finished
            self._say(self._policy.texts.changed_in_flight)
        self._announce(INFO, self._policy.texts.received[mission_type])

    def _replace(self, mission_type: MissionType, items: tuple[MissionItem, ...], plan_id: int) -> None:
        self._stores[mission_type].replace(items, plan_id)
        if self._on_plan_changed is not None:
            self._on_plan_changed(mission_type)

    def _say(self, text: Text) -> None:
        if text is not None:
            self._announce(*text)


def _finite_home(item: MissionItem) -> MissionItem:
    """Item 0 as uploaded, used until home is known; its values were not checked."""
    good = all(math.isfinite(value) for value in (item.x, item.y, item.z))
    x, y, z = (item.x, item.y, item.z) if good else (0.0, 0.0, 0.0)
    return MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, frame=dialect.MAV_FRAME_GLOBAL, x=x, y=y, z=z)
