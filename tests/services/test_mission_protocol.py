"""Fences, downloads and progress of the mission protocol.

Expected: docs/firmware/px4.md, section 10, and docs/firmware/ardupilot.md, section 5.
"""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.plans.messages import ack_message, current_message, plan_checksum
from tests.services.mission_rig import (
    HOME,
    LAND,
    LAT,
    LON,
    RELATIVE,
    TAKEOFF,
    WAYPOINT,
    Vehicle,
    ack,
    count,
    item,
    names,
    plan,
    request,
    request_list,
    upload,
)

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


def test_px4_takes_a_circle_of_no_radius(px4: Vehicle) -> None:
    empty = item(0, 5003, frame=0, params=(0, 0, 0, 0), kind=1)
    assert upload(px4, [empty], kind=1).type == mavlink.MAV_MISSION_ACCEPTED


def test_ardupilot_refuses_a_circle_of_no_radius(ardupilot: Vehicle) -> None:
    empty = item(0, 5003, frame=0, params=(0, 0, 0, 0), kind=1)
    assert upload(ardupilot, [empty], kind=1).type == mavlink.MAV_MISSION_INVALID_PARAM1


# --- download -----------------------------------------------------------------------------------------------


def test_px4_download(px4: Vehicle) -> None:
    end = upload(px4, [item(0, TAKEOFF, frame=RELATIVE), item(1, frame=0, params=(1, 2, 3, -90)), item(2)])
    (total,) = px4.deliver(request_list())
    assert (total.count, total.opaque_id) == (3, end.opaque_id)
    got = [px4.deliver(request(seq))[0] for seq in range(3)]
    assert names(got) == ["MISSION_ITEM_INT"] * 3
    assert [message.frame for message in got] == [6, 5, 6]
    assert [message.current for message in got] == [1, 0, 0]
    assert (got[1].x, got[1].y, got[1].z) == (LAT, LON, 10.0)
    # PX4 keeps hold time, radius and heading (0..360) of a waypoint, and nothing of the third parameter
    assert (got[1].param1, got[1].param2, got[1].param3, got[1].param4) == (1, 2, 0, 270)
    (repeated,) = px4.deliver(request(2, as_int=False))
    assert (repeated.get_type(), repeated.frame) == ("MISSION_ITEM", 3)
    assert px4.deliver(ack(0)) == []
    assert px4.deliver(request(0)) == []


def test_px4_download_refuses_jumps_and_ends_in_silence(px4: Vehicle) -> None:
    upload(px4, plan(4))
    assert px4.deliver(request(0)) == []
    px4.deliver(request_list())
    (reply,) = px4.deliver(request(99))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 1)
    assert px4.take_texts() == [(2, "WPM: REJ. CMD: Req. WP was unexpected")]
    px4.deliver(request_list())
    (reply,) = px4.deliver(count(3))
    assert reply.type == 1
    assert px4.take_texts() == [(2, "WPM: IGN MISSION_COUNT: Busy")]
    px4.tick(5.1)
    assert px4.take_texts() == [(2, "Operation timeout")]
    assert upload(px4, plan(2)).type == 0


def test_a_slow_download_goes_on_while_requests_come(px4: Vehicle) -> None:
    """The timeout of 5 s counts from the last request, whenever the download began."""
    upload(px4, plan(4))
    px4.tick(100.0)
    px4.deliver(request_list())
    for seq in range(4):
        px4.tick(4.5)
        assert names(px4.deliver(request(seq))) == ["MISSION_ITEM_INT"]
    assert px4.take_texts() == []


def test_a_download_shows_one_plan_though_another_is_uploaded_meanwhile(px4: Vehicle) -> None:
    upload(px4, plan(4))
    px4.deliver(request_list())
    stranger = Source(px4.other, 254, 1)
    px4.deliver(count(1), stranger)
    px4.deliver(item(0, TAKEOFF, z=77.0), stranger)
    assert len(px4.mission) == 1
    assert [px4.deliver(request(seq))[0].z for seq in range(4)] == [10.0] * 4


def test_ardupilot_download(ardupilot: Vehicle) -> None:
    (total,) = ardupilot.deliver(request_list())
    assert total.count == 0
    rtl = item(3, 20, frame=2, params=(0, 0, 0, 0), x=0, y=0)
    upload(ardupilot, [item(0, z=3.0), item(1, TAKEOFF), item(2, frame=0), rtl])
    (home,) = ardupilot.deliver(request(0))
    assert (home.command, home.frame, home.x, home.y) == (16, 0, 473977400, 85455900)
    assert home.z == pytest.approx(489.4)
    got = [ardupilot.deliver(request(seq))[0] for seq in (3, 1, 2)]
    assert [(message.seq, message.command, message.frame) for message in got] == [
        (3, 20, 0),
        (1, TAKEOFF, 3),
        (2, 16, 0),
    ]
    assert not any(message.current for message in got)
    failed = ardupilot.deliver(request(4))
    assert names(failed) == ["MISSION_ACK", "MISSION_COUNT"]
    assert (failed[0].type, failed[1].count) == (1, 4)
    ardupilot.take_texts()
    (single,) = ardupilot.deliver(request(1, as_int=False))
    assert single.get_type() == "MISSION_ITEM"
    assert ardupilot.take_texts() == [(4, "got MISSION_REQUEST; use MISSION_REQUEST_INT!")]


def test_ardupilot_home_follows_the_vehicle(ardupilot: Vehicle) -> None:
    ardupilot.home = None
    upload(ardupilot, [item(0, z=math.nan), item(1, TAKEOFF)])
    (home,) = ardupilot.deliver(request(0))
    assert home.z == 0.0
    ardupilot.home = HOME
    (home,) = ardupilot.deliver(request(0))
    assert home.z == pytest.approx(489.4)


def test_ardupilot_partial_write(ardupilot: Vehicle) -> None:
    upload(ardupilot, plan(4))
    ardupilot.take_texts()
    write = mavlink.MAVLink_mission_write_partial_list_message
    for start, end in ((3, 4), (-1, 0), (2, 1)):
        (reply,) = ardupilot.deliver(write(1, 1, start, end, 0))
        assert reply.type == 1
        assert ardupilot.take_texts() == [(4, "Flight plan update rejected")]
    (requested,) = ardupilot.deliver(write(1, 1, 1, 2, 0))
    assert requested.seq == 1
    ardupilot.deliver(item(1, z=55.0))
    assert [each.z for each in ardupilot.mission[1:]] == [10.0, 10.0, 10.0]
    (end,) = ardupilot.deliver(item(2, z=56.0))
    assert end.type == 0
    assert [each.z for each in ardupilot.mission[1:]] == [55.0, 56.0, 10.0]


def test_partial_messages_that_get_no_answer(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        upload(vehicle, plan(4))
        assert vehicle.deliver(mavlink.MAVLink_mission_request_partial_list_message(1, 1, 0, 2, 0)) == []
    assert px4.deliver(mavlink.MAVLink_mission_write_partial_list_message(1, 1, 1, 2, 0)) == []


# --- progress -----------------------------------------------------------------------------------------------


def test_set_current(px4: Vehicle, ardupilot: Vehicle) -> None:
    def choose(seq: int) -> Any:
        return mavlink.MAVLink_mission_set_current_message(1, 1, seq)

    for vehicle in (px4, ardupilot):
        upload(vehicle, plan(4))
        vehicle.take_texts()
        vehicle.tick(0.02)
    assert px4.deliver(choose(2)) == []
    ((_, reported),) = px4.tick(0.02)
    assert (reported.get_type(), reported.seq, reported.total) == ("MISSION_CURRENT", 2, 4)
    assert px4.deliver(choose(77)) == []
    assert px4.take_texts() == [(2, "WPM: WP CURR CMD: Not in list")]
    (reported,) = ardupilot.deliver(choose(2))
    assert (reported.get_type(), reported.seq, reported.total) == ("MISSION_CURRENT", 2, 3)
    assert ardupilot.deliver(choose(4)) == []
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
    px4.deliver(count(1))
    px4.deliver(item(0, TAKEOFF))
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
        return message.mission_state, message.mission_mode  # type: ignore[attr-defined]

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
        received = vehicle.tick(0.02)
        assert [message.seq for _, message in received] == [1]
        received = vehicle.tick(20.0)
        assert names([message for _, message in received]) == ["MISSION_ITEM_REACHED"] * repeats
        assert [round(when) for when, _ in received] == list(range(1, repeats + 1))
        assert len(vehicle.other.take()) == repeats + 1


def test_a_waypoint_directly_before_a_do_item_is_not_reported(vehicle: Vehicle) -> None:
    upload(vehicle, plan(4))
    vehicle.tick(0.1)
    vehicle.service.item_reached(1)
    vehicle.service.item_reached(2)  # DO_CHANGE_SPEED, done at once
    reached = mavlink.MAVLINK_MSG_ID_MISSION_ITEM_REACHED
    assert [m.seq for _, m in vehicle.tick(0.5) if m.get_msgId() == reached] == [2]


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
    (reply,) = ardupilot.deliver(item(0, z=30.0, current=2, params=(0, 0, 0, 0)))
    assert reply.type == 0
    assert [each.z for each in ardupilot.guided] == [30.0]
    (reply,) = ardupilot.deliver(item(0, x=2**31 - 1, current=2, params=(0, 0, 0, 0)))
    assert reply.type == mavlink.MAV_MISSION_INVALID_PARAM5_X
    px4.deliver(item(0, current=2))
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
        ([item(0, 84), item(1)], "Mission rejected: Mission contains VTOL items but vehicle is not a VTOL"),
        ([item(0, LAND)], "Mission rejected: starts with landing"),
    ],
)
def test_px4_feasibility(px4: Vehicle, items: list[Any], problem: str | None) -> None:
    assert upload(px4, items).type == 0
    assert px4.service.problems() == (() if problem is None else (problem,))
    assert px4.service.mission_valid() == (problem is None)
    assert px4.take_texts() == ([] if problem is None else [(2, problem)])


def test_plan_identifiers_are_of_the_plan() -> None:
    px4 = Vehicle("px4")
    first = upload(px4, plan(3)).opaque_id
    assert upload(px4, plan(4)).opaque_id != first
    assert upload(px4, plan(3)).opaque_id == first
    items = px4.mission
    assert plan_checksum(items) == plan_checksum(items) != plan_checksum(items[:2])
    assert plan_checksum(()) == 0


def test_there_is_no_item_after_the_last(vehicle: Vehicle) -> None:
    upload(vehicle, plan(4))
    assert vehicle.service.set_current(3)
    assert vehicle.stores[MissionType.MISSION].current == 3
    for seq in (4, 5, -1):
        assert not vehicle.service.set_current(seq)
    assert vehicle.stores[MissionType.MISSION].current == 3


def test_px4_continues_from_the_item_that_is_marked(px4: Vehicle) -> None:
    items = plan(4)
    items[2].current = 1
    upload(px4, items)
    assert px4.stores[MissionType.MISSION].current == 2
    upload(px4, plan(3))
    assert px4.stores[MissionType.MISSION].current == 0


def test_px4_flies_on_only_with_the_same_plan(px4: Vehicle) -> None:
    upload(px4, plan(4))
    px4.task.active = True
    px4.stores[MissionType.MISSION].current = 2
    upload(px4, plan(4))
    assert px4.stores[MissionType.MISSION].current == 2
    other = plan(4)
    other[3].x += 5000
    upload(px4, other)  # as many items, other ones
    assert px4.stores[MissionType.MISSION].current == 0
    assert px4.mission[3].x == pytest.approx(other[3].x * 1e-7)
    px4.stores[MissionType.MISSION].current = 2
    upload(px4, plan(3))
    assert px4.stores[MissionType.MISSION].current == 0


@pytest.mark.parametrize(("flown", "size", "current"), [(3, 2, 1), (1, 2, 1), (2, 5, 2)])
def test_ardupilot_finishes_its_leg_within_a_new_plan(
    ardupilot: Vehicle, flown: int, size: int, current: int
) -> None:
    upload(ardupilot, plan(5))
    ardupilot.task.active = True
    ardupilot.stores[MissionType.MISSION].current = flown
    upload(ardupilot, plan(size))
    assert ardupilot.stores[MissionType.MISSION].current == current


@pytest.mark.parametrize(("seq", "sent"), [(0, True), (65_535, True), (-1, False), (65_536, False)])
def test_numbers_of_reached_items_fit_their_message(px4: Vehicle, seq: int, sent: bool) -> None:
    px4.service.item_reached(seq)
    found = [m for _, m in px4.tick(0.1) if m.get_type() == "MISSION_ITEM_REACHED"]
    assert bool(found) is sent
