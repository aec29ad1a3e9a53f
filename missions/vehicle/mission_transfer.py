"""The MAVLink mission protocol, from the ground station's side."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from missions.errors import CommandRejected, VehicleTimeout

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle

_GLOBAL_FRAMES: Final = frozenset({0, 3, 5, 6, 10, 11})
_RETRY_S: Final = 1.5
_RETRIES: Final = 5


def item_message(item: MissionItem, sequence: int, system_id: int) -> Any:
    """MISSION_ITEM_INT of an item: degrees in 1e-7, local metres in 1e-4; NaN x or y ("not set") as 0."""
    scale = 1e7 if item.frame in _GLOBAL_FRAMES else (1.0 if item.frame == 2 else 1e4)

    def whole(value: float) -> int:
        return round(value * scale) if math.isfinite(value) else 0

    return dialect.MAVLink_mission_item_int_message(
        system_id,
        1,
        sequence,
        item.frame,
        item.command,
        1 if sequence == 0 else 0,
        int(item.autocontinue),
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        whole(item.x),
        whole(item.y),
        item.z,
        dialect.MAV_MISSION_TYPE_MISSION,
    )


def item_from_message(message: Any) -> MissionItem:
    """The item a MISSION_ITEM_INT carries."""
    scale = 1e-7 if message.frame in _GLOBAL_FRAMES else (1.0 if message.frame == 2 else 1e-4)
    return MissionItem(
        command=message.command,
        frame=message.frame,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=message.x * scale,
        y=message.y * scale,
        z=message.z,
        autocontinue=bool(message.autocontinue),
    )


def _result_name(result: int) -> str:
    entry = dialect.enums["MAV_MISSION_RESULT"].get(result)
    return entry.name.removeprefix("MAV_MISSION_") if entry else f"result {result}"


async def upload(vehicle: "Vehicle", items: Sequence[MissionItem]) -> None:
    """Send a whole plan, numbered as the vehicle numbers it.

    Raises:
        CommandRejected: the vehicle refused it; names the item where it says which.
        VehicleTimeout: it stopped asking for items.
    """
    names = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")
    asked = -1
    with vehicle.messages(*names) as replies:
        count = dialect.MAVLink_mission_count_message(vehicle.system_id, 1, len(items), 0)
        vehicle.send(count)
        attempts = 0
        while True:
            try:
                async with vehicle.deadline(_RETRY_S if asked < 0 else 6.0, "a request for a mission item"):
                    reply = await anext(replies)
            except TimeoutError:
                attempts += 1
                if asked >= 0 or attempts > _RETRIES:
                    raise VehicleTimeout(
                        f"the vehicle stopped asking for mission items after {asked + 1} of {len(items)}; "
                        f"{vehicle.heard()}"
                    ) from None
                vehicle.send(count)
                continue
            if not vehicle.addressed_here(reply):
                continue
            if reply.get_type() == "MISSION_ACK":
                if reply.mission_type != 0:
                    continue
                if reply.type == dialect.MAV_MISSION_ACCEPTED:
                    if asked + 1 >= len(items):
                        return
                    continue  # of an earlier transfer
                if reply.type == dialect.MAV_MISSION_INVALID_SEQUENCE:
                    continue  # to an item that was sent twice: the transfer stays open (ArduPilot)
                where = f" at item {asked} (command {items[asked].command})" if asked >= 0 else ""
                raise CommandRejected(
                    f"the vehicle refused the mission{where}: {_result_name(reply.type)}; {vehicle.heard()}",
                    reply.type,
                )
            if reply.mission_type == 0 and reply.seq < len(items):
                asked = max(asked, reply.seq)
                vehicle.send(item_message(items[reply.seq], reply.seq, vehicle.system_id))


async def download(vehicle: "Vehicle") -> list[MissionItem]:
    """The whole plan the vehicle holds, as it numbers it."""
    system_id = vehicle.system_id

    async def ask(message: Any, name: str, sequence: int | None = None) -> Any:
        with vehicle.messages(name) as replies:
            for _ in range(_RETRIES):
                vehicle.send(message)
                try:
                    async with vehicle.deadline(_RETRY_S, name):
                        async for reply in replies:
                            if vehicle.addressed_here(reply) and (sequence is None or reply.seq == sequence):
                                return reply
                except TimeoutError:
                    continue
        raise VehicleTimeout(f"no {name} came while downloading the mission; {vehicle.heard()}")

    count = await ask(dialect.MAVLink_mission_request_list_message(system_id, 1, 0), "MISSION_COUNT")
    items = []
    for k in range(count.count):
        request = dialect.MAVLink_mission_request_int_message(system_id, 1, k, 0)
        items.append(item_from_message(await ask(request, "MISSION_ITEM_INT", k)))
    vehicle.send(dialect.MAVLink_mission_ack_message(system_id, 1, dialect.MAV_MISSION_ACCEPTED, 0))
    return items


async def clear(vehicle: "Vehicle") -> None:
    """Delete the plan the vehicle holds."""
    with vehicle.messages("MISSION_ACK") as replies:
        for _ in range(_RETRIES):
            vehicle.send(dialect.MAVLink_mission_clear_all_message(vehicle.system_id, 1, 0))
            try:
                async with vehicle.deadline(_RETRY_S, "the clearing of the mission"):
                    async for reply in replies:
                        if not vehicle.addressed_here(reply):
                            continue
                        if reply.type != dialect.MAV_MISSION_ACCEPTED:
                            raise CommandRejected(
                                f"the vehicle refused to clear the mission: {_result_name(reply.type)}",
                                reply.type,
                            )
                        return
            except TimeoutError:
                continue
    raise VehicleTimeout(f"clearing the mission was not answered; {vehicle.heard()}")
