"""Mission files on an autopilot that reports items as firmware does, over links that lose messages."""

from dataclasses import replace
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem
from missions.errors import TakenOver
from missions.plan_files.document import MissionDocument
from missions.plan_files.flight import fly_document
from missions.plan_files.options import FileOptions
from tests.missions.conftest import HOME, PX4_HOLD, PX4_RTL

both = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
LOST = {
    "nothing": (),
    "reached": ("MISSION_ITEM_REACHED",),
    "current": ("MISSION_CURRENT",),
    "both": ("MISSION_ITEM_REACHED", "MISSION_CURRENT"),
}


def document(*, lands: bool = True) -> MissionDocument:
    lat, lon = HOME.lat_deg, HOME.lon_deg
    items = [
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, x=lat, y=lon, z=10.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=lat + 4e-4, y=lon, z=10.0),
        MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param1=1.0, param2=4.0, param3=-1.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=lat + 4e-4, y=lon + 4e-4, z=10.0),
        MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param1=1.0, param2=6.0, param3=-1.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=lat + 1e-4, y=lon + 4e-4, z=10.0),
    ]
    items += [MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2)] if lands else []
    return MissionDocument(path=Path("a.plan"), items=tuple(items))


def fly_losing(flown, flavour, names, *, lands=True, then=None):
    async def script(vehicle, autopilot):
        send = autopilot.send
        started_us = []

        def lossy(message):
            if not (started_us and message.get_type() in names):
                send(message)

        autopilot.send = lossy
        start = vehicle.start_mission

        async def start_and_lose():
            await start()
            started_us.append(autopilot.time_us)

        vehicle.start_mission = start_and_lose
        if then is not None:
            then(autopilot)
        await fly_document(vehicle, FileOptions(), document(lands=lands))
        return vehicle.notes

    return flown(script, flavour)


@both
@pytest.mark.parametrize("lost", LOST)
@pytest.mark.sampled(3)
def test_a_mission_with_do_items_is_followed_to_its_end(flown, flavour, lost) -> None:
    notes = fly_losing(flown, flavour, LOST[lost])
    assert [p.name for p in notes.phases][-3:] == ["takeoff", "pattern", "return"]
    assert [index for index, _ in notes.reached][:6] == [0, 1, 2, 3, 4, 5]


@both
@pytest.mark.parametrize("lost", LOST)
@pytest.mark.sampled(3)
def test_a_mission_that_ends_in_the_air_is_followed_to_its_end(flown, flavour, lost) -> None:
    notes = fly_losing(flown, flavour, LOST[lost], lands=False)
    assert [index for index, _ in notes.reached] == [0, 1, 2, 3, 4, 5]


@both
def test_a_mission_that_is_left_on_the_way_fails(flown, flavour) -> None:
    def leave(autopilot):
        fly_on = autopilot._fly_mission

        def until_the_second_place():
            if autopilot.current > (4 if autopilot.flavour == "ardupilot" else 3):
                autopilot.mode = PX4_RTL if autopilot.flavour == "px4" else 6
            return fly_on()

        autopilot._fly_mission = until_the_second_place

    with pytest.raises(TakenOver, match=r"has the vehicle, mode R\w+; nothing was commanded"):
        fly_losing(flown, flavour, (), then=leave)


def test_a_vehicle_that_holds_on_the_ground_before_it_disarms_has_landed(flown) -> None:
    """PX4 1.16.1: the mission is over at the touch-down, disarmed some seconds later."""
    land = replace(
        document().items[-1], command=mavlink.MAV_CMD_NAV_LAND, frame=6, x=HOME.lat_deg, y=HOME.lon_deg
    )
    landing = replace(document(), items=(*document().items[:-1], land))

    async def script(vehicle, autopilot):
        fly_mission, down_us = autopilot._fly_mission, []

        def come_down():
            if autopilot.current < len(landing.items) - 1:
                return fly_mission()
            return (0.0, 0.0, 1.5)

        fly = autopilot._fly

        def touch_down(dt):
            fly(dt)
            if autopilot.kind == "mission" and autopilot.pos[2] >= 0.0 and autopilot.current == 6:
                autopilot.mode = PX4_HOLD
                down_us.append(autopilot.time_us)
            if down_us and autopilot.time_us > down_us[0] + 6_000_000:
                autopilot.armed = False

        autopilot._fly_mission, autopilot._fly = come_down, touch_down
        await fly_document(vehicle, FileOptions(), landing)
        return vehicle.notes

    assert flown(script).phases[-1].name == "return"
