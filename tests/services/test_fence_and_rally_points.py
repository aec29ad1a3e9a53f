"""FENCE_POINT and RALLY_POINT of old ground stations."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.firmware.ardupilot.fence_and_rally_points import OldPoints, old_fence
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.plans.protocol import new_stores
from flightsim.airframe import AirframeKind
from tests.services.dispatch import deliver
from tests.services.mission_rig import Recorder

RING = [(47.0, 8.0), (47.0, 8.1), (47.1, 8.1), (47.1, 8.0)]
BACK = (47.05, 8.05)


class Vehicle:
    def __init__(self) -> None:
        flavour = get_flavour("ardupilot", AirframeKind.FIXED_WING)
        self.parameters = ParameterStore(flavour.parameter_definitions(), {})
        self.stores = new_stores()
        self.texts: list[str] = []
        self.service = OldPoints(self.parameters, self.stores, lambda _, text: self.texts.append(text))
        self.channel = Recorder("one")

    def deliver(self, message: Any) -> list[Any]:
        assert deliver(message, Source(self.channel, 255, 190), 0, self.service)
        self.service.tick(0)
        return self.channel.take()

    def total(self, kind: str, count: int) -> None:
        self.parameters.set(f"{kind}_TOTAL", count, check_range=False)

    def fence(self) -> tuple[MissionItem, ...]:
        return self.stores[MissionType.FENCE].items

    def rally(self) -> tuple[MissionItem, ...]:
        return self.stores[MissionType.RALLY].items


def fence_point(index: int, count: int, place: tuple[float, float]) -> Any:
    return mavlink.MAVLink_fence_point_message(1, 1, index, count, *place)


def rally_point(index: int, count: int, lat: float = 47.0, lon: float = 8.0, alt: int = 80) -> Any:
    return mavlink.MAVLink_rally_point_message(
        1, 1, index, count, round(lat * 1e7), round(lon * 1e7), alt, 40, 0, 0
    )


def send_fence(vehicle: Vehicle, points: list[tuple[float, float]]) -> None:
    vehicle.total("FENCE", len(points))
    for index, point in enumerate(points):
        vehicle.deliver(fence_point(index, len(points), point))


def test_a_fence_is_sent_and_read_back() -> None:
    vehicle = Vehicle()
    points = [BACK, *RING, RING[0]]
    send_fence(vehicle, points)
    assert [item.command for item in vehicle.fence()] == [5000, 5001, 5001, 5001, 5001]
    assert {item.param1 for item in vehicle.fence()[1:]} == {4.0}
    assert vehicle.parameters.get("FENCE_TOTAL") == 6
    read = [vehicle.deliver(mavlink.MAVLink_fence_fetch_point_message(1, 1, k))[0] for k in range(6)]
    assert [(m.lat, m.lng) for m in read] == points
    assert {m.count for m in read} == {6}
    assert vehicle.texts == [f"Received message (FENCE_{x}) is deprecated" for x in ("POINT", "FETCH_POINT")]
    vehicle.total("FENCE", 0)
    assert vehicle.fence() == ()


@pytest.mark.parametrize(
    ("total", "message", "text"),
    [
        (4, fence_point(0, 4, BACK), "Invalid FENCE_TOTAL"),
        (6, fence_point(0, 5, BACK), "Invalid fence point, bad count (5 vs 6)"),
        (6, fence_point(6, 6, BACK), "Invalid fence point, index past total (6 >= 6)"),
        (6, fence_point(1, 6, (91.0, 0.0)), "Invalid fence point, bad lat or lng"),
        (6, fence_point(1, 6, (0.0, -180.5)), "Invalid fence point, bad lat or lng"),
        (6, fence_point(1, 6, (float("nan"), 0.0)), "Invalid fence point, bad lat or lng"),
    ],
)
def test_bad_fence_points_change_nothing(total: int, message: Any, text: str) -> None:
    vehicle = Vehicle()
    vehicle.total("FENCE", total)
    vehicle.deliver(message)
    assert vehicle.texts[-1] == text
    assert vehicle.fence() == ()


def test_an_open_or_incomplete_fence_is_not_stored() -> None:
    vehicle = Vehicle()
    send_fence(vehicle, [BACK, *RING, (47.2, 8.2)])
    assert vehicle.fence() == ()
    vehicle.total("FENCE", 6)
    for index in (0, 1, 2):
        vehicle.deliver(fence_point(index, 6, BACK))
    assert vehicle.fence() == ()


def test_a_fence_that_the_messages_can_not_carry() -> None:
    vehicle = Vehicle()
    circle = MissionItem(
        command=mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, frame=0, param1=50.0, x=47.0, y=8.0
    )
    vehicle.stores[MissionType.FENCE].replace((circle,), 1)
    assert old_fence((circle,)) is None
    assert vehicle.deliver(mavlink.MAVLink_fence_fetch_point_message(1, 1, 0)) == []
    assert vehicle.texts[-1] == "Vehicle contains advanced fences"
    assert vehicle.parameters.get("FENCE_TOTAL") == 1


def test_rally_points() -> None:
    vehicle = Vehicle()
    vehicle.total("RALLY", 2)
    vehicle.deliver(rally_point(1, 2, 47.5))
    assert vehicle.rally() == ()
    vehicle.deliver(rally_point(0, 2, alt=-20))
    assert [item.x for item in vehicle.rally()] == pytest.approx([47.0, 47.5])
    assert [item.z for item in vehicle.rally()] == [-20.0, 80.0]
    (back,) = vehicle.deliver(mavlink.MAVLink_rally_fetch_point_message(1, 1, 1))
    assert (back.idx, back.count, back.lat, back.alt) == (1, 2, 475000000, 80)
    assert (back.break_alt, back.land_dir, back.flags) == (0, 0, 0)
    assert vehicle.deliver(mavlink.MAVLink_rally_fetch_point_message(1, 1, 2)) == []
    assert vehicle.texts[-1] == "Bad rally point ID"
    for message, text in (
        (rally_point(2, 2), "Bad rally point message ID"),
        (rally_point(0, 3), "Bad rally point message count"),
        (rally_point(0, 2, 95.0), "Bad rally point message lat or lng"),
    ):
        vehicle.deliver(message)
        assert vehicle.texts[-1] == text
    vehicle.total("RALLY", 1)
    assert len(vehicle.rally()) == 1
