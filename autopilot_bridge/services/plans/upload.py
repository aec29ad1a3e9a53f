"""Receiving a plan: MISSION_COUNT, MISSION_ITEM(_INT), MISSION_WRITE_PARTIAL_LIST.

The items are collected outside the store and stored together at the end, so an upload that fails, times out
or is cancelled leaves the plan unchanged. Only one upload runs at a time, over all channels and mission
types.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.mission_wire import item_from_message
from autopilot_bridge.services.channel import Announce, Source
from autopilot_bridge.services.plans.messages import (
    ack_message,
    message_checksum,
    request_message,
    send_extended,
)
from autopilot_bridge.services.plans.policy import MissionPolicy, Text
from autopilot_bridge.services.plans.rules import check_fence_polygons
from autopilot_bridge.services.plans.sessions import Finished, Sessions, mission_type_of, same_partner

StorePlan = Callable[[MissionType, tuple[MissionItem, ...], int, int], None]
"""Stores a whole plan: (type, items, checksum of the messages, index marked current)."""


@dataclass(slots=True)
class Upload:
    """An upload in progress: items `first` to `end` (exclusive); the next one is `next_seq`."""

    partner: Source
    mission_type: MissionType
    first: int
    end: int
    kept: tuple[MissionItem, ...]
    received_us: int
    sent_us: int
    items: list[MissionItem] = field(default_factory=list)
    checksum: int = 0
    current: int = 0

    @property
    def next_seq(self) -> int:
        return self.first + len(self.items)

    @property
    def plan_size(self) -> int:
        return max(self.end, len(self.kept))


class MissionUploads:
    """The receiving half of the mission protocol."""

    def __init__(
        self,
        policy: MissionPolicy,
        stores: dict[MissionType, MissionStore],
        sessions: Sessions,
        announce: Announce,
        store_plan: StorePlan,
    ) -> None:
        self._policy = policy
        self._stores = stores
        self._sessions = sessions
        self._announce = announce
        self._store_plan = store_plan
        self._upload: Upload | None = None

    @property
    def partner(self) -> Source | None:
        """The client that is uploading now; None: no upload."""
        return None if self._upload is None else self._upload.partner

    def on_count(self, message: dialect.MAVLink_mission_count_message, source: Source, time_us: int) -> None:
        texts = self._policy.texts
        upload = self._upload
        if upload is None and self._sessions.of(source.channel).download is not None:
            self._say(texts.download_open)
            self._ack(source, dialect.MAV_MISSION_ERROR, message.mission_type)
            return
        if upload is not None:
            if not same_partner(upload.partner, source):
                self._ack(source, self._policy.foreign_count_result, message.mission_type)
                return
            if upload.items and not self._policy.restart_on_count:
                upload.received_us = time_us
                self._say(texts.upload_busy)
                self._ack(source, dialect.MAV_MISSION_ERROR, upload.mission_type)
                return
        mission_type = mission_type_of(message.mission_type)
        if mission_type is None:
            self._ack(source, dialect.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        capacity = self._policy.capacity[mission_type]
        if message.count > capacity:
            if texts.too_many is not None:
                self._announce(texts.too_many[0], texts.too_many[1].format(capacity=capacity))
            self._ack(source, dialect.MAV_MISSION_NO_SPACE, mission_type)
            return
        self._upload = Upload(source, mission_type, 0, message.count, (), time_us, time_us)
        if message.count == 0:
            self._finish(self._upload)
        else:
            self._request(self._upload, time_us)

    def on_partial(
        self, message: dialect.MAVLink_mission_write_partial_list_message, source: Source, time_us: int
    ) -> None:
        """MISSION_WRITE_PARTIAL_LIST: items start_index..end_index (inclusive) are uploaded again."""
        if not self._policy.partial_writes:
            return
        if self._upload is not None and not same_partner(self._upload.partner, source):
            self._ack(source, self._policy.foreign_count_result, message.mission_type)
            return
        mission_type = mission_type_of(message.mission_type)
        if mission_type is None:
            self._ack(source, dialect.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        kept = self._stores[mission_type].items
        if not 0 <= message.start_index <= message.end_index < len(kept):
            self._say(self._policy.texts.partial_rejected)
            self._ack(source, dialect.MAV_MISSION_ERROR, mission_type)
            return
        self._upload = Upload(
            source, mission_type, message.start_index, message.end_index + 1, kept, time_us, time_us
        )
        self._request(self._upload, time_us)

    def on_item(
        self,
        message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message,
        source: Source,
        time_us: int,
    ) -> None:
        session = self._sessions.of(source.channel)
        session.as_int = message.get_msgId() == dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT
        if not session.as_int and not session.warned_item:
            session.warned_item = True
            self._say(self._policy.texts.float_item)
        upload = self._upload
        if upload is None:
            self._on_unexpected_item(message, source)
            return
        if not same_partner(upload.partner, source):
            if self._policy.texts.partner_mismatch is None:
                self._ack(source, self._policy.foreign_count_result, message.mission_type)
            self._say(self._policy.texts.partner_mismatch)
            return
        if message.mission_type != upload.mission_type:
            self._ack(source, dialect.MAV_MISSION_ERROR, message.mission_type)
            return
        if message.seq != upload.next_seq:
            if self._policy.wrong_sequence_result is None:
                upload.received_us = time_us
            else:
                self._ack(source, self._policy.wrong_sequence_result, upload.mission_type)
            return
        self._take(upload, message, time_us)

    def on_ack(self, message: dialect.MAVLink_mission_ack_message, source: Source, time_us: int) -> None:
        """MISSION_ACK of the client: it does not support that form of item, or it cancels."""
        upload = self._upload
        if upload is None or not same_partner(upload.partner, source):
            return
        if message.type == dialect.MAV_MISSION_OPERATION_CANCELLED:
            self._upload = None
        elif message.type == dialect.MAV_MISSION_UNSUPPORTED and self._policy.requests_as_int:
            session = self._sessions.of(source.channel)
            session.as_int = not session.as_int
            self._request(upload, time_us)

    def tick(self, time_us: int) -> None:
        upload = self._upload
        if upload is None:
            return
        if time_us - upload.received_us > self._policy.timeout_us:
            self._upload = None
            self._say(self._policy.texts.timeout)
            if self._policy.timeout_result is not None:
                self._ack(upload.partner, self._policy.timeout_result, upload.mission_type)
        elif time_us - upload.sent_us > self._policy.retry_us:
            self._request(upload, time_us)

    def _take(
        self,
        upload: Upload,
        message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message,
        time_us: int,
    ) -> None:
        upload.received_us = time_us
        item = item_from_message(message)
        rules = self._policy.rules
        result = rules.check(item, upload.mission_type, message.seq, upload.plan_size)
        if result != dialect.MAV_MISSION_ACCEPTED:
            self._fail(upload, result)
            return
        upload.checksum = message_checksum(message, upload.checksum)
        if message.current == 1:
            upload.current = message.seq
        upload.items.append(rules.stored(item))
        if upload.next_seq == upload.end:
            self._finish(upload)
        else:
            self._request(upload, time_us)

    def _finish(self, upload: Upload) -> None:
        items = (*upload.kept[: upload.first], *upload.items, *upload.kept[upload.end :])
        if upload.mission_type is MissionType.FENCE:
            result = check_fence_polygons(items)
            if result != dialect.MAV_MISSION_ACCEPTED:
                self._fail(upload, result)
                return
        self._upload = None
        self._store_plan(upload.mission_type, items, upload.checksum, upload.current)
        plan_id = self._stores[upload.mission_type].plan_id if self._policy.plan_ids else 0
        session = self._sessions.of(upload.partner.channel)
        session.finished = Finished(upload.partner, upload.mission_type, upload.end - 1, plan_id)
        self._ack(upload.partner, dialect.MAV_MISSION_ACCEPTED, upload.mission_type, plan_id)

    def _fail(self, upload: Upload, result: int) -> None:
        self._upload = None
        self._sessions.of(upload.partner.channel).finished = None
        self._say(self._policy.texts.invalid_item)
        self._ack(upload.partner, result, upload.mission_type)

    def _on_unexpected_item(
        self,
        message: dialect.MAVLink_mission_item_message | dialect.MAVLink_mission_item_int_message,
        source: Source,
    ) -> None:
        finished = self._sessions.of(source.channel).finished
        if (
            self._policy.plan_ids
            and finished is not None
            and same_partner(finished.partner, source)
            and finished.mission_type == message.mission_type
            and finished.last_seq == message.seq
        ):
            self._ack(source, dialect.MAV_MISSION_ACCEPTED, message.mission_type, finished.plan_id)
            return
        self._say(self._policy.texts.no_transfer)
        self._ack(source, dialect.MAV_MISSION_ERROR, message.mission_type)

    def _request(self, upload: Upload, time_us: int) -> None:
        upload.sent_us = time_us
        as_int = self._policy.requests_as_int and self._sessions.of(upload.partner.channel).as_int
        upload.partner.channel.send(
            request_message(upload.partner, upload.next_seq, upload.mission_type, as_int=as_int)
        )

    def _ack(self, to: Source, result: int, mission_type: int, plan_id: int = 0) -> None:
        send_extended(to.channel, ack_message(to, result, mission_type, plan_id))

    def _say(self, text: Text) -> None:
        if text is not None:
            self._announce(*text)
