"""Conversations of the mission protocol, against the references (PX4 section 10, ArduPilot section 5)."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.geodesy import GeodeticPosition
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.mission import MissionService, new_stores
from autopilot_bridge.services.mission_messages import ack_message, current_message, plan_checksum
from autopilot_bridge.services.mission_policy import ARDUPILOT_MISSION_POLICY, PX4_MISSION_POLICY

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
            on_guided_item=lambda item: self.guided.append(item) is None,
        )

    @property
    def mission(self) -> tuple[MissionItem, ...]:
        return self.stores[MissionType.MISSION].items

    def tell(self, message: Any, source: Source | None = None) -> list[Any]:
        source = source or self.gcs
        assert self.service.handle(message, source, self.time_us)
        return source.channel.take()  # type: ignore[attr-defined]

    def tick(self, seconds: float) -> list[tuple[float, Any]]:
        start, heard = self.time_us, []
        while self.time_us < start + seconds * 1e6:
            self.time_us += 20_000
            self.service.tick(self.time_us)
            heard += [((self.time_us - start) / 1e6, message) for message in self.channel.take()]
        return heard

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
    (reply,) = vehicle.tell(count(len(items), kind))
    for _ in range(3 * len(items) + 3):
        if reply.get_type() == "MISSION_ACK":
            return reply
        (reply,) = vehicle.tell(items[reply.seq])
    return reply


@pytest.fixture
def px4() -> Vehicle:
    return Vehicle("px4")


@pytest.fixture
def ardupilot() -> Vehicle:
    return Vehicle("ardupilot")


@pytest.fixture(params=["px4", "ardupilot"])
def vehicle(request: pytest.FixtureRequest) -> Vehicle:
    return Vehicle(request.param)


# --- upload -------------------------------------------------------------------------------------------------


def test_px4_asks_for_the_first_item_ever_with_the_float_message(px4: Vehicle) -> None:
    items = plan(3)
    (first,) = px4.tell(count(3))
    assert (first.get_type(), first.seq) == ("MISSION_REQUEST", 0)
    (second,) = px4.tell(items[0])
    assert (second.get_type(), second.seq) == ("MISSION_REQUEST_INT", 1)
    px4.tell(items[1])
    (end,) = px4.tell(items[2])
    assert (end.get_type(), end.type) == ("MISSION_ACK", 0)
    assert (end.target_system, end.target_component) == (255, 190)
    assert end.opaque_id == px4.stores[MissionType.MISSION].plan_id != 0
    (again,) = px4.tell(count(3))
    assert again.get_type() == "MISSION_REQUEST_INT"
    assert len(px4.mission) == 3
    assert px4.changes == [MissionType.MISSION]


def test_px4_turns_to_the_integer_message_when_the_float_one_is_refused(px4: Vehicle) -> None:
    px4.tell(count(2))
    (asked,) = px4.tell(ack(mavlink.MAV_MISSION_UNSUPPORTED))
    assert (asked.get_type(), asked.seq) == ("MISSION_REQUEST_INT", 0)


def test_ardupilot_always_asks_with_mission_request(ardupilot: Vehicle) -> None:
    items = plan(3)
    asked = ardupilot.tell(count(3)) + ardupilot.tell(items[0]) + ardupilot.tell(items[1])
    assert [(message.get_type(), message.seq) for message in asked] == [
        ("MISSION_REQUEST", 0),
        ("MISSION_REQUEST", 1),
        ("MISSION_REQUEST", 2),
    ]
    (end,) = ardupilot.tell(items[2])
    assert (end.get_type(), end.type, end.opaque_id) == ("MISSION_ACK", 0, 0)
    assert ardupilot.take_texts() == [(mavlink.MAV_SEVERITY_INFO, "Flight plan received")]


def test_float_items_are_taken(vehicle: Vehicle) -> None:
    vehicle.tell(count(2))
    for seq in range(2):
        (reply,) = vehicle.tell(
            mavlink.MAVLink_mission_item_message(
                1, 1, seq, RELATIVE, TAKEOFF if seq == 0 else WAYPOINT, 0, 1, 0, 0, 0, 0, 47.5, 8.5, 10.0
            )
        )
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0)
    assert vehicle.mission[1].x == pytest.approx(47.5, abs=1e-5)
    warned = (4, "got MISSION_ITEM; GCS should send MISSION_ITEM_INT") in vehicle.texts
    assert warned == (vehicle.policy is ARDUPILOT_MISSION_POLICY)


@pytest.mark.parametrize(
    ("flavour", "retry_s", "timeout_s", "text"),
    [("px4", 0.26, 5.0, (2, "Operation timeout")), ("ardupilot", 1.0, 8.0, (4, "Mission upload timeout"))],
)
def test_silence(flavour: str, retry_s: float, timeout_s: float, text: tuple[int, str]) -> None:
    vehicle = Vehicle(flavour)
    upload(vehicle, plan(3))
    before = vehicle.mission
    vehicle.take_texts()
    vehicle.tell(count(5))
    vehicle.tell(plan(5)[0])
    heard = vehicle.tick(12.0)
    again = [(when, message) for when, message in heard if "REQUEST" in message.get_type()]
    assert again[0][0] == pytest.approx(retry_s, abs=0.03)
    assert all(message.seq == 1 for _, message in again)
    assert timeout_s - retry_s - 0.05 < again[-1][0] <= timeout_s + 0.03
    assert vehicle.take_texts() == [text]
    ends = [(when, message.type) for when, message in heard if message.get_type() == "MISSION_ACK"]
    assert ends == ([] if flavour == "px4" else [(pytest.approx(8.02, abs=0.03), 15)])
    assert vehicle.mission == before
    assert upload(vehicle, plan(2)).type == 0


def test_px4_ignores_items_out_of_sequence(px4: Vehicle) -> None:
    items = plan(4)
    px4.tell(count(4))
    assert px4.tell(items[2]) == []
    assert [message.seq for _, message in px4.tick(0.3)] == [0]


def test_ardupilot_refuses_items_out_of_sequence_and_goes_on(ardupilot: Vehicle) -> None:
    items = plan(3)
    ardupilot.tell(count(3))
    ardupilot.tell(items[0])
    for wrong in (items[0], items[2]):
        (reply,) = ardupilot.tell(wrong)
        assert (reply.get_type(), reply.type) == ("MISSION_ACK", mavlink.MAV_MISSION_INVALID_SEQUENCE)
    ardupilot.tell(items[1])
    (end,) = ardupilot.tell(items[2])
    assert end.type == 0


def test_second_count(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        vehicle.tell(count(4))
        vehicle.tell(plan(4)[0])
    (reply,) = px4.tell(count(4))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 1)
    assert px4.take_texts() == [(2, "WPM: REJ. CMD: Busy")]
    (asked,) = px4.tell(plan(4)[1])
    assert asked.seq == 2
    (restarted,) = ardupilot.tell(count(2))
    assert (restarted.get_type(), restarted.seq) == ("MISSION_REQUEST", 0)


def test_a_count_again_before_the_first_item_is_answered_again(px4: Vehicle) -> None:
    px4.tell(count(4))
    (asked,) = px4.tell(count(4))
    assert (asked.get_type(), asked.seq) == ("MISSION_REQUEST", 0)


def test_unsolicited_items(vehicle: Vehicle) -> None:
    (reply,) = vehicle.tell(item(3))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", mavlink.MAV_MISSION_ERROR)
    px4 = vehicle.policy is PX4_MISSION_POLICY
    assert ((2, "IGN MISSION_ITEM: No transfer") in vehicle.texts) == px4


def test_px4_acknowledges_the_last_item_again(px4: Vehicle) -> None:
    items = plan(3)
    first = upload(px4, items)
    (again,) = px4.tell(items[-1])
    assert (again.type, again.opaque_id) == (0, first.opaque_id)


@pytest.mark.parametrize(("flavour", "capacity"), [("px4", 10_000), ("ardupilot", 650)])
def test_capacity(flavour: str, capacity: int) -> None:
    vehicle = Vehicle(flavour)
    (asked,) = vehicle.tell(count(capacity))
    assert "REQUEST" in asked.get_type()
    vehicle = Vehicle(flavour)
    (reply,) = vehicle.tell(count(capacity + 1))
    assert reply.type == mavlink.MAV_MISSION_NO_SPACE
    assert vehicle.texts == ([] if flavour == "px4" else [(4, "Only 650 items are supported")])


def test_count_zero_and_clear_all_empty_the_plan(vehicle: Vehicle) -> None:
    for emptying in (count(0), mavlink.MAVLink_mission_clear_all_message(1, 1, 0)):
        upload(vehicle, plan(3))
        (reply,) = vehicle.tell(emptying)
        assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0)
        assert vehicle.mission == ()
        assert not vehicle.service.mission_valid()


def test_clear_all_types(px4: Vehicle, ardupilot: Vehicle) -> None:
    upload(px4, plan(3))
    for kind in (255, 7):
        (reply,) = px4.tell(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))
        assert reply.type == 0
    assert px4.mission == ()
    upload(ardupilot, plan(3))
    for kind in (255, 7):
        (reply,) = ardupilot.tell(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))
        assert reply.type == mavlink.MAV_MISSION_UNSUPPORTED
    ardupilot.task.active = True
    (reply,) = ardupilot.tell(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    assert reply.type == mavlink.MAV_MISSION_ERROR
    assert len(ardupilot.mission) == 3


def test_the_partner_can_cancel(vehicle: Vehicle) -> None:
    upload(vehicle, plan(3))
    vehicle.tick(0.1)
    before = vehicle.mission
    vehicle.tell(count(4))
    vehicle.tell(plan(4)[0])
    assert vehicle.tell(ack(mavlink.MAV_MISSION_OPERATION_CANCELLED)) == []
    vehicle.take_texts()
    assert vehicle.tick(10.0) == []
    assert vehicle.take_texts() == []
    assert vehicle.mission == before


def test_another_partner_does_not_disturb_an_upload(vehicle: Vehicle) -> None:
    items = plan(3)
    vehicle.tell(count(3))
    stranger = Source(vehicle.other, 254, 1)
    (reply,) = vehicle.tell(count(2), stranger)
    assert reply.type == vehicle.policy.foreign_count_result
    vehicle.tell(item(0, z=99.0), stranger)
    vehicle.tell(ack(mavlink.MAV_MISSION_OPERATION_CANCELLED), stranger)
    for each in items:
        (reply,) = vehicle.tell(each)
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0)
    assert vehicle.mission[1].z == 10.0


BAD: list[tuple[Any, int | None, int]] = [
    # (item 1 of a mission, PX4's result, ArduPilot's result)
    (item(1, 9999), 3, 3),
    (item(1, 115, frame=RELATIVE_INT, params=(0, 0, 0, 0)), 3, 0),
    (item(1, 82, params=(0, 0, 0, 0)), 3, 0),
    (item(1, 82), 3, 9),
    (item(1, frame=1), 2, 2),
    (item(1, frame=99), 2, 2),
    (item(1, frame=10), 2, 0),
    (item(1, x=1_000_000_000), 10, 10),
    (item(1, x=950_000_000), 10, 10),
    (item(1, y=1_900_000_000), 11, 11),
    (item(1, x=2**31 - 1, y=2**31 - 1), 10, 10),
    (item(1, z=math.nan), 12, 12),
    (item(1, z=1e9), 12, 12),
    (item(1, params=(math.nan, 0, 0, 0)), 0, 6),
    (item(1, params=(math.inf, 0, 0, 0)), 6, 6),
    (item(1, params=(-1, 0, 0, 0)), 6, 6),
    (item(1, params=(0, math.inf, 0, 0)), 7, 7),
    (item(1, params=(0, 0, -math.inf, 0)), 8, 8),
    (item(1, params=(0, 0, 0, math.nan)), 0, 0),
    (item(1, 178, frame=2, params=(0, -5, 0, 0)), 7, 7),
    (item(1, 178, frame=2, params=(0, -1, 0, 0)), 0, 0),
    (item(1, 177, frame=2, params=(9, 1, 0, 0)), 6, 6),
    (item(1, 177, frame=2, params=(1, 1, 0, 0)), 6, 6),
    (item(1, 177, frame=2, params=(0, 1, 0, 0)), 0, 0),
    (item(1, 177, frame=2, params=(math.nan, 1, 0, 0)), 6, 6),
    (item(1, LAND, x=2**31 - 1, y=2**31 - 1, z=0.0), 0, 0),
    (item(1, 201, frame=2, params=(4, 0, 0, 0), x=0, y=0), 6, 2),
    (item(1, 5001), 3, 3),
]


@pytest.mark.parametrize(("bad", "px4_result", "ardupilot_result"), BAD)
def test_item_results(bad: Any, px4_result: int, ardupilot_result: int) -> None:
    for flavour, expected in (("px4", px4_result), ("ardupilot", ardupilot_result)):
        vehicle = Vehicle(flavour)
        upload(vehicle, plan(3))
        before = vehicle.mission
        vehicle.take_texts()
        end = upload(vehicle, [item(0, TAKEOFF), bad, item(2)])
        assert end.type == expected, flavour
        if expected == 0:
            continue
        assert vehicle.mission == before
        assert vehicle.texts == ([(2, "IGN MISSION_ITEM: Invalid item")] if flavour == "px4" else [])
        (after,) = vehicle.tell(item(2))
        assert after.type == mavlink.MAV_MISSION_ERROR


def test_unknown_mission_types(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        (reply,) = vehicle.tell(count(2, kind=7))
        assert reply.type == mavlink.MAV_MISSION_UNSUPPORTED
    (reply,) = px4.tell(request_list(7))
    assert (reply.get_type(), reply.count) == ("MISSION_COUNT", 0)
    (reply,) = ardupilot.tell(request_list(7))
    assert reply.type == mavlink.MAV_MISSION_UNSUPPORTED


# --- fence and rally ----------------------------------------------------------------------------------------


def corner(seq: int, north: int, east: int, corners: float = 4) -> Any:
    return item(seq, 5001, frame=0, params=(corners, 0, 0, 0), x=LAT + north, y=LON + east, kind=1)


SQUARE = ((-9000, -9000), (-9000, 9000), (9000, 9000), (9000, -9000))


def test_fence_and_rally_have_plans_of_their_own(vehicle: Vehicle) -> None:
    upload(vehicle, plan(3))
    assert upload(vehicle, [corner(i, *at) for i, at in enumerate(SQUARE)], kind=1).type == 0
    assert upload(vehicle, [item(0, 5100, frame=3, kind=2)], kind=2).type == 0
    assert [len(vehicle.stores[kind].items) for kind in MissionType] == [3, 4, 1]
    assert vehicle.changes == list(MissionType)


def test_px4_says_when_home_is_outside_the_fence(px4: Vehicle) -> None:
    upload(px4, [corner(i, *at) for i, at in enumerate(SQUARE)], kind=1)
    assert px4.take_texts() == []
    far = [corner(i, north + 100_000, east) for i, (north, east) in enumerate(SQUARE)]
    assert upload(px4, far, kind=1).type == 0
    assert px4.take_texts() == [(2, "Geofence invalid, doesn't contain Home position")]


@pytest.mark.parametrize(
    ("items", "result"),
    [
        ([item(0, WAYPOINT, kind=1)], mavlink.MAV_MISSION_UNSUPPORTED),
        ([corner(0, 0, 0, corners=2)], mavlink.MAV_MISSION_INVALID_PARAM1),
        ([corner(i, *at, corners=5) for i, at in enumerate(SQUARE)], mavlink.MAV_MISSION_INVALID_PARAM1),
        ([item(0, 5003, frame=0, params=(-3, 0, 0, 0), kind=1)], mavlink.MAV_MISSION_INVALID_PARAM1),
        ([item(0, 5003, frame=0, params=(50, 0, 0, 0), kind=1)], 0),
    ],
)
def test_fence_items(vehicle: Vehicle, items: list[Any], result: int) -> None:
    assert upload(vehicle, items, kind=1).type == result
    assert len(vehicle.stores[MissionType.FENCE].items) == (0 if result else len(items))


# --- download -----------------------------------------------------------------------------------------------


def test_px4_download(px4: Vehicle) -> None:
    end = upload(px4, [item(0, TAKEOFF, frame=RELATIVE), item(1, frame=0, params=(1, 2, 3, -90)), item(2)])
    (total,) = px4.tell(request_list())
    assert (total.count, total.opaque_id) == (3, end.opaque_id)
    got = [px4.tell(request(seq))[0] for seq in range(3)]
    assert names(got) == ["MISSION_ITEM_INT"] * 3
    assert [message.frame for message in got] == [6, 5, 6]
    assert [message.current for message in got] == [1, 0, 0]
    assert (got[1].x, got[1].y, got[1].z) == (LAT, LON, 10.0)
    # PX4 keeps hold time, radius and heading (0..360) of a waypoint, and nothing of the third parameter
    assert (got[1].param1, got[1].param2, got[1].param3, got[1].param4) == (1, 2, 0, 270)
    (repeated,) = px4.tell(request(2, as_int=False))
    assert (repeated.get_type(), repeated.frame) == ("MISSION_ITEM", 3)
    assert px4.tell(ack(0)) == []
    assert px4.tell(request(0)) == []


def test_px4_download_refuses_jumps_and_ends_in_silence(px4: Vehicle) -> None:
    upload(px4, plan(4))
    assert px4.tell(request(0)) == []
    px4.tell(request_list())
    (reply,) = px4.tell(request(99))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 1)
    assert px4.take_texts() == [(2, "WPM: REJ. CMD: Req. WP was unexpected")]
    px4.tell(request_list())
    (reply,) = px4.tell(count(3))
    assert reply.type == 1
    assert px4.take_texts() == [(2, "WPM: IGN MISSION_COUNT: Busy")]
    px4.tick(5.1)
    assert px4.take_texts() == [(2, "Operation timeout")]
    assert upload(px4, plan(2)).type == 0


def test_a_download_shows_one_plan_though_another_is_uploaded_meanwhile(px4: Vehicle) -> None:
    upload(px4, plan(4))
    px4.tell(request_list())
    stranger = Source(px4.other, 254, 1)
    px4.tell(count(1), stranger)
    px4.tell(item(0, TAKEOFF, z=77.0), stranger)
    assert len(px4.mission) == 1
    assert [px4.tell(request(seq))[0].z for seq in range(4)] == [10.0] * 4


def test_ardupilot_download(ardupilot: Vehicle) -> None:
    (total,) = ardupilot.tell(request_list())
    assert total.count == 0
    rtl = item(3, 20, frame=2, params=(0, 0, 0, 0), x=0, y=0)
    upload(ardupilot, [item(0, z=3.0), item(1, TAKEOFF), item(2, frame=0), rtl])
    (home,) = ardupilot.tell(request(0))
    assert (home.command, home.frame, home.x, home.y) == (16, 0, 473977400, 85455900)
    assert home.z == pytest.approx(489.4)
    got = [ardupilot.tell(request(seq))[0] for seq in (3, 1, 2)]
    assert [(message.seq, message.command, message.frame) for message in got] == [
        (3, 20, 0),
        (1, TAKEOFF, 3),
        (2, 16, 0),
    ]
    assert not any(message.current for message in got)
    failed = ardupilot.tell(request(4))
    assert names(failed) == ["MISSION_ACK", "MISSION_COUNT"]
    assert (failed[0].type, failed[1].count) == (1, 4)
    ardupilot.take_texts()
    (single,) = ardupilot.tell(request(1, as_int=False))
    assert single.get_type() == "MISSION_ITEM"
    assert ardupilot.take_texts() == [(4, "got MISSION_REQUEST; use MISSION_REQUEST_INT!")]


def test_ardupilot_home_follows_the_vehicle(ardupilot: Vehicle) -> None:
    ardupilot.home = None
    upload(ardupilot, [item(0, z=math.nan), item(1, TAKEOFF)])
    (home,) = ardupilot.tell(request(0))
    assert home.z == 0.0
    ardupilot.home = HOME
    (home,) = ardupilot.tell(request(0))
    assert home.z == pytest.approx(489.4)


def test_ardupilot_partial_write(ardupilot: Vehicle) -> None:
    upload(ardupilot, plan(4))
    ardupilot.take_texts()
    write = mavlink.MAVLink_mission_write_partial_list_message
    for start, end in ((3, 4), (-1, 0), (2, 1)):
        (reply,) = ardupilot.tell(write(1, 1, start, end, 0))
        assert reply.type == 1
        assert ardupilot.take_texts() == [(4, "Flight plan update rejected")]
    (asked,) = ardupilot.tell(write(1, 1, 1, 2, 0))
    assert asked.seq == 1
    ardupilot.tell(item(1, z=55.0))
    assert [each.z for each in ardupilot.mission[1:]] == [10.0, 10.0, 10.0]
    (end,) = ardupilot.tell(item(2, z=56.0))
    assert end.type == 0
    assert [each.z for each in ardupilot.mission[1:]] == [55.0, 56.0, 10.0]


def test_partial_messages_that_get_no_answer(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        upload(vehicle, plan(4))
        assert vehicle.tell(mavlink.MAVLink_mission_request_partial_list_message(1, 1, 0, 2, 0)) == []
    assert px4.tell(mavlink.MAVLink_mission_write_partial_list_message(1, 1, 1, 2, 0)) == []


# --- progress -----------------------------------------------------------------------------------------------


def test_set_current(px4: Vehicle, ardupilot: Vehicle) -> None:
    def choose(seq: int) -> Any:
        return mavlink.MAVLink_mission_set_current_message(1, 1, seq)

    for vehicle in (px4, ardupilot):
        upload(vehicle, plan(4))
        vehicle.take_texts()
        vehicle.tick(0.02)
    assert px4.tell(choose(2)) == []
    ((_, told),) = px4.tick(0.02)
    assert (told.get_type(), told.seq, told.total) == ("MISSION_CURRENT", 2, 4)
    assert px4.tell(choose(77)) == []
    assert px4.take_texts() == [(2, "WPM: WP CURR CMD: Not in list")]
    (told,) = ardupilot.tell(choose(2))
    assert (told.get_type(), told.seq, told.total) == ("MISSION_CURRENT", 2, 3)
    assert ardupilot.tell(choose(4)) == []
    assert ardupilot.take_texts() == []


def test_mission_current_on_the_wire_is_what_px4_sent() -> None:
    """Frames of a recorded PX4 1.16.1 flight."""
    packer = mavlink.MAVLink(None, 1, 1)

    def frame(seq: int, message: Any) -> str:
        packer.seq = seq
        return message.pack(packer).hex()

    flying = current_message(seq=1, total=10, state=0, mode=0, mission_id=0x98B60825, fence_id=0, rally_id=0)
    assert frame(0x09, flying) == "fd0a00000901012a000001000a0000002508b69816c3"
    assert frame(0xB1, Vehicle("px4").service.current_message()) == "fd040000b101012a00000000ffff4ee3"
    accepted = ack_message(Vehicle("px4").gcs, 0, 0, 0x98B60825)
    assert frame(0x15, accepted) == "fd0800001501012f0000ffbe00002508b6981cbb"
    # and an ArduCopter without a mission
    assert frame(0x5E, Vehicle("ardupilot").service.current_message()) == "fd0500005e01012a00000000000001f245"


def test_plan_identifiers_pass_an_encoder_that_does_not_know_them(px4: Vehicle) -> None:
    payloads: list[tuple[int, bytes]] = []
    px4.channel.send_payload = lambda number, payload: payloads.append((number, payload))  # type: ignore[attr-defined]
    px4.tell(count(1))
    px4.tell(item(0, TAKEOFF))
    plan_id = px4.stores[MissionType.MISSION].plan_id
    assert payloads == [(mavlink.MAVLINK_MSG_ID_MISSION_ACK, b"\xff\xbe\0\0" + plan_id.to_bytes(4, "little"))]


def test_a_receiver_without_the_extensions_understands_them() -> None:
    packer = mavlink.MAVLink(None, 1, 1)
    message = current_message(seq=3, total=9, state=0, mode=0, mission_id=7, fence_id=8, rally_id=9)
    (got,) = mavlink.MAVLink(None).parse_buffer(bytearray(message.pack(packer)))
    assert (got.seq, got.total) == (3, 9)


def test_ardupilot_mission_state(ardupilot: Vehicle) -> None:
    def state() -> tuple[int, int]:
        message = ardupilot.service.current_message()
        return message.mission_state, message.mission_mode

    assert state() == (1, 0)
    upload(ardupilot, plan(3))
    assert state() == (2, 0)
    ardupilot.task.active = True
    assert state() == (3, 1)
    ardupilot.task.complete = True
    assert state() == (5, 1)


def test_item_reached(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle, repeats in ((px4, 10), (ardupilot, 0)):
        upload(vehicle, plan(3))
        vehicle.tick(0.1)
        vehicle.other.take()
        vehicle.service.item_reached(1)
        assert [message.seq for message in vehicle.channel.take()] == [1]
        heard = vehicle.tick(20.0)
        assert names([message for _, message in heard]) == ["MISSION_ITEM_REACHED"] * repeats
        assert [round(when) for when, _ in heard] == list(range(1, repeats + 1))
        assert len(vehicle.other.take()) == repeats + 1


def test_upload_while_the_mission_is_flown(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        upload(vehicle, plan(4))
        vehicle.task.active = True
        vehicle.stores[MissionType.MISSION].current = 2
        vehicle.take_texts()
    assert upload(px4, plan(4)).type == 0
    assert px4.stores[MissionType.MISSION].current == 2  # the same mission: PX4 flies on
    upload(px4, plan(3))
    assert px4.stores[MissionType.MISSION].current == 0
    assert upload(ardupilot, plan(3)).type == 0
    assert ardupilot.stores[MissionType.MISSION].current == 2
    assert ardupilot.texts[0] == (2, "Auto mission changed but failed to restart command")


def test_guided_items_of_old_clients(ardupilot: Vehicle, px4: Vehicle) -> None:
    (reply,) = ardupilot.tell(item(0, z=30.0, current=2, params=(0, 0, 0, 0)))
    assert reply.type == 0
    assert [each.z for each in ardupilot.guided] == [30.0]
    (reply,) = ardupilot.tell(item(0, x=2**31 - 1, current=2, params=(0, 0, 0, 0)))
    assert reply.type == mavlink.MAV_MISSION_INVALID_PARAM5_X
    px4.tell(item(0, current=2))
    assert px4.guided == []


@pytest.mark.parametrize(
    ("items", "problem"),
    [
        ([item(0), item(1)], None),
        ([item(0, TAKEOFF), item(1)], None),
        ([item(0, 178, frame=2, params=(0, 5, 0, 0), x=0, y=0), item(1, TAKEOFF)], None),
        ([item(0, TAKEOFF, z=0.0), item(1)], "Mission rejected: Takeoff altitude below home altitude!"),
        ([item(0, TAKEOFF, frame=5, z=480.0)], "Mission rejected: Takeoff altitude below home altitude!"),
        ([item(0, TAKEOFF, frame=5, z=495.0)], None),
        ([item(0), item(1, TAKEOFF)], "Mission rejected: takeoff not first waypoint item"),
        ([item(0, TAKEOFF), item(1, TAKEOFF)], "Mission rejected: takeoff not first waypoint item"),
        ([item(0, 84), item(1)], "Mission rejected: item 1: unsupported command: 84"),
        ([item(0, LAND)], "Mission rejected: starts with landing"),
    ],
)
def test_px4_feasibility(px4: Vehicle, items: list[Any], problem: str | None) -> None:
    assert upload(px4, items).type == 0
    assert px4.service.problems() == (() if problem is None else (problem,))
    assert px4.service.mission_valid() == (problem is None)


def test_plan_identifiers_are_of_the_plan() -> None:
    px4 = Vehicle("px4")
    first = upload(px4, plan(3)).opaque_id
    assert upload(px4, plan(4)).opaque_id != first
    assert upload(px4, plan(3)).opaque_id == first
    items = px4.mission
    assert plan_checksum(items) == plan_checksum(items) != plan_checksum(items[:2])
    assert plan_checksum(()) == 0
