"""The MAVLink mission protocol of a ground station: missions, geofences and rally points."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final, TypeVar

from autopilot_bridge.mavlink import MAVLinkMessage, command_name, dialect, enum_name
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import item_from_message, item_message
from missions.errors import CommandRejected, VehicleTimeout
from missions.vehicle.connection import MessageStream
from missions.vehicle.items import WITH_PLACE
from missions.vehicle.link import VehicleLink

_RETRY_S: Final = 1.5
_REASON_S: Final = 0.5  # the texts about a refusal may follow it
_RETRIES: Final = 5
_SENDINGS: Final = 3
_STUCK_S: Final = 6.0  # PX4 cancels a transfer after 5 s
_REPEATED: Final = 40  # replies without progress; PX4 repeats a request 20 times in 5 s, ArduPilot 8 times
_ERRORS_BORNE: Final = 10  # an item that ArduPilot requested eight times may arrive there eight times
_GIVEN_UP: Final = (dialect.MAV_MISSION_ERROR, dialect.MAV_MISSION_OPERATION_CANCELLED)
_DO_JUMP: Final = 177
_Reply = (
    dialect.MAVLink_mission_request_int_message
    | dialect.MAVLink_mission_request_message
    | dialect.MAVLink_mission_ack_message
)
"""What a vehicle sends while a plan is uploaded."""
_AnswerT = TypeVar(
    "_AnswerT", dialect.MAVLink_mission_count_message, dialect.MAVLink_mission_item_int_message
)
_NAMES: Final = {
    MissionType.MISSION: "mission",
    MissionType.FENCE: "geofence",
    MissionType.RALLY: "list of rally points",
}


def _item_message(
    item: MissionItem, sequence: int, system_id: int, mission_type: MissionType
) -> MAVLinkMessage:
    """MISSION_ITEM_INT for an autopilot; x and y that are not set are 0, as ground stations send them."""
    first = sequence == 0 and mission_type is MissionType.MISSION
    target = (system_id, AUTOPILOT_COMPONENT)
    return item_message(item, sequence, mission_type, target=target, current=first, unset=0)


def renumbered(items: Sequence[MissionItem], by: int) -> list[MissionItem]:
    """The items with jump targets adjusted for `by` other items placed before all of them."""
    return [replace(i, param1=i.param1 + by) if i.command == _DO_JUMP and by else i for i in items]


def in_mission_frame(items: Sequence[MissionItem]) -> list[MissionItem]:
    """The items with MAV_FRAME_MISSION for those without a place.

    Ground stations and scripts also write them in the frame of the waypoints, which PX4 does not accept
    (1.16.1, mavlink_mission.cpp: parse_mavlink_mission_item).
    """
    frame = dialect.MAV_FRAME_MISSION
    return [i if i.command in WITH_PLACE or i.frame == frame else replace(i, frame=frame) for i in items]


def _result_name(result: int) -> str:
    return enum_name("MAV_MISSION_RESULT", result, prefix="MAV_MISSION_") or f"result {result}"


def _reply_name(reply: _Reply) -> str:
    """A reply of a transfer as text."""
    if isinstance(reply, dialect.MAVLink_mission_ack_message):
        return f"the answer {_result_name(reply.type)}"
    return f"a request for item {reply.seq}"


async def upload(
    link: VehicleLink,
    items: Sequence[MissionItem],
    mission_type: MissionType = MissionType.MISSION,
    *,
    before: int = 0,
) -> None:
    """Send a whole plan, numbered as the vehicle numbers it. A transfer that stalls is restarted from the
    beginning.

    Args:
        before: number of items that are not the user's own (ArduPilot's home). The error for a refused item
            counts from 1 without them.

    Raises:
        CommandRejected: the vehicle refused the plan; the message names the item when the vehicle reported
            it.
        VehicleTimeout: the vehicle stopped requesting items.
    """
    for sending in range(_SENDINGS):
        try:
            await _send_plan(link, items, mission_type, before)
        except VehicleTimeout:
            if sending + 1 == _SENDINGS:
                raise
        else:
            return


async def _send_plan(
    link: VehicleLink, items: Sequence[MissionItem], mission_type: MissionType, before: int
) -> None:
    what = _NAMES[mission_type]
    requested = -1
    replies: MessageStream[_Reply] = link.messages(
        dialect.MAVLink_mission_request_int_message,
        dialect.MAVLink_mission_request_message,
        dialect.MAVLink_mission_ack_message,
    )
    with replies:
        count = dialect.MAVLink_mission_count_message(link.system_id, 1, len(items), int(mission_type))
        link.send(count)
        attempts = 0
        errors = 0
        repeated = 0
        while True:
            all_sent = requested + 1 >= len(items)
            try:
                reply = await _next_reply(
                    link, replies, mission_type, _RETRY_S if requested < 0 or all_sent else _STUCK_S
                )
            except TimeoutError:
                attempts += 1
                if attempts > _RETRIES or not (requested < 0 or all_sent):
                    raise VehicleTimeout(
                        f"the vehicle stopped requesting items of the {what} after {requested + 1} of "
                        f"{len(items)}; {link.last_received()}"
                    ) from None
                if requested < 0:
                    link.send(count)
                else:  # the acknowledgement was lost: PX4 repeats it
                    link.send(_item_message(items[-1], len(items) - 1, link.system_id, mission_type))
                continue
            repeated += 1
            if repeated > _REPEATED:
                raise VehicleTimeout(
                    f"the vehicle requests nothing new of the {what}: {repeated} replies after "
                    f"{requested + 1} of {len(items)} items, the last one {_reply_name(reply)}; "
                    f"{link.last_received()}"
                )
            if isinstance(reply, dialect.MAVLink_mission_ack_message):
                if reply.type == dialect.MAV_MISSION_ACCEPTED:
                    if all_sent:
                        return
                    continue  # belongs to an earlier transfer
                if reply.type == dialect.MAV_MISSION_INVALID_SEQUENCE:
                    continue  # answers an item that was sent twice: the transfer stays open (ArduPilot)
                if reply.type == dialect.MAV_MISSION_ERROR and all_sent and requested >= 0:
                    # "no transfer": it has ended, and the message with its result was lost
                    raise VehicleTimeout(
                        f"how the vehicle took the {what} is not known; {link.last_received()}"
                    )
                if reply.type in _GIVEN_UP and requested >= 0:
                    # long silence: PX4 (after 5 s) reports the timeout at the next item, ArduPilot (after 8
                    # s) immediately
                    raise VehicleTimeout(
                        f"the vehicle gave the {what} up after {requested + 1} of {len(items)} items: "
                        f"{_result_name(reply.type)}; {link.last_received()}"
                    )
                errors += 1
                if reply.type in _GIVEN_UP and requested < 0 and errors <= _ERRORS_BORNE:
                    continue  # may answer a repeated item of an earlier transfer
                where = ""
                if requested >= 0:
                    where = f" at item {requested - before + 1} ({command_name(items[requested].command)})"
                await link.clock.sleep(_REASON_S)
                raise CommandRejected(
                    f"the vehicle refused the {what}{where}: {_result_name(reply.type)}; "
                    f"{link.last_received()}",
                    reply.type,
                )
            if reply.seq < len(items):
                if reply.seq > requested:
                    requested, repeated = reply.seq, 0
                link.send(_item_message(items[reply.seq], reply.seq, link.system_id, mission_type))


async def _next_reply(
    link: VehicleLink, replies: MessageStream[_Reply], mission_type: MissionType, seconds: float
) -> _Reply:
    """The next message of this transfer; those of other clients' transfers do not extend the wait."""
    async with link.deadline(seconds, f"a request for an item of the {_NAMES[mission_type]}"):
        while True:
            reply = await anext(replies)
            if link.addressed_here(reply) and reply.mission_type == mission_type:
                return reply


async def _ask(
    link: VehicleLink,
    message: MAVLinkMessage,
    answer: type[_AnswerT],
    mission_type: MissionType,
    fits: Callable[[_AnswerT], bool] = lambda _: True,
) -> _AnswerT:
    """Send a request repeatedly until its answer is received."""
    name = answer.msgname
    with link.messages(answer) as replies:
        for _ in range(_RETRIES):
            link.send(message)
            try:
                async with link.deadline(_RETRY_S, name):
                    async for reply in replies:
                        if link.addressed_here(reply) and reply.mission_type == mission_type and fits(reply):
                            return reply
            except TimeoutError:
                continue
    raise VehicleTimeout(
        f"no {name} came while downloading the {_NAMES[mission_type]}; {link.last_received()}"
    )


async def _ask_count(link: VehicleLink, mission_type: MissionType) -> int:
    message = dialect.MAVLink_mission_request_list_message(link.system_id, 1, int(mission_type))
    return int((await _ask(link, message, dialect.MAVLink_mission_count_message, mission_type)).count)


async def _ask_item(link: VehicleLink, mission_type: MissionType, sequence: int) -> MissionItem:
    request = dialect.MAVLink_mission_request_int_message(link.system_id, 1, sequence, int(mission_type))
    kind = dialect.MAVLink_mission_item_int_message
    return item_from_message(await _ask(link, request, kind, mission_type, lambda item: item.seq == sequence))


def _end_download(link: VehicleLink, mission_type: MissionType) -> None:
    link.send(
        dialect.MAVLink_mission_ack_message(
            link.system_id, 1, dialect.MAV_MISSION_ACCEPTED, int(mission_type)
        )
    )


async def download(link: VehicleLink, mission_type: MissionType = MissionType.MISSION) -> list[MissionItem]:
    """Download the whole plan from the vehicle, in the vehicle's numbering."""
    items = []
    for k in range(await _ask_count(link, mission_type)):
        items.append(await _ask_item(link, mission_type, k))
    _end_download(link, mission_type)
    return items


async def clear(link: VehicleLink, mission_type: MissionType = MissionType.MISSION) -> None:
    """Delete the plan that the vehicle holds, and verify that it is deleted.

    An acknowledgement does not state which request it answers: one of an earlier upload may arrive late.
    """
    what = _NAMES[mission_type]
    errors = 0
    with link.messages(dialect.MAVLink_mission_ack_message) as replies:
        for _ in range(_RETRIES):
            link.send(dialect.MAVLink_mission_clear_all_message(link.system_id, 1, int(mission_type)))
            try:
                async with link.deadline(_RETRY_S, f"the clearing of the {what}"):
                    async for reply in replies:
                        if not link.addressed_here(reply) or reply.mission_type != mission_type:
                            continue
                        if reply.type == dialect.MAV_MISSION_ACCEPTED:
                            break
                        errors += 1
                        if reply.type != dialect.MAV_MISSION_ERROR or errors > _ERRORS_BORNE:
                            raise CommandRejected(
                                f"the vehicle refused to clear the {what}: {_result_name(reply.type)}",
                                reply.type,
                            )
            except TimeoutError:
                continue
            left = await _ask_count(link, mission_type)
            _end_download(link, mission_type)
            if left == 0:
                return
    raise VehicleTimeout(f"clearing the {what} was not answered; {link.last_received()}")
