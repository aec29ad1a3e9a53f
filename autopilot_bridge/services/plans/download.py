"""Sending a plan: MISSION_REQUEST_LIST, MISSION_REQUEST(_INT) and the closing MISSION_ACK.

PX4 opens a list and sends its items in order; ArduPilot answers each request independently.
"""

from collections.abc import Callable

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.mission_wire import item_message
from autopilot_bridge.services.channel import Announce, Source
from autopilot_bridge.services.plans.messages import ack_message, count_message, send_extended
from autopilot_bridge.services.plans.policy import MissionPolicy, Text
from autopilot_bridge.services.plans.sessions import Download, Sessions, mission_type_of, same_partner

ReadPlan = Callable[[MissionType], tuple[MissionItem, ...]]
"""Returns the plan of a type as it is sent, home included if the firmware sends it."""


class MissionDownloads:
    """The sending half of the mission protocol."""

    def __init__(
        self,
        policy: MissionPolicy,
        stores: dict[MissionType, MissionStore],
        sessions: Sessions,
        announce: Announce,
        read_plan: ReadPlan,
    ) -> None:
        self._policy = policy
        self._stores = stores
        self._sessions = sessions
        self._announce = announce
        self._read_plan = read_plan

    def on_list(
        self,
        message: dialect.MAVLink_mission_request_list_message,
        source: Source,
        time_us: int,
        *,
        uploader: Source | None,
    ) -> None:
        mission_type = mission_type_of(message.mission_type)
        if self._policy.ordered_download:
            self._open_list(message, mission_type, source, time_us, uploader)
        elif uploader is not None:
            self._ack(source, dialect.MAV_MISSION_DENIED, message.mission_type)
        elif mission_type is None:
            self._ack(source, dialect.MAV_MISSION_UNSUPPORTED, message.mission_type)
        else:
            self._count(source, len(self._read_plan(mission_type)), mission_type)

    def on_request(
        self,
        message: dialect.MAVLink_mission_request_message | dialect.MAVLink_mission_request_int_message,
        source: Source,
        time_us: int,
        *,
        uploader: Source | None,
    ) -> None:
        as_int = message.get_msgId() == dialect.MAVLINK_MSG_ID_MISSION_REQUEST_INT
        if self._policy.ordered_download:
            self._sessions.of(source.channel).as_int = as_int
            self._next_of_list(message, source, time_us, uploader, as_int=as_int)
        else:
            self._single(message, source, uploader, as_int=as_int)

    def on_ack(self, message: dialect.MAVLink_mission_ack_message, source: Source) -> None:
        """The client has received everything, or has cancelled."""
        session = self._sessions.of(source.channel)
        download = session.download
        if (
            download is not None
            and same_partner(download.partner, source)
            and message.mission_type == download.mission_type
        ):
            session.download = None

    def tick(self, time_us: int) -> None:
        for session in self._sessions.all():
            download = session.download
            if download is not None and time_us - download.received_us > self._policy.timeout_us:
                session.download = None
                self._say(self._policy.texts.timeout)

    def _open_list(
        self,
        message: dialect.MAVLink_mission_request_list_message,
        mission_type: MissionType | None,
        source: Source,
        time_us: int,
        uploader: Source | None,
    ) -> None:
        session = self._sessions.of(source.channel)
        open_list = session.download
        busy = uploader is not None and uploader.channel is source.channel
        if open_list is not None and open_list.next_seq < len(open_list.items):
            busy = (
                busy or not same_partner(open_list.partner, source) or open_list.mission_type != mission_type
            )
        if busy:
            self._say(self._policy.texts.uploading)
            return
        if mission_type is None:
            source.channel.send(count_message(source, 0, message.mission_type))
            return
        items = self._read_plan(mission_type)
        session.download = Download(source, mission_type, items, time_us)
        self._count(source, len(items), mission_type)

    def _next_of_list(
        self,
        message: dialect.MAVLink_mission_request_message | dialect.MAVLink_mission_request_int_message,
        source: Source,
        time_us: int,
        uploader: Source | None,
        *,
        as_int: bool,
    ) -> None:
        session = self._sessions.of(source.channel)
        download = session.download
        if download is None:
            if uploader is not None and uploader.channel is source.channel:
                self._say(self._policy.texts.upload_busy)
            return
        if not same_partner(download.partner, source):
            self._say(self._policy.texts.partner_mismatch)
            return
        if message.mission_type != download.mission_type:
            return
        download.received_us = time_us
        if message.seq == download.next_seq < len(download.items):
            download.next_seq += 1
        elif message.seq != download.next_seq - 1:
            session.download = None
            self._ack(source, dialect.MAV_MISSION_ERROR, download.mission_type)
            self._say(self._policy.texts.unexpected_request)
            return
        self._item(source, download.items[message.seq], message.seq, download.mission_type, as_int=as_int)

    def _single(
        self,
        message: dialect.MAVLink_mission_request_message | dialect.MAVLink_mission_request_int_message,
        source: Source,
        uploader: Source | None,
        *,
        as_int: bool,
    ) -> None:
        session = self._sessions.of(source.channel)
        if not as_int and not session.warned_request:
            session.warned_request = True
            self._say(self._policy.texts.float_request)
        mission_type = mission_type_of(message.mission_type)
        if mission_type is None:
            self._ack(source, dialect.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        if uploader is not None:
            self._ack(source, dialect.MAV_MISSION_DENIED, mission_type)
            return
        items = self._read_plan(mission_type)
        if message.seq >= len(items):
            self._ack(source, dialect.MAV_MISSION_ERROR, mission_type)
            self._count(source, len(items), mission_type)
            return
        self._item(source, items[message.seq], message.seq, mission_type, as_int=as_int)

    def _item(
        self, to: Source, item: MissionItem, seq: int, mission_type: MissionType, *, as_int: bool
    ) -> None:
        store = self._stores[mission_type]
        current = (
            self._policy.ordered_download and mission_type is MissionType.MISSION and store.current == seq
        )
        sent = self._policy.rules.read_back(item, as_int=as_int)
        to.channel.send(
            item_message(
                sent,
                seq,
                mission_type,
                target=(to.system_id, to.component_id),
                current=current,
                as_int=as_int,
            )
        )

    def _count(self, to: Source, count: int, mission_type: MissionType) -> None:
        plan_id = self._stores[mission_type].plan_id if self._policy.plan_ids else 0
        send_extended(to.channel, count_message(to, count, mission_type, plan_id))

    def _ack(self, to: Source, result: int, mission_type: int) -> None:
        to.channel.send(ack_message(to, result, mission_type))

    def _say(self, text: Text) -> None:
        if text is not None:
            self._announce(*text)
