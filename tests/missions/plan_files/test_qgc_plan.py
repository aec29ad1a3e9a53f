"""QGroundControl's plan files: what is read, expanded, refused, and written."""

import json
import math
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.home import Home
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.plan_files.document import PlannedHome
from missions.plan_files.files import read_mission_file, write_mission_file
from missions.plan_files.mission import FileMission
from tests.missions.plan_files.plans import ALT, LANDING, LAT, LON, PLAN, changed, simple, waypoint, write

UNKNOWN_TERRAIN = {
    **simple(2, 16, [0, 0, 0, None, LAT, LON, None]),
    "AMSLAltAboveTerrain": None,
    "Altitude": 12,
    "AltitudeMode": 1,
}


def test_everything_in_a_plan_is_read(tmp_path: Path) -> None:
    document = read_mission_file(write(tmp_path))
    assert [item.command for item in document.items] == [22, 16, 16, 16, 206, 16, 177, 20]
    assert document.home == PlannedHome(lat_deg=LAT, lon_deg=LON, alt_m=ALT)
    assert (document.kind, document.firmware) == (VehicleKind.MULTICOPTER, "px4")
    assert (document.cruise_speed_m_s, document.hover_speed_m_s) == (15.0, 5.0)
    first = document.items[1]
    assert (first.frame, first.x, first.y, first.z) == (6, LAT + 5e-4, LON, 15.0)
    assert math.isnan(first.param4)  # null: not set
    assert document.items[6].param1 == 2.0  # doJumpId 3 is the third item, whatever the survey expands to
    assert document.lands


def test_fence_and_rally_points_are_items_of_their_own(tmp_path: Path) -> None:
    document = read_mission_file(write(tmp_path))
    assert [(item.command, item.param1) for item in document.fence] == [(5002, 3.0)] * 3 + [(5003, 300.0)]
    assert [(item.command, item.x, item.z) for item in document.rally] == [(5100, LAT + 2e-4, 20.0)]


def test_a_landing_pattern_is_expanded(tmp_path: Path) -> None:
    plan = changed("mission", "items", to=[simple(1, 22, [12, 0, 0, None, LAT, LON, 50]), LANDING])
    items = read_mission_file(write(tmp_path, plan)).items
    assert [item.command for item in items] == [22, 189, 31, 2001, 21]
    circle, landing = items[2], items[4]
    assert (circle.param1, circle.param2, circle.z) == (1.0, -80.0, 40.0)  # counterclockwise
    assert (landing.x, landing.y, landing.z) == (LAT, LON, 0.0)


def test_mavsdk_reads_the_same_items(tmp_path: Path) -> None:
    """MAVSDK's importer is the other authority; it wants a system, so it is asked where its library is."""
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    from tests.missions.plan_files.mavsdk_import import imported_items

    path = write(tmp_path)
    theirs = imported_items(path.read_text())
    ours = read_mission_file(path).items
    assert [i.command for i in theirs] == [i.command for i in ours]
    for their, our in zip(theirs, ours, strict=True):
        if our.command == 16:
            assert (their.x, their.y) == (round(our.x * 1e7), round(our.y * 1e7))
            assert their.z == pytest.approx(our.z)


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (changed("fileType", to="Parameters"), "fileType is 'Parameters'; accepted: 'Plan'"),
        (changed("version", to=2), "version 2 of the format; accepted: 1"),
        (changed("mission", "version", to=1), "version 1 of its mission; accepted: 2"),
        (changed("mission", "vehicleType", to=20), "vehicleType 20 (MAV_TYPE_VTOL_QUADROTOR"),
        (changed("mission", "items", to=[]), "has no items"),
        (changed("mission", "items", to=7), "mission.items: 7 is not a JSON array"),
        (changed("mission", "items", 1, "params", to=[1, 2]), "item 2 of the plan: params is not an"),
        (changed("mission", "items", 1, "params", 4, to="x"), "params[5] = 'x' is neither a number nor null"),
        (changed("mission", "items", 1, "params", 4, to=91.0), "item 2 (NAV_WAYPOINT): position 91.0"),
        (changed("mission", "items", 1, "params", 4, to=None), "item 2 (NAV_WAYPOINT): has no position"),
        (changed("mission", "items", 1, "params", 6, to=None), "item 2 (NAV_WAYPOINT): has no altitude"),
        (changed("mission", "items", 1, "params", 6, to=1e9), "item 2 (NAV_WAYPOINT): altitude 1e+09 m"),
        (changed("mission", "items", 1, "params", 0, to=math.inf), "(NAV_WAYPOINT): param1 is infinite"),
        (changed("mission", "items", 1, "frame", to=1), "(NAV_WAYPOINT): frame 1; accepted"),
        (changed("mission", "items", 1, "frame", to=-1), "frame = -1 is not in 0.."),
        (changed("mission", "items", 1, "command", to=64999), "item 2 (command 64999): 64999 is no MAV_CMD"),
        (changed("mission", "items", 1, "command", to=1.5), "command = 1.5 is not a whole number"),
        (changed("mission", "items", 1, "command", to=84), "item 2 (NAV_VTOL_TAKEOFF): for a VTOL vehicle"),
        (changed("mission", "items", 4, "params", 0, to=99), "there is no item with doJumpId 99"),
        (changed("mission", "items", 4, "params", 1, to=-7), "item 7 (DO_JUMP): repeats -7 times"),
        (
            changed("mission", "items", 3, to={"type": "ComplexItem", "complexItemType": "StructureScan"}),
            "item 4 of the plan: a complex item 'StructureScan' is not stored expanded",
        ),
        (changed("mission", "items", 3, "complexItemType", to="vtolLandingPattern"), "VTOL"),
        (changed("mission", "plannedHomePosition", to=[91, 0, 0]), "91.0, 0.0, 0.0 is no place"),
        (changed("mission", "plannedHomePosition", to=[47.0, None, None]), "[47.0, None] is not an"),
        (
            changed("mission", "items", 1, to={**UNKNOWN_TERRAIN, "AltitudeMode": 3}),
            "item 2 of the plan: altitude 12 m above a terrain that the ground station did not know",
        ),
        (changed("rallyPoints", "points", 0, to=[LAT, LON, None]), "is not an array of 3 numbers"),
        (changed("geoFence", "circles", 0, "circle", "radius", to=-1), "circle 4: radius -1 m"),
        (changed("geoFence", "polygons", 0, "polygon", to=[[1, 2]]), "a polygon of 1 points; accepted: 3"),
        (changed("rallyPoints", "points", 0, to=[1, 2]), "rallyPoints, point 1: [1, 2] is not an array of 3"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(plan: dict, words: str, tmp_path: Path) -> None:
    with pytest.raises(PlanError) as refused:
        read_mission_file(write(tmp_path, plan))
    assert words in str(refused.value)
    assert str(tmp_path) in str(refused.value)


@pytest.mark.parametrize(
    ("planned", "home"),
    [
        ([LAT, LON, None], PlannedHome(lat_deg=LAT, lon_deg=LON, alt_m=None)),
        ([None, None, None], None),
        ([0, 0, 0], None),
        (None, None),
    ],
)
def test_a_home_may_be_unknown_or_have_no_altitude(planned, home, tmp_path: Path) -> None:
    path = write(tmp_path, changed("mission", "plannedHomePosition", to=planned))
    assert read_mission_file(path).home == home
    place = FileMission(path).world_defaults.home
    if home is None:
        assert place is None
    else:
        assert place is not None
        stands = Home.parse(place)
        assert (stands.alt_m, stands.lat_deg) == (Home().alt_m, pytest.approx(LAT))
        assert place.startswith(f"{LAT:.9f},{LON:.9f},,")


def test_an_altitude_that_is_null_in_the_params_is_the_one_the_user_has_set(tmp_path: Path) -> None:
    path = write(tmp_path, changed("mission", "items", 1, to=UNKNOWN_TERRAIN))
    assert read_mission_file(path).items[1].z == 12.0


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"fileType": "Plan"}', "\x00", "[" * 100_000])
def test_what_is_no_plan_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "b.plan"
    path.write_text(text)
    with pytest.raises(PlanError):
        read_mission_file(path)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    document = read_mission_file(write(tmp_path))
    path = tmp_path / "again.plan"
    assert document.home is not None
    write_mission_file(
        path,
        document.items,
        document.home.place,
        firmware="ardupilot",
        kind=VehicleKind.FIXED_WING,
        speed_m_s=17.0,
    )
    again = read_mission_file(path)
    assert str(again.items) == str(document.items)  # NaN is not equal to itself
    assert (again.home, again.firmware, again.kind) == (document.home, "ardupilot", VehicleKind.FIXED_WING)
    assert again.cruise_speed_m_s == 17.0
    assert json.loads(path.read_text())["mission"]["vehicleType"] == 1


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = write(tmp_path)
    before = path.read_bytes()
    item = MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=LAT, y=LON, z=10.0)
    home = GeodeticPosition(lat_deg=LAT, lon_deg=LON, alt_m=ALT)
    with pytest.raises(PlanError, match="nothing is overwritten"):
        write_mission_file(path, (item,), home, firmware="px4", kind=VehicleKind.MULTICOPTER, speed_m_s=5.0)
    assert path.read_bytes() == before
    with pytest.raises(PlanError, match=r"suffix '.kml'; accepted: .plan"):
        write_mission_file(
            tmp_path / "a.kml", (item,), home, firmware="px4", kind=VehicleKind.MULTICOPTER, speed_m_s=5.0
        )


def test_the_plan_used_here_is_sound() -> None:
    assert PLAN["mission"]["items"][1] == waypoint(2, 5e-4, 0.0, 15)
