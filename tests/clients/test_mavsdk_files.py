"""MAVSDK's plugins for plans, files, metadata and events: both interfaces, every vehicle."""

from pathlib import Path
from typing import Any, Final

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from tests.clients.compatibility import not_offered
from tests.clients.mavsdk_flying import accepted, rejected
from tests.clients.mavsdk_session import Session
from tests.clients.plugin_sitl import PluginSitl

AUTOPILOT: Final = 1
compatibility = pytest.mark.compatibility


@compatibility(feature="geofence")
def test_geofence(mavsdk: Session) -> None:
    from mavsdk.plugins.geofence import Circle, FenceType, GeofenceData, Point, Polygon

    here = mavsdk.first("telemetry", "position")
    corners = [
        Point(here.latitude_deg + north * 3e-3, here.longitude_deg + east * 3e-3)
        for north, east in ((-1, -1), (-1, 1), (1, 1), (1, -1))
    ]
    hole = Circle(Point(here.latitude_deg + 1e-3, here.longitude_deg), 20.0, FenceType.EXCLUSION)
    mavsdk.transfer(
        "geofence", "upload_geofence", GeofenceData([Polygon(corners, FenceType.INCLUSION)], [hole])
    )
    fence = mavsdk.transfer("geofence", "download_geofence")
    assert [len(polygon.points) for polygon in fence.polygons] == [4]
    assert [circle.radius for circle in fence.circles] == [20.0]
    mavsdk.call("geofence", "clear_geofence")


PLAN: Final = """{{"fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
"geoFence": {{"circles": [], "polygons": [], "version": 2}}, "rallyPoints": {{"points": [], "version": 2}},
"mission": {{"cruiseSpeed": 15, "firmwareType": 12, "globalPlanAltitudeMode": 1, "hoverSpeed": 5,
"plannedHomePosition": [{lat}, {lon}, 488], "vehicleType": 2, "version": 2, "items": [{items}]}}}}"""
PLAN_ITEM: Final = """{{"type": "SimpleItem", "autoContinue": true, "doJumpId": {jump}, "frame": 3,
"command": {command}, "params": [0, 0, 0, null, {lat}, {lon}, 10]}}"""


@compatibility(feature="mission_raw: .plan import, upload, download")
def test_plan_import(mavsdk: Session, sitl: PluginSitl) -> None:
    here = mavsdk.first("telemetry", "position")
    lat, lon = here.latitude_deg, here.longitude_deg
    items = ",".join(
        PLAN_ITEM.format(jump=index + 1, command=command, lat=lat + 2e-4 * index, lon=lon)
        for index, command in enumerate((22, 16, 16))
    )
    imported = mavsdk.call(
        "mission_raw", "import_qgroundcontrol_mission_from_string", PLAN.format(lat=lat, lon=lon, items=items)
    )
    assert [item.command for item in imported.mission_items][-3:] == [22, 16, 16]
    mavsdk.transfer("mission_raw", "upload_mission", imported.mission_items)
    back = mavsdk.transfer("mission_raw", "download_mission")
    assert [(item.command, item.x) for item in back][-2:] == [
        (item.command, item.x) for item in imported.mission_items
    ][-2:]
    mavsdk.call("mission_raw", "clear_mission")


@compatibility(feature="ftp")
def test_ftp(mavsdk: Session, sitl: PluginSitl, client: str, tmp_path: Path) -> None:
    folder = f"{'/fs/microsd' if sitl.flavour == 'px4' else '/APM'}/{client.split()[-1]}"
    file = tmp_path / "notes.txt"
    file.write_bytes(bytes(range(256)) * 20)
    mavsdk.call("ftp", "create_directory", folder)
    mavsdk.collect("ftp", "upload", str(file), folder)
    listed = mavsdk.call("ftp", "list_directory", folder)
    assert "notes.txt" in {entry.name for entry in listed.entries}
    assert mavsdk.call("ftp", "are_files_identical", str(file), f"{folder}/notes.txt")
    for burst in (False, True):
        back = tmp_path / f"back{burst}"
        back.mkdir()
        mavsdk.collect("ftp", "download", f"{folder}/notes.txt", str(back), burst)
        assert (back / "notes.txt").read_bytes() == file.read_bytes()
    mavsdk.call("ftp", "rename", f"{folder}/notes.txt", f"{folder}/more.txt")
    mavsdk.call("ftp", "remove_file", f"{folder}/more.txt")
    mavsdk.call("ftp", "remove_directory", folder)


@compatibility(feature="component_metadata")
def test_component_metadata(mavsdk: Session, sitl: PluginSitl, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.component_metadata import MetadataType

    mavsdk.call("component_metadata", "request_autopilot_component")
    wanted = AUTOPILOT, MetadataType.PARAMETER
    if sitl.flavour == "ardupilot":
        mavsdk.wait(1.0)
        assert "NOT_AVAILABLE" in rejected(mavsdk, "component_metadata", "get_metadata", *wanted)
        not_offered(request, "no component metadata in 4.6")
        return
    mavsdk.until("metadata", lambda: accepted(mavsdk, "component_metadata", "get_metadata", *wanted))
    found = mavsdk.call("component_metadata", "get_metadata", *wanted)
    assert "COM_DISARM_LAND" in found.json_metadata
    wanted = AUTOPILOT, MetadataType.ACTUATORS
    mavsdk.until("actuators", lambda: accepted(mavsdk, "component_metadata", "get_metadata", *wanted))
    assert "PWM_MAIN_FUNC" in mavsdk.call("component_metadata", "get_metadata", *wanted).json_metadata


def armable(report: Any) -> bool:
    return bool(report.current_mode_intention.can_arm_or_run)


@compatibility(feature="events")
def test_events(mavsdk: Session, sitl: PluginSitl, request: pytest.FixtureRequest) -> None:
    if sitl.flavour == "ardupilot":
        assert "NOT_AVAILABLE" in rejected(mavsdk, "events", "get_health_and_arming_checks_report")
        not_offered(request, "no events in 4.6")
        return
    # The first report that MAVSDK has may be the boot's. The next one comes up to 2 s (vehicle's time) after
    # the vehicle can be armed, and later when events were lost and MAVSDK has to ask for them again.
    mavsdk.first("events", "health_and_arming_checks", armable)
    # Asked while its own thread reads the next report, MAVSDK gives an empty one.
    report = mavsdk.answer("events", "get_health_and_arming_checks_report", armable)
    assert not report.current_mode_intention.problems
    assert {"gps", "accel"} <= {str(each.name) for each in report.health_components}
