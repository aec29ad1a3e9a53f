"""What is found of a vehicle by its messages and parameters."""

import copy
import math
from typing import Any

import pytest

from autopilot_bridge.fence_shapes import fence_shapes
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.kind import VehicleKind
from missions.preflight.before_flight import first_outside
from missions.preflight.finding import Finding, Level
from missions.preflight.health import health_findings, sensors
from missions.preflight.lost_link import lost_link, lost_link_words
from missions.preflight.settings import areas_watched, fence, settings_findings, shapes_join
from missions.preflight.snapshot import Snapshot
from missions.vehicle.arming_reasons import not_ready_because, reasons_against_arming

HEALTH, PRESENT = "onboard_control_sensors_health", "onboard_control_sensors_present"
COPTER, PLANE = VehicleKind.MULTICOPTER, VehicleKind.FIXED_WING
HOME = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.4)
READY: dict[str, dict[str, Any]] = {
    "HEARTBEAT": {"base_mode": 0x1D, "type": 2, "autopilot": 12},
    "SYS_STATUS": {
        "onboard_control_sensors_present": 0x0300402F | 0x10000,
        "onboard_control_sensors_enabled": 0x0301402F,
        "onboard_control_sensors_health": 0x1320C83F | 0x10000,
        "voltage_battery": 16200,
        "battery_remaining": 95,
    },
    "GPS_RAW_INT": {"fix_type": 3, "satellites_visible": 10, "eph": 70},
    "ESTIMATOR_STATUS": {"flags": 831, "vel_ratio": 0.1, "pos_horiz_ratio": 0.1, "mag_ratio": 0.1},
    "HOME_POSITION": {"latitude": 473977400, "longitude": 85455900, "altitude": 489400},
    "GLOBAL_POSITION_INT": {"lat": 473977410, "lon": 85455910, "alt": 489400},
}  # fmt: skip


def found(changes: dict[str, dict[str, Any] | None], texts: tuple[str, ...] = ()) -> dict[str, Finding]:
    """Findings by subject, of a ready vehicle with some fields changed (None: message not received)."""
    messages = copy.deepcopy(READY)
    for name, fields in changes.items():
        if fields is None:
            messages.pop(name)
        else:
            messages.setdefault(name, {}).update(fields)
    snapshot = Snapshot(flavour="px4", kind=COPTER, messages=messages, texts=texts)
    return {finding.subject: finding for finding in health_findings(snapshot)}


def test_a_ready_vehicle_is_ok() -> None:
    assert {finding.level for finding in found({}).values()} == {Level.OK}


@pytest.mark.parametrize(
    ("parameters", "level"),
    [
        ({}, Level.OK),
        ({"TERRAIN_FOLLOW": 0.0}, Level.OK),
        ({"TERRAIN_FOLLOW": 1.0}, Level.WARNING),
        ({"RTL_ALT_TYPE": 1.0}, Level.WARNING),
    ],
)
def test_missing_terrain_data_matter_where_they_are_flown_by(
    parameters: dict[str, float], level: Level
) -> None:
    messages = copy.deepcopy(READY)
    bits = messages["SYS_STATUS"]
    bits["onboard_control_sensors_present"] |= dialect.MAV_SYS_STATUS_TERRAIN
    bits["onboard_control_sensors_enabled"] |= dialect.MAV_SYS_STATUS_TERRAIN
    snapshot = Snapshot(flavour="ardupilot", kind=PLANE, messages=messages, parameters=parameters)
    (finding,) = sensors(snapshot)
    assert finding.level is level
    assert ("terrain" in finding.text) == (level is Level.WARNING)


@pytest.mark.parametrize(
    ("texts", "unhealthy", "words"),
    [
        (("PreArm: a", "hello", "PreArm: b", "PreArm: a"), 0, "PreArm: a / PreArm: b"),
        (("Preflight Fail: a",), dialect.MAV_SYS_STATUS_SENSOR_GPS, "Preflight Fail: a"),
        ((), dialect.MAV_SYS_STATUS_SENSOR_GPS | dialect.MAV_SYS_STATUS_PREARM_CHECK, "not healthy: gps"),
        ((), dialect.MAV_SYS_STATUS_PREARM_CHECK, ""),
    ],
)
def test_why_it_is_not_ready(texts: tuple[str, ...], unhealthy: int, words: str) -> None:
    assert not_ready_because(texts, unhealthy) == words


@pytest.mark.parametrize(
    ("changes", "subject", "level", "words"),
    [
        ({"SYS_STATUS": None}, "sensors", Level.PROBLEM, "not reported"),
        ({"SYS_STATUS": {HEALTH: 0x1320C83B}}, "sensors", Level.PROBLEM, "3d mag"),
        ({"SYS_STATUS": {HEALTH: 0x0320C83F}}, "arming", Level.PROBLEM, "not passed"),
        ({"HEARTBEAT": {"base_mode": 0x9D}}, "arming", Level.WARNING, "is armed"),
        ({"GPS_RAW_INT": {"fix_type": 2}}, "GPS", Level.PROBLEM, "2D_FIX, 10 satellites"),
        ({"GPS_RAW_INT": {"satellites_visible": 5}}, "GPS", Level.WARNING, "5 satellites"),
        ({"GPS_RAW_INT": {"eph": 300}}, "GPS", Level.WARNING, "HDOP 3.0"),
        ({"GPS_RAW_INT": None}, "GPS", Level.WARNING, "no receiver was reported"),
        ({"ESTIMATOR_STATUS": {"flags": 1}}, "navigation", Level.PROBLEM, "no position"),
        ({"ESTIMATOR_STATUS": {"mag_ratio": 1.5}}, "navigation", Level.PROBLEM, "1.50 (mag)"),
        ({"ESTIMATOR_STATUS": {"vel_ratio": 0.6}}, "navigation", Level.WARNING, "0.60 (vel)"),
        ({"EKF_STATUS_REPORT": {"flags": 831 | 0x80}}, "navigation", Level.PROBLEM, "no position"),
        ({"EKF_STATUS_REPORT": {"flags": 831, "compass_variance": 0.9}}, "navigation", Level.PROBLEM, "0.90"),
        ({"HOME_POSITION": None}, "home", Level.PROBLEM, "not set"),
        ({"GLOBAL_POSITION_INT": {"lat": 473987410}}, "home", Level.WARNING, "m from the vehicle"),
        ({"SYS_STATUS": {"battery_remaining": 10}}, "battery", Level.PROBLEM, "16.2 V, 10 %"),
        ({"SYS_STATUS": {"battery_remaining": 40}}, "battery", Level.WARNING, "40 %"),
        ({"SYS_STATUS": {"battery_remaining": -1}}, "battery", Level.WARNING, "charge not known"),
        ({"SYS_STATUS": {"battery_remaining": -1, "voltage_battery": 0}}, "battery", Level.WARNING, "not"),
        ({"SYS_STATUS": {PRESENT: 0x0300402F}}, "remote control", Level.WARNING, "no"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_found(changes: dict, subject: str, level: Level, words: str) -> None:
    finding = found(changes)[subject]
    assert finding.level is level
    assert words in finding.text
    assert finding.advice


def test_the_reasons_are_the_autopilots_own() -> None:
    texts = (
        "Frame: QUAD",
        "PreArm: Compass not calibrated",
        "PreArm: Compass not calibrated",
        "Arm: Hardware",
    )
    assert reasons_against_arming(texts) == ["PreArm: Compass not calibrated", "Arm: Hardware"]
    sick = {"SYS_STATUS": {HEALTH: 0x0320C83F}}
    assert "PreArm: Compass not calibrated / Arm: Hardware" in found(sick, texts)["arming"].text


def snapshot(
    flavour: str, parameters: dict[str, float], kind: VehicleKind = COPTER, items: int = 0
) -> Snapshot:
    return Snapshot(flavour=flavour, kind=kind, messages={}, parameters=parameters, fence_items=items)


@pytest.mark.parametrize(
    ("flavour", "parameters", "level", "words"),
    [
        ("px4", {"SYS_AUTOSTART": 0.0}, Level.PROBLEM, "SYS_AUTOSTART is 0: no airframe"),
        ("px4", {"COM_LOW_BAT_ACT": 0.0}, Level.WARNING, "COM_LOW_BAT_ACT is 0"),
        ("px4", {"MPC_XY_P": math.nan}, Level.PROBLEM, "MPC_XY_P is nan"),
        ("px4", {"SYS_AUTOSTART": 4001.0}, Level.OK, "nothing unusual"),
        ("ardupilot", {"ARMING_CHECK": 0.0}, Level.WARNING, "all pre-arm checks are off"),
        ("ardupilot", {"ARMING_CHECK": 14.0}, Level.WARNING, "some pre-arm checks are off"),
        ("ardupilot", {"THR_FAILSAFE": 0.0}, Level.OK, "nothing unusual"),  # of a plane only
    ],
)
def test_settings(flavour: str, parameters: dict, level: Level, words: str) -> None:
    (finding,) = settings_findings(snapshot(flavour, parameters))
    assert finding.level is level
    assert words in finding.text


@pytest.mark.parametrize(
    ("flavour", "parameters", "items", "level", "words"),
    [
        ("px4", {}, 0, Level.WARNING, "there is none"),
        ("px4", {"GF_MAX_HOR_DIST": 300.0}, 4, Level.OK, "4 points of areas, within 300 m of home"),
        (
            "ardupilot",
            {"FENCE_ENABLE": 0.0},
            4,
            Level.WARNING,
            "none is enabled (4 points of one are stored)",
        ),
        (
            "ardupilot",
            {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ALT_MAX": 100.0, "FENCE_RADIUS": 300.0},
            4,
            Level.OK,
            "up to 100 m, within 300 m of home, 4 points of areas",
        ),
    ],
)
def test_fence(flavour: str, parameters: dict, items: int, level: Level, words: str) -> None:
    finding = fence(snapshot(flavour, parameters, items=items))
    assert finding.level is level
    assert words in finding.text


ALTITUDE_AND_AREAS = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 5.0, "FENCE_ALT_MAX": 100.0}


@pytest.mark.parametrize(
    ("flavour", "parameters", "level", "words"),
    [
        ("px4", {}, Level.OK, "4 points of areas that the mission brings"),
        ("ardupilot", ALTITUDE_AND_AREAS, Level.OK, "up to 100 m, 4 points of areas that the mission brings"),
        ("ardupilot", ALTITUDE_AND_AREAS | {"FENCE_TYPE": 3.0}, Level.WARNING, "not watched (FENCE_TYPE 3)"),
        ("ardupilot", {"FENCE_ENABLE": 0.0}, Level.WARNING, "(4 points of one are in the mission)"),
        ("ardupilot", {"FENCE_ENABLE": 1.0, "FENCE_TYPE": math.nan}, Level.WARNING, "(FENCE_TYPE 0)"),
    ],
)
def test_a_fence_that_the_mission_brings(flavour: str, parameters: dict, level: Level, words: str) -> None:
    """It is what will be watched, whatever the vehicle has stored, if areas are watched at all."""
    finding = fence(snapshot(flavour, parameters, items=9), planned=4)
    assert finding.level is level
    assert words in finding.text


@pytest.mark.parametrize(
    ("flavour", "parameters", "watched"),
    [
        ("px4", {}, True),
        ("ardupilot", ALTITUDE_AND_AREAS, True),
        ("ardupilot", ALTITUDE_AND_AREAS | {"FENCE_ENABLE": 0.0}, False),
        ("ardupilot", ALTITUDE_AND_AREAS | {"FENCE_TYPE": 3.0}, False),
        ("ardupilot", {}, False),
    ],
)
def test_a_fence_that_is_switched_off_is_not_in_the_way(
    flavour: str, parameters: dict, watched: bool
) -> None:
    assert areas_watched(flavour, parameters) == watched


@pytest.mark.parametrize(
    ("flavour", "kind", "parameters", "words"),
    [
        ("px4", COPTER, {"NAV_DLL_ACT": 0}, "goes on (NAV_DLL_ACT 0)"),
        ("px4", PLANE, {"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 10}, "returns after 10 s (NAV_DLL_ACT 2)"),
        ("px4", COPTER, {"COM_OBL_RC_ACT": 4, "COM_OF_LOSS_T": 1}, "without setpoints it lands after 1 s"),
        ("ardupilot", COPTER, {"FS_GCS_ENABLE": 1, "FS_GCS_TIMEOUT": 5}, "returns after 5 s"),
        ("ardupilot", COPTER, {"FS_GCS_ENABLE": 1, "FS_OPTIONS": 2}, "in a mission it goes on"),
        ("ardupilot", COPTER, {"GUID_TIMEOUT": 3}, "stops and stays after 3 s (GUID_TIMEOUT)"),
        ("ardupilot", PLANE, {"FS_GCS_ENABL": 0}, "goes on (FS_GCS_ENABL 0)"),
        (
            "ardupilot",
            PLANE,
            {"FS_GCS_ENABL": 1, "FS_LONG_ACTN": 1, "FS_LONG_TIMEOUT": 5},
            "returns after 5 s",
        ),
        ("px4", COPTER, {"NAV_DLL_ACT": 77}, "does action 77"),
    ],
)
def test_what_happens_without_a_link(flavour: str, kind: VehicleKind, parameters: dict, words: str) -> None:
    assert words in "; ".join(lost_link_words(flavour, kind, parameters))


@pytest.mark.parametrize(
    ("flavour", "kind", "parameters", "received", "level"),
    [
        ("px4", COPTER, {"NAV_DLL_ACT": 2.0, "COM_OBL_RC_ACT": 0.0}, False, Level.WARNING),
        ("px4", PLANE, {"NAV_DLL_ACT": 2.0, "COM_OBL_RC_ACT": 1.0}, False, Level.WARNING),
        ("px4", COPTER, {"NAV_DLL_ACT": 2.0, "COM_OBL_RC_ACT": 2.0}, False, Level.WARNING),
        ("px4", COPTER, {"NAV_DLL_ACT": 2.0, "COM_OBL_RC_ACT": 0.0}, True, Level.OK),
        ("px4", COPTER, {"NAV_DLL_ACT": 2.0, "COM_OBL_RC_ACT": 3.0}, False, Level.OK),
        ("px4", COPTER, {"NAV_DLL_ACT": 0.0, "COM_OBL_RC_ACT": 3.0}, True, Level.WARNING),
        ("ardupilot", COPTER, {"FS_GCS_ENABLE": 1.0, "GUID_TIMEOUT": 3.0}, False, Level.OK),
        ("ardupilot", PLANE, {"FS_GCS_ENABL": 0.0}, True, Level.WARNING),
        ("ardupilot", PLANE, {}, True, Level.WARNING),
    ],
)
def test_a_reaction_that_relies_on_sticks_is_not_ok_without_them(
    flavour: str, kind: VehicleKind, parameters: dict[str, float], received: bool, level: Level
) -> None:
    words = lost_link_words(flavour, kind, parameters)
    finding = lost_link(words, flavour, parameters, received=received)
    assert finding.level is level
    assert ("no remote control is received" in finding.text) == (
        not received and parameters.get("COM_OBL_RC_ACT", 3.0) < 3.0
    )


def test_a_receiver_that_has_lost_its_transmitter_is_no_remote_control() -> None:
    lost = {PRESENT: 0x0301402F, HEALTH: 0x1320C83F}
    assert (
        found({"SYS_STATUS": lost, "RC_CHANNELS": {"chancount": 8, "rssi": 200}})["remote control"].level
        is Level.WARNING
    )


def items(command: int, param1: float, *places: tuple[float, float]) -> list[MissionItem]:
    frame = LocalFrame(HOME)
    geodetic = [frame.geodetic_from_ned(n, e, 0.0) for n, e in places]
    return [MissionItem(command=command, frame=0, param1=param1, x=lat, y=lon) for lat, lon, _ in geodetic]


SQUARE = ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))


@pytest.mark.parametrize(
    ("fences", "way", "outside"),
    [
        (items(5001, 4, *SQUARE), [(0.0, 0.0), (90.0, 90.0)], None),
        (items(5001, 4, *SQUARE), [(0.0, 0.0), (120.0, 0.0)], (100.0, 0.0)),
        (items(5002, 4, *SQUARE), [(200.0, -200.0), (200.0, 200.0)], None),
        (items(5002, 4, *SQUARE), [(200.0, 0.0), (-200.0, 0.0)], (100.0, 0.0)),  # through it, not to it
        (items(5003, 50.0, (0.0, 0.0)), [(0.0, 0.0), (0.0, 60.0)], (0.0, 50.0)),
        (items(5004, 50.0, (0.0, 0.0)), [(60.0, 0.0), (60.0, 60.0)], None),
        ([], [(1e6, 0.0)], None),
    ],
)
def test_ways_and_fences(fences: list, way: list, outside: tuple[float, float] | None) -> None:
    place = first_outside(fence_shapes(fences, LocalFrame(HOME)), way, join=False)
    if outside is None:
        assert place is None
    else:
        assert place is not None
        assert math.dist(place, outside) < 6.0  # found in steps of 5 m


@pytest.mark.parametrize(
    ("flavour", "parameters", "inside"),
    [
        ("px4", {}, True),
        ("ardupilot", {}, False),
        ("ardupilot", {"FENCE_OPTIONS": 1.0}, False),
        ("ardupilot", {"FENCE_OPTIONS": 2.0}, True),
    ],
)
def test_two_areas_to_stay_in(flavour: str, parameters: dict[str, float], inside: bool) -> None:
    """PX4 asks for one of them, ArduPilot for all unless a parameter says otherwise."""
    plan = [*items(5001, 4, *SQUARE), *items(5003, 50.0, (130.0, 0.0))]
    shapes = fence_shapes(plan, LocalFrame(HOME))
    place = first_outside(shapes, [(0.0, 0.0), (160.0, 0.0)], join=shapes_join(flavour, parameters))
    assert (place is None) is inside
