"""A vehicle that speaks the mission protocol, and the messages of its partner."""

import math
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.ardupilot.mission_rules import ARDUPILOT_MISSION_POLICY
from autopilot_bridge.firmware.px4.mission_rules import PX4_MISSION_POLICY
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.plans.protocol import MissionService, new_stores
from flightsim.foundation.geodesy import GeodeticPosition
from tests.services.dispatch import deliver

HOME = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.4)
LAT, LON = 473977000, 85456000
RELATIVE_INT = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
TAKEOFF, WAYPOINT, LAND = 22, 16, 21


class Recorder:
    def __init__(self, name: str) -> None:
        self.name = name
        self.sent: list[Any] = []

    def send(self, message: Any, /) -> None:
        self.sent.append(message)

    def take(self) -> list[Any]:
        sent, self.sent = self.sent, []
        return sent


class Task:
    active = False
    complete = False


class Vehicle:
    def __init__(self, flavour: str) -> None:
        self.policy = {"px4": PX4_MISSION_POLICY, "ardupilot": ARDUPILOT_MISSION_POLICY}[flavour]
        self.channel, self.other = Recorder("one"), Recorder("two")
        self.channels = (self.channel, self.other)
        self.gcs = Source(self.channel, 255, 190)
        self.texts: list[tuple[int, str]] = []
        self.changes: list[MissionType] = []
        self.guided: list[MissionItem] = []
        self.task = Task()
        self.home: GeodeticPosition | None = HOME
        self.stores = new_stores()
        self.time_us = 0
        self.service = MissionService(
            self.policy,
            self.stores,
            self,
            lambda severity, text: self.texts.append((severity, text)),
            home=lambda: self.home,
            progress=self.task,
            on_plan_changed=self.changes.append,
            on_guided_item=lambda item: self.guided.append(item) is None,  # type: ignore[func-returns-value]
        )

    @property
    def mission(self) -> tuple[MissionItem, ...]:
        return self.stores[MissionType.MISSION].items

    def deliver(self, message: Any, source: Source | None = None) -> list[Any]:
        source = source or self.gcs
        deliver(message, source, self.time_us, self.service)
        return source.channel.take()  # type: ignore[attr-defined]

    def tick(self, seconds: float) -> list[tuple[float, Any]]:
        start, received = self.time_us, []
        while self.time_us < start + seconds * 1e6:
            self.time_us += 20_000
            self.service.tick(self.time_us)
            received += [((self.time_us - start) / 1e6, message) for message in self.channel.take()]
        return received

    def take_texts(self) -> list[tuple[int, str]]:
        texts, self.texts = self.texts, []
        return texts


def item(
    seq: int = 0,
    command: int = WAYPOINT,
    frame: int = RELATIVE_INT,
    params: tuple[float, ...] = (0.0, 0.0, 0.0, math.nan),
    x: int = LAT,
    y: int = LON,
    z: float = 10.0,
    kind: int = 0,
    current: int = 0,
) -> Any:
    return mavlink.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, current, 1, *params, x, y, z, kind
    )


def count(number: int, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_count_message(1, 1, number, kind)


def request_list(kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_request_list_message(1, 1, kind)


def request(seq: int, kind: int = 0, *, as_int: bool = True) -> Any:
    cls = mavlink.MAVLink_mission_request_int_message if as_int else mavlink.MAVLink_mission_request_message
    return cls(1, 1, seq, kind)


def ack(result: int, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_ack_message(1, 1, result, kind)


def plan(size: int = 4) -> list[Any]:
    return [item(0, TAKEOFF), *(item(seq, x=LAT + 1000 * seq) for seq in range(1, size))]


def names(messages: list[Any]) -> list[str]:
    return [message.get_type() for message in messages]


def upload(vehicle: Vehicle, items: list[Any], kind: int = 0) -> Any:
    """Upload obediently; the MISSION_ACK that ends it."""
    (reply,) = vehicle.deliver(count(len(items), kind))
    for _ in range(3 * len(items) + 3):
        if reply.get_type() == "MISSION_ACK":
            return reply
        (reply,) = vehicle.deliver(items[reply.seq])
    return reply
