"""Uploads in the mission protocol, against docs/firmware (px4.md, section 10; ardupilot.md, section 5)."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.ardupilot.mission_rules import ARDUPILOT_MISSION_POLICY
from autopilot_bridge.firmware.px4.mission_rules import PX4_MISSION_POLICY
from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.services.channel import Source
from tests.services.mission_rig import (
    LAND,
    RELATIVE,
    RELATIVE_INT,
    TAKEOFF,
    WAYPOINT,
    Vehicle,
    ack,
    count,
    item,
    plan,
    request_list,
    upload,
)


def test_px4_asks_for_the_first_item_ever_with_the_float_message(px4: Vehicle) -> None:
    items = plan(3)
    (first,) = px4.deliver(count(3))
    assert (first.get_type(), first.seq) == ("MISSION_REQUEST", 0)
    (second,) = px4.deliver(items[0])
    assert (second.get_type(), second.seq) == ("MISSION_REQUEST_INT", 1)
    px4.deliver(items[1])
    (end,) = px4.deliver(items[2])
    assert (end.get_type(), end.type) == ("MISSION_ACK", 0)
    assert (end.target_system, end.target_component) == (255, 190)
    assert end.opaque_id == px4.stores[MissionType.MISSION].plan_id != 0
    (again,) = px4.deliver(count(3))
    assert again.get_type() == "MISSION_REQUEST_INT"
    assert len(px4.mission) == 3
    assert px4.changes == [MissionType.MISSION]


def test_px4_turns_to_the_integer_message_when_the_float_one_is_refused(px4: Vehicle) -> None:
    px4.deliver(count(2))
    (requested,) = px4.deliver(ack(mavlink.MAV_MISSION_UNSUPPORTED))
    assert (requested.get_type(), requested.seq) == ("MISSION_REQUEST_INT", 0)


def test_ardupilot_always_asks_with_mission_request(ardupilot: Vehicle) -> None:
    items = plan(3)
    requested = ardupilot.deliver(count(3)) + ardupilot.deliver(items[0]) + ardupilot.deliver(items[1])
    assert [(message.get_type(), message.seq) for message in requested] == [
        ("MISSION_REQUEST", 0),
        ("MISSION_REQUEST", 1),
        ("MISSION_REQUEST", 2),
    ]
    (end,) = ardupilot.deliver(items[2])
    assert (end.get_type(), end.type, end.opaque_id) == ("MISSION_ACK", 0, 0)
    assert ardupilot.take_texts() == [(mavlink.MAV_SEVERITY_INFO, "Flight plan received")]


def test_float_items_are_taken(vehicle: Vehicle) -> None:
    vehicle.deliver(count(2))
    for seq in range(2):
        (reply,) = vehicle.deliver(
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
    vehicle.deliver(count(5))
    vehicle.deliver(plan(5)[0])
    received = vehicle.tick(12.0)
    again = [(when, message) for when, message in received if "REQUEST" in message.get_type()]
    assert again[0][0] == pytest.approx(retry_s, abs=0.03)
    assert all(message.seq == 1 for _, message in again)
    assert timeout_s - retry_s - 0.05 < again[-1][0] <= timeout_s + 0.03
    assert vehicle.take_texts() == [text]
    ends = [(when, message.type) for when, message in received if message.get_type() == "MISSION_ACK"]
    assert ends == ([] if flavour == "px4" else [(pytest.approx(8.02, abs=0.03), 15)])
    assert vehicle.mission == before
    assert upload(vehicle, plan(2)).type == 0


def test_px4_ignores_items_out_of_sequence(px4: Vehicle) -> None:
    items = plan(4)
    px4.deliver(count(4))
    assert px4.deliver(items[2]) == []
    assert [message.seq for _, message in px4.tick(0.3)] == [0]


def test_ardupilot_refuses_items_out_of_sequence_and_goes_on(ardupilot: Vehicle) -> None:
    items = plan(3)
    ardupilot.deliver(count(3))
    ardupilot.deliver(items[0])
    for wrong in (items[0], items[2]):
        (reply,) = ardupilot.deliver(wrong)
        assert (reply.get_type(), reply.type) == ("MISSION_ACK", mavlink.MAV_MISSION_INVALID_SEQUENCE)
    ardupilot.deliver(items[1])
    (end,) = ardupilot.deliver(items[2])
    assert end.type == 0


def test_second_count(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        vehicle.deliver(count(4))
        vehicle.deliver(plan(4)[0])
    (reply,) = px4.deliver(count(4))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 1)
    assert px4.take_texts() == [(2, "WPM: REJ. CMD: Busy")]
    (requested,) = px4.deliver(plan(4)[1])
    assert requested.seq == 2
    (restarted,) = ardupilot.deliver(count(2))
    assert (restarted.get_type(), restarted.seq) == ("MISSION_REQUEST", 0)


def test_a_count_again_before_the_first_item_is_answered_again(px4: Vehicle) -> None:
    px4.deliver(count(4))
    (requested,) = px4.deliver(count(4))
    assert (requested.get_type(), requested.seq) == ("MISSION_REQUEST", 0)


def test_unsolicited_items(vehicle: Vehicle) -> None:
    (reply,) = vehicle.deliver(item(3))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", mavlink.MAV_MISSION_ERROR)
    px4 = vehicle.policy is PX4_MISSION_POLICY
    assert ((2, "IGN MISSION_ITEM: No transfer") in vehicle.texts) == px4


def test_px4_acknowledges_the_last_item_again(px4: Vehicle) -> None:
    items = plan(3)
    first = upload(px4, items)
    (again,) = px4.deliver(items[-1])
    assert (again.type, again.opaque_id) == (0, first.opaque_id)


@pytest.mark.parametrize(("flavour", "capacity"), [("px4", 10_000), ("ardupilot", 650)])
def test_capacity(flavour: str, capacity: int) -> None:
    vehicle = Vehicle(flavour)
    (requested,) = vehicle.deliver(count(capacity))
    assert "REQUEST" in requested.get_type()
    vehicle = Vehicle(flavour)
    (reply,) = vehicle.deliver(count(capacity + 1))
    assert reply.type == mavlink.MAV_MISSION_NO_SPACE
    assert vehicle.texts == ([] if flavour == "px4" else [(4, "Only 650 items are supported")])


def test_count_zero_and_clear_all_empty_the_plan(vehicle: Vehicle) -> None:
    for emptying in (count(0), mavlink.MAVLink_mission_clear_all_message(1, 1, 0)):
        upload(vehicle, plan(3))
        (reply,) = vehicle.deliver(emptying)
        assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0)
        assert vehicle.mission == ()
        assert not vehicle.service.mission_valid()


def test_clear_all_types(px4: Vehicle, ardupilot: Vehicle) -> None:
    upload(px4, plan(3))
    for kind in (255, 7):
        (reply,) = px4.deliver(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))
        assert reply.type == 0
    assert px4.mission == ()
    upload(ardupilot, plan(3))
    for kind in (255, 7):
        (reply,) = ardupilot.deliver(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))
        assert reply.type == mavlink.MAV_MISSION_UNSUPPORTED
    ardupilot.task.active = True
    (reply,) = ardupilot.deliver(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    assert reply.type == mavlink.MAV_MISSION_ERROR
    assert len(ardupilot.mission) == 3


def test_the_partner_can_cancel(vehicle: Vehicle) -> None:
    upload(vehicle, plan(3))
    vehicle.tick(0.1)
    before = vehicle.mission
    vehicle.deliver(count(4))
    vehicle.deliver(plan(4)[0])
    assert vehicle.deliver(ack(mavlink.MAV_MISSION_OPERATION_CANCELLED)) == []
    vehicle.take_texts()
    assert vehicle.tick(10.0) == []
    assert vehicle.take_texts() == []
    assert vehicle.mission == before


def test_another_partner_does_not_disturb_an_upload(vehicle: Vehicle) -> None:
    items = plan(3)
    vehicle.deliver(count(3))
    stranger = Source(vehicle.other, 254, 1)
    (reply,) = vehicle.deliver(count(2), stranger)
    assert reply.type == vehicle.policy.foreign_count_result
    vehicle.deliver(item(0, z=99.0), stranger)
    vehicle.deliver(ack(mavlink.MAV_MISSION_OPERATION_CANCELLED), stranger)
    for each in items:
        (reply,) = vehicle.deliver(each)
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0)
    assert vehicle.mission[1].z == 10.0


@pytest.mark.parametrize("changed", [{"system_id": 254}, {"component_id": 191}])
def test_a_partner_is_a_component_on_a_channel(vehicle: Vehicle, changed: dict[str, int]) -> None:
    """The answers go to the client that sent the message; a cancellation by another one has no effect."""
    vehicle.deliver(count(3))
    stranger = vehicle.gcs._replace(**changed)
    (reply,) = vehicle.deliver(count(2), stranger)
    assert reply.type == vehicle.policy.foreign_count_result
    assert (reply.target_system, reply.target_component) == (stranger.system_id, stranger.component_id)
    twin = vehicle.gcs._replace(channel=vehicle.other)
    for other in (stranger, twin):
        assert vehicle.deliver(ack(mavlink.MAV_MISSION_OPERATION_CANCELLED), other) == []
        assert vehicle.deliver(ack(mavlink.MAV_MISSION_UNSUPPORTED), other) == []
    for each in plan(3):
        (reply,) = vehicle.deliver(each)
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0) and len(vehicle.stores[0].items) == 3  # type: ignore[index]


def test_an_item_of_another_partner_is_refused_as_each_firmware_does(vehicle: Vehicle) -> None:
    vehicle.deliver(count(3))
    stranger = vehicle.gcs._replace(component_id=191)
    replies = vehicle.deliver(item(0, z=99.0), stranger)
    if vehicle.policy is PX4_MISSION_POLICY:
        assert replies == [] and vehicle.texts[-1][1] == "REJ. MIS ITEM: partner id mismatch"
    else:
        (reply,) = replies
        assert (reply.type, reply.target_component) == (mavlink.MAV_MISSION_DENIED, 191)


@pytest.mark.parametrize("changed", [{"system_id": 254}, {"component_id": 191}])
def test_the_last_item_again_is_acknowledged_again_for_its_sender(
    px4: Vehicle, changed: dict[str, int]
) -> None:
    items = plan(2)
    upload(px4, items)
    plan_id = px4.stores[MissionType.MISSION].plan_id
    (again,) = px4.deliver(items[1])
    assert (again.type, again.opaque_id) == (0, plan_id)
    for message, source in (
        (items[0], px4.gcs),
        (item(1, kind=1), px4.gcs),
        (items[1], px4.gcs._replace(**changed)),
        (items[1], px4.gcs._replace(channel=px4.other)),
    ):
        px4.take_texts()
        (refused,) = px4.deliver(message, source)
        assert refused.type == mavlink.MAV_MISSION_ERROR
        assert px4.take_texts()[-1][1] == "IGN MISSION_ITEM: No transfer"


@pytest.mark.parametrize(
    ("flavour", "retry_s", "timeout_s", "ends"), [("px4", 0.25, 5.0, []), ("ardupilot", 1.0, 8.0, [15])]
)
def test_when_an_item_is_requested_again_and_when_the_upload_ends(
    flavour: str, retry_s: float, timeout_s: float, ends: list[int]
) -> None:
    vehicle = Vehicle(flavour)
    vehicle.deliver(count(2))
    received = vehicle.tick(timeout_s + 3.0)
    requested = [at for at, message in received if message.get_type().startswith("MISSION_REQUEST")]
    tick_s = 0.02
    step_s = tick_s * (math.floor(retry_s / tick_s + 1e-9) + 1)  # after the time, not at it
    assert requested == pytest.approx([step_s * (k + 1) for k in range(int(timeout_s / step_s + 1e-9))])
    acks = [(at, message.type) for at, message in received if message.get_type() == "MISSION_ACK"]
    assert [kind for _, kind in acks] == ends
    assert [at for at, _ in acks] == pytest.approx([timeout_s + tick_s] * len(ends))


@pytest.mark.parametrize(
    ("first", "last", "accepted"), [(0, 2, True), (1, 1, True), (2, 3, False), (-1, 1, False), (2, 1, False)]
)
def test_a_part_of_a_plan_is_uploaded_again(
    ardupilot: Vehicle, first: int, last: int, accepted: bool
) -> None:
    upload(ardupilot, plan(3))
    message = mavlink.MAVLink_mission_write_partial_list_message(1, 1, first, last, 0)
    (reply,) = ardupilot.deliver(message)
    assert (reply.get_type() == "MISSION_REQUEST") == accepted
    if not accepted:
        assert reply.type == mavlink.MAV_MISSION_ERROR
        return
    for seq in range(first, last + 1):
        assert reply.seq == seq
        (reply,) = ardupilot.deliver(item(seq, z=77.0))
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", 0)
    changed = [index for index, each in enumerate(ardupilot.mission) if each.z == 77.0]
    assert len(ardupilot.mission) == 3 and set(changed) == set(range(first, last + 1)) - {0}  # 0 is home


def test_a_part_is_refused_for_another_partner_and_an_unknown_type(ardupilot: Vehicle) -> None:
    upload(ardupilot, plan(3))
    unknown = mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 1, 77)
    assert ardupilot.deliver(unknown)[0].type == mavlink.MAV_MISSION_UNSUPPORTED
    ardupilot.deliver(count(2))
    part = mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 1, 0)
    (reply,) = ardupilot.deliver(part, ardupilot.gcs._replace(component_id=191))
    assert reply.type == mavlink.MAV_MISSION_DENIED


BAD: list[tuple[Any, int | None, int]] = [
    # (item 1 of a mission, PX4's result, ArduPilot's result)
    (item(1, 9999), 3, 3),
    (item(1, 20, frame=RELATIVE_INT, params=(0, 0, 0, 0), x=0, y=0), 3, 0),  # seen with PX4 1.16.1
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
        (after,) = vehicle.deliver(item(2))
        assert after.type == mavlink.MAV_MISSION_ERROR


def test_unknown_mission_types(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        (reply,) = vehicle.deliver(count(2, kind=7))
        assert reply.type == mavlink.MAV_MISSION_UNSUPPORTED
    (reply,) = px4.deliver(request_list(7))
    assert (reply.get_type(), reply.count) == ("MISSION_COUNT", 0)
    (reply,) = ardupilot.deliver(request_list(7))
    assert reply.type == mavlink.MAV_MISSION_UNSUPPORTED
