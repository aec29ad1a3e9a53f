"""Every plugin of MAVSDK that speaks to an autopilot, by both of its interfaces, on both flavours.

One SITL for each flavour serves all checks of both interfaces, on links of their own.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest
from pymavlink.dialects.v20 import all as mavlink

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from tests.clients.compatibility import not_offered
from tests.clients.mavsdk_session import ASYNCIO, SESSIONS, Session
from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import free_port, running_sitl

SPEEDUP: Final = 10.0
GCS_SYSTEM: Final = 255  # ArduPilot takes sticks from this one alone
HEIGHT_M: Final = 8.0
DEG_PER_M: Final = 1.0 / 111_195.0

compatibility = pytest.mark.compatibility


@dataclass
class Sitl:
    """A SITL and its links: one for each interface, and one for a mavutil script."""

    flavour: str
    ports: dict[str, int]
    script_port: int
    _script: Client | None = None

    @property
    def script(self) -> Client:
        """A mavutil script on a link of its own."""
        if self._script is None:
            self._script = Client(self.flavour, f"udpin:127.0.0.1:{self.script_port}", speedup=SPEEDUP)
        return self._script


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def vehicle(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def sitl(vehicle: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sitl]:
    made = Sitl(vehicle, {client: free_port() for client in SESSIONS}, free_port())
    links = [f"udpout:127.0.0.1:{port}" for port in (*made.ports.values(), made.script_port)]
    options = []
    if vehicle == "ardupilot":  # its gripper and its receiver of traffic are off by default
        file = tmp_path_factory.mktemp("parameters") / "devices.parm"
        rates = "".join(f"SR{number}_RAW_SENS 2\n" for number in range(3))  # MAVSDK can't ask for pressures
        file.write_text(f"GRIP_ENABLE 1\nADSB_TYPE 2\n{rates}")
        options = ["--params", str(file)]
    with running_sitl(vehicle, links, speedup=SPEEDUP, options=options):
        yield made


@pytest.fixture(
    scope="module",
    params=[ASYNCIO, *(pytest.param(name, marks=pytest.mark.slow) for name in SESSIONS if name != ASYNCIO)],
)
def client(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def mavsdk(sitl: Sitl, client: str) -> Iterator[Session]:
    session = SESSIONS[client](f"udpin://127.0.0.1:{sitl.ports[client]}", system_id=GCS_SYSTEM)
    if sitl.flavour == "ardupilot":
        for stream in ("position", "position_velocity_ned", "attitude_euler", "in_air", "health"):
            session.call("telemetry", f"set_rate_{stream}", 10.0)
        # after a landing it stays in RTL or LAND, and MAVSDK has no word for GUIDED but a take-off
        session.before_arming = lambda: sitl.script.set_mode("GUIDED")
    session.first("telemetry", "health", lambda health: health.is_armable and health.is_global_position_ok)
    yield session
    session.close()


# helpers


def rejected(session: Session, plugin: str, method: str, *arguments: Any) -> str:
    """The name of the result that a call is refused with."""
    from mavsdk.exceptions import MavsdkError

    with pytest.raises(MavsdkError) as caught:
        session.call(plugin, method, *arguments)
    return str(caught.value).split(";")[0].split(":")[0].strip()


def accepted(session: Session, plugin: str, method: str, *arguments: Any) -> bool:
    """A call went through; False when it can't be done (now)."""
    from mavsdk.exceptions import MavsdkError

    try:
        session.call(plugin, method, *arguments)
    except MavsdkError:
        return False
    return True


def land(session: Session) -> None:
    """On the ground and disarmed."""
    if session.first("telemetry", "armed"):
        session.until("landing", lambda: accepted(session, "action", "land"))
        session.first("telemetry", "armed", lambda armed: not armed)


def fly(session: Session) -> Any:
    """In the air, holding; the position there."""
    if not session.first("telemetry", "in_air"):
        land(session)
        session.call("action", "set_takeoff_altitude", HEIGHT_M)
        session.before_arming()
        session.until("arming", lambda: accepted(session, "action", "arm"))
        session.call("action", "takeoff")
        session.first("telemetry", "position", lambda p: p.relative_altitude_m > HEIGHT_M - 1.0)
        session.first("telemetry", "landed_state", lambda state: state.name == "IN_AIR")
    session.until("hold", lambda: accepted(session, "action", "hold"))
    return session.first("telemetry", "position")


def moved(session: Session, found: Callable[[Any], bool], each: Callable[[], None] | None = None) -> None:
    """Wait for a local position and velocity."""
    session.first("telemetry", "position_velocity_ned", found, each)


# on the ground


@compatibility(feature="info")
def test_info(mavsdk: Session, vehicle: str) -> None:
    version = mavsdk.call("info", "get_version")
    expected = (1, 16, 1) if vehicle == "px4" else (4, 6, 3)
    assert (version.flight_sw_major, version.flight_sw_minor, version.flight_sw_patch) == expected
    identity = mavsdk.call("info", "get_identification")
    assert identity.legacy_uid or identity.hardware_uid.strip("0")
    mavsdk.call("info", "get_product")


@compatibility(feature="param")
def test_parameters(mavsdk: Session, vehicle: str) -> None:
    number, real = ("COM_OBL_RC_ACT", "MPC_XY_VEL_MAX") if vehicle == "px4" else ("FS_OPTIONS", "WPNAV_SPEED")
    before = mavsdk.call("param", "get_param_float", real)
    mavsdk.call("param", "set_param_float", real, before - 1.0)
    assert mavsdk.call("param", "get_param_float", real) == pytest.approx(before - 1.0)
    mavsdk.call("param", "set_param_float", real, before)
    count = mavsdk.call("param", "get_param_int", number)
    mavsdk.call("param", "set_param_int", number, count + 1)
    assert mavsdk.call("param", "get_param_int", number) == count + 1
    mavsdk.call("param", "set_param_int", number, count)
    everything = mavsdk.call("param", "get_all_params")
    names = {parameter.name for parameter in (*everything.int_params, *everything.float_params)}
    assert {number, real} <= names and len(names) > 300


NO_STREAM: Final = {
    "px4": {
        "actuator_control_target": "PX4 1.16 has no ACTUATOR_CONTROL_TARGET",
        "ground_truth": "the truth is in the log, not on the link",
        "raw_imu": "PX4 has no RAW_IMU",
        "wind": "no wind estimate on a copter",
    },
    "ardupilot": {
        "actuator_control_target": "no ACTUATOR_CONTROL_TARGET",
        "actuator_output_status": "no ACTUATOR_OUTPUT_STATUS",
        "odometry": "no ODOMETRY in 4.6",
        "ground_truth": "the truth is in the log, not on the link",
        "altitude": "no ALTITUDE in 4.6",
        "wind": "WIND, which MAVSDK does not read",
    },
}
"""Streams that the firmware does not send, and why."""
STREAMS: Final = (
    *("position", "home", "in_air", "landed_state", "armed", "vtol_state", "attitude_quaternion"),
    *("attitude_euler", "attitude_angular_velocity_body", "velocity_ned", "gps_info", "raw_gps", "battery"),
    *("flight_mode", "health", "rc_status", "actuator_control_target", "actuator_output_status", "odometry"),
    *("position_velocity_ned", "ground_truth", "fixedwing_metrics", "imu", "scaled_imu", "raw_imu"),
    *(
        "health_all_ok",
        "unix_epoch_time",
        "distance_sensor",
        "scaled_pressure",
        "heading",
        "altitude",
        "wind",
    ),
)
RATED: Final = frozenset(
    {
        *(
            "position",
            "home",
            "in_air",
            "landed_state",
            "vtol_state",
            "attitude_quaternion",
            "attitude_euler",
        ),
        *("velocity_ned", "gps_info", "raw_gps", "battery", "rc_status", "actuator_control_target"),
        *("actuator_output_status", "odometry", "position_velocity_ned", "ground_truth", "fixedwing_metrics"),
        *("imu", "scaled_imu", "raw_imu", "unix_epoch_time", "distance_sensor", "altitude", "health"),
    }
)


@pytest.mark.parametrize("stream", STREAMS)
@compatibility(feature="telemetry")
def test_telemetry(mavsdk: Session, vehicle: str, stream: str, request: pytest.FixtureRequest) -> None:
    reason = NO_STREAM[vehicle].get(stream)
    asked = stream not in RATED or accepted(mavsdk, "telemetry", f"set_rate_{stream}", 10.0)
    if reason is None:
        assert asked
        assert mavsdk.first("telemetry", stream, wait_s=8.0) is not None
        return
    if asked:
        with pytest.raises(AssertionError, match="not seen"):
            mavsdk.first("telemetry", stream, wait_s=0.3)
    not_offered(request, f"without {stream}: {reason}")


@compatibility(feature="calibration")
def test_calibration(mavsdk: Session, vehicle: str, client: str, request: pytest.FixtureRequest) -> None:
    if vehicle == "ardupilot":
        assert "UNSUPPORTED" in rejected(mavsdk, "calibration", "cancel")
        not_offered(request, "MAVSDK calibrates PX4 only")
        return
    names = ["gyro", "level_horizon", "accelerometer"] + ["magnetometer"] * (client == ASYNCIO)
    for name in names:
        told = mavsdk.collect("calibration", f"calibrate_{name}")
        assert told[-1][0].name == "SUCCESS"
        progress = [data.progress for _, data in told if data.has_progress]
        assert progress == sorted(progress) and progress[0] == 0.0 and progress[-1] == 1.0
        if name in ("accelerometer", "magnetometer"):
            texts = [data.status_text for _, data in told if data.has_status_text]
            for side in ("down", "up", "left", "right", "front", "back"):
                assert any(f"{side} orientation detected" in text for text in texts)


@compatibility(feature="gripper")
def test_gripper(mavsdk: Session) -> None:
    mavsdk.call("gripper", "grab", 1)
    mavsdk.call("gripper", "release", 1)


@compatibility(feature="winch")
def test_winch(mavsdk: Session, request: pytest.FixtureRequest) -> None:
    assert "TIMEOUT" in rejected(mavsdk, "winch", "relax", 1)
    not_offered(request, "no winch")


@compatibility(feature="tune")
def test_tune(mavsdk: Session, sitl: Sitl, request: pytest.FixtureRequest) -> None:
    """MAVSDK 4.1's Python interface gives a song to the library as a number; PLAY_TUNE itself is taken."""
    from mavsdk.plugins.tune import SongElement, TuneDescription

    with pytest.raises(TypeError):
        mavsdk.call("tune", "play_tune", TuneDescription([SongElement.STYLE_NORMAL], 120))
    sitl.script.link.mav.play_tune_send(1, 1, b"L16 CDEFG", b"")
    sitl.script.next("HEARTBEAT")
    not_offered(request, "MAVSDK 4.1 can't pass a song from Python; PLAY_TUNE is taken")


@compatibility(feature="transponder")
def test_transponder(mavsdk: Session, sitl: Sitl) -> None:
    here = mavsdk.first("telemetry", "position")
    address = 0xABC000 + len(mavsdk.__class__.__name__)

    def report() -> None:
        sitl.script.link.mav.adsb_vehicle_send(
            address,
            round(here.latitude_deg * 1e7) + 200_000,
            round(here.longitude_deg * 1e7),
            mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
            round(here.absolute_altitude_m * 1000.0) + 3_000_000,
            9000,
            6000,
            0,
            b"TEST1234",
            mavlink.ADSB_EMITTER_TYPE_LIGHT,
            1,
            mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE,
            7000,
        )

    mavsdk.call("transponder", "set_rate_transponder", 2.0)
    heard = mavsdk.first("transponder", "transponder", lambda v: v.icao_address == address, report)
    assert heard.latitude_deg == pytest.approx(here.latitude_deg + 0.02, abs=1e-6)
    assert heard.callsign == "TEST1234"


@compatibility(feature="rtk")
def test_rtk(mavsdk: Session) -> None:
    from mavsdk.plugins.rtk import RtcmData

    mavsdk.call("rtk", "send_rtcm_data", RtcmData("0wATPtcAAg=="))


@compatibility(feature="shell")
def test_shell(mavsdk: Session, request: pytest.FixtureRequest) -> None:
    mavsdk.call("shell", "send", "ver all\n", 10)
    with pytest.raises(AssertionError, match="not seen"):
        mavsdk.first("shell", "receive", wait_s=0.5)
    not_offered(request, "no system console")


@compatibility(feature="geofence")
def test_geofence(mavsdk: Session) -> None:
    from mavsdk.plugins.geofence import Circle, FenceType, GeofenceData, Point, Polygon

    here = mavsdk.first("telemetry", "position")
    corners = [
        Point(here.latitude_deg + north * 3e-3, here.longitude_deg + east * 3e-3)
        for north, east in ((-1, -1), (-1, 1), (1, 1), (1, -1))
    ]
    hole = Circle(Point(here.latitude_deg + 1e-3, here.longitude_deg), 20.0, FenceType.EXCLUSION)
    mavsdk.call("geofence", "upload_geofence", GeofenceData([Polygon(corners, FenceType.INCLUSION)], [hole]))
    fence = mavsdk.call("geofence", "download_geofence")
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
def test_plan_import(mavsdk: Session, vehicle: str) -> None:
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
    mavsdk.call("mission_raw", "upload_mission", imported.mission_items)
    back = mavsdk.call("mission_raw", "download_mission")
    assert [(item.command, item.x) for item in back][-2:] == [
        (item.command, item.x) for item in imported.mission_items
    ][-2:]
    mavsdk.call("mission_raw", "clear_mission")


@compatibility(feature="ftp")
def test_ftp(mavsdk: Session, vehicle: str, client: str, tmp_path: Path) -> None:
    folder = f"{'/fs/microsd' if vehicle == 'px4' else '/APM'}/{client.split()[-1]}"
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
def test_component_metadata(mavsdk: Session, vehicle: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.component_metadata import MetadataType

    mavsdk.call("component_metadata", "request_autopilot_component")
    if vehicle == "ardupilot":
        with pytest.raises(AssertionError, match="not seen"):
            mavsdk.first("component_metadata", "metadata_available", wait_s=2.0)
        not_offered(request, "no component metadata in 4.6")
        return
    found = mavsdk.first(
        "component_metadata", "metadata_available", lambda update: update.type == MetadataType.PARAMETER
    )
    assert "MPC_XY_VEL_MAX" in found.json_metadata


@compatibility(feature="events")
def test_events(mavsdk: Session, vehicle: str, request: pytest.FixtureRequest) -> None:
    if vehicle == "ardupilot":
        assert "NOT_AVAILABLE" in rejected(mavsdk, "events", "get_health_and_arming_checks_report")
        not_offered(request, "no events in 4.6")
        return
    pytest.skip("MAVSDK was not seen to make a report of PX4's arming checks yet")


# in the air


@compatibility(feature="action")
def test_action(mavsdk: Session, vehicle: str) -> None:
    here = fly(mavsdk)
    assert mavsdk.call("action", "get_takeoff_altitude") == pytest.approx(HEIGHT_M)
    mavsdk.call("action", "set_return_to_launch_altitude", 20.0)
    assert mavsdk.call("action", "get_return_to_launch_altitude") == pytest.approx(20.0)
    mavsdk.call("action", "set_current_speed", 5.0)
    north_deg = here.latitude_deg + 15.0 * DEG_PER_M
    mavsdk.call(
        "action",
        "goto_location",
        north_deg,
        here.longitude_deg,
        here.absolute_altitude_m + 2.0,
        0.0 if vehicle == "px4" else math.nan,
    )
    mavsdk.first("telemetry", "position", lambda p: abs(p.latitude_deg - north_deg) < 1.5 * DEG_PER_M)
    mavsdk.call("action", "return_to_launch")
    mavsdk.first("telemetry", "flight_mode", lambda mode: mode.name == "RETURN_TO_LAUNCH")
    mavsdk.first("telemetry", "armed", lambda armed: not armed)
    assert mavsdk.first("telemetry", "position").relative_altitude_m < 1.5


@compatibility(feature="action: do_orbit")
def test_orbit(mavsdk: Session, vehicle: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.action import OrbitYawBehavior

    here = fly(mavsdk)
    behaviour = OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER
    circle = (10.0, 3.0, behaviour, here.latitude_deg, here.longitude_deg, here.absolute_altitude_m)
    if vehicle == "ardupilot":
        assert "UNSUPPORTED" in rejected(mavsdk, "action", "do_orbit", *circle)
        not_offered(request, "no DO_ORBIT in 4.6")
        return
    mavsdk.call("action", "do_orbit", *circle)
    start = mavsdk.first("telemetry", "position_velocity_ned").position

    def on_circle(at: Any) -> bool:
        away_m = math.hypot(at.position.north_m - start.north_m, at.position.east_m - start.east_m)
        return abs(away_m - 10.0) < 1.5 and math.hypot(at.velocity.north_m_s, at.velocity.east_m_s) > 2.0

    moved(mavsdk, on_circle)


def _setpoints(vehicle: str) -> dict[str, tuple[str, tuple[Any, ...], Callable[[Any, Any], bool]]]:
    from mavsdk.plugins import offboard as o

    place = o.PositionNedYaw(6.0, -4.0, -10.0, 0.0)

    def at_place(start: Any, at: Any) -> bool:
        return math.hypot(at.position.north_m - 6.0, at.position.east_m + 4.0) < 1.0

    def north(start: Any, at: Any) -> bool:
        return bool(at.velocity.north_m_s > 1.5)

    def climbs(start: Any, at: Any) -> bool:
        return bool(at.velocity.down_m_s < -0.3)

    return {
        "position_ned": ("set_position_ned", (place,), at_place),
        "velocity_ned": ("set_velocity_ned", (o.VelocityNedYaw(2.0, 0.0, 0.0, 0.0),), north),
        "velocity_body": (
            "set_velocity_body",
            (o.VelocityBodyYawspeed(2.0, 0.0, 0.0, 0.0),),
            lambda start, at: math.hypot(at.velocity.north_m_s, at.velocity.east_m_s) > 1.5,
        ),
        "position_velocity_ned": (
            "set_position_velocity_ned",
            (place, o.VelocityNedYaw(0.0, 0.0, 0.0, 0.0)),
            at_place,
        ),
        "position_velocity_acceleration_ned": (
            "set_position_velocity_acceleration_ned",
            (place, o.VelocityNedYaw(0.0, 0.0, 0.0, 0.0), o.AccelerationNed(0.0, 0.0, 0.0)),
            at_place,
        ),
        "acceleration_ned": ("set_acceleration_ned", (o.AccelerationNed(1.0, 0.0, 0.0),), north),
        "attitude": ("set_attitude", (o.Attitude(0.0, 0.0, 0.0, 0.75),), climbs),
        "attitude_rate": ("set_attitude_rate", (o.AttitudeRate(0.0, 0.0, 0.0, 0.75),), climbs),
    }


SETPOINTS: Final = (
    *("position_ned", "position_global", "velocity_ned", "velocity_body", "position_velocity_ned"),
    *("position_velocity_acceleration_ned", "acceleration_ned", "attitude", "attitude_rate"),
)


@pytest.mark.parametrize("kind", SETPOINTS)
@compatibility(feature="offboard")
def test_offboard(mavsdk: Session, vehicle: str, kind: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.offboard import PositionGlobalYaw

    here = fly(mavsdk)
    if kind == "position_global":
        east_deg = here.longitude_deg + 8.0 * DEG_PER_M / math.cos(math.radians(here.latitude_deg))
        place = PositionGlobalYaw(
            here.latitude_deg, east_deg, HEIGHT_M, 0.0, PositionGlobalYaw.AltitudeType.REL_HOME
        )
        method, arguments, found = "set_position_global", (place,), lambda start, at: True
    else:
        method, arguments, found = _setpoints(vehicle)[kind]
    start = mavsdk.first("telemetry", "position_velocity_ned")
    mavsdk.call("offboard", method, *arguments)
    mavsdk.call("offboard", "start")
    assert mavsdk.call("offboard", "is_active")
    if vehicle == "ardupilot" and kind == "attitude_rate":
        with pytest.raises(AssertionError, match="not seen"):
            mavsdk.first("telemetry", "position_velocity_ned", lambda at: found(start, at), wait_s=1.0)
        not_offered(request, "without attitude_rate: body rates alone are not flown in GUIDED here")
    elif kind == "position_global":
        mavsdk.first("telemetry", "position", lambda p: abs(p.longitude_deg - east_deg) < 1.5 * DEG_PER_M)
    else:
        moved(mavsdk, lambda at: found(start, at))
    mavsdk.call("offboard", "stop")
    fly(mavsdk)


@compatibility(feature="mission")
def test_mission(mavsdk: Session, vehicle: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.mission import MissionItem, MissionPlan

    here = fly(mavsdk)
    items = [
        MissionItem(
            latitude_deg=here.latitude_deg + north_m * DEG_PER_M,
            longitude_deg=here.longitude_deg,
            relative_altitude_m=10.0,
            speed_m_s=5.0,
            is_fly_through=True,
        )
        for north_m in (15.0, 30.0)
    ]
    mavsdk.call("mission", "upload_mission", MissionPlan(items))
    if vehicle == "ardupilot":
        assert not accepted(mavsdk, "mission", "download_mission")
        not_offered(request, "MAVSDK can't read ArduPilot's home item; mission_raw can")
        return
    assert len(mavsdk.call("mission", "download_mission").mission_items) == 2
    mavsdk.call("mission", "set_return_to_launch_after_mission", False)
    mavsdk.until("start", lambda: accepted(mavsdk, "mission", "start_mission"))
    mavsdk.first("mission", "mission_progress", lambda p: p.total == 2 and p.current == 1)
    mavsdk.call("mission", "pause_mission")
    mavsdk.call("mission", "start_mission")
    mavsdk.first("mission", "mission_progress", lambda p: p.total == 2 and p.current == 2)
    assert mavsdk.call("mission", "is_mission_finished")
    mavsdk.call("mission", "clear_mission")


@compatibility(feature="mission_raw: flown")
def test_raw_mission(mavsdk: Session, vehicle: str) -> None:
    from mavsdk.plugins.mission_raw import MissionItem

    here = fly(mavsdk)
    places = ((16, 0.0), (16, 15.0), (16, 30.0))
    items = [
        MissionItem(
            seq=seq,
            frame=6,
            command=command,
            current=int(seq == 0),
            autocontinue=1,
            param1=0.0,
            param2=0.0,
            param3=0.0,
            param4=math.nan if vehicle == "px4" else 0.0,
            x=round((here.latitude_deg + north_m * DEG_PER_M) * 1e7),
            y=round(here.longitude_deg * 1e7),
            z=10.0,
            mission_type=0,
        )
        for seq, (command, north_m) in enumerate(places)
    ]
    mavsdk.call("mission_raw", "upload_mission", items)
    assert len(mavsdk.call("mission_raw", "download_mission")) == 3
    mavsdk.until("start", lambda: accepted(mavsdk, "mission_raw", "start_mission"))
    last = items[-1].x * 1e-7
    mavsdk.first("telemetry", "position", lambda p: abs(p.latitude_deg - last) < 2.5 * DEG_PER_M)
    fly(mavsdk)
    mavsdk.call("mission_raw", "clear_mission")


@compatibility(feature="manual_control")
def test_manual_control(mavsdk: Session, vehicle: str) -> None:
    fly(mavsdk)

    def sticks(forward: float) -> Callable[[], None]:
        plugin = getattr(mavsdk.plugin("manual_control"), "_plugin", mavsdk.plugin("manual_control"))
        return lambda: plugin.set_manual_control_input(forward, 0.0, 0.5, 0.0)

    hold, push = sticks(0.0), sticks(0.6)
    mavsdk.first("telemetry", "position", each=hold)
    mavsdk.call("manual_control", "start_position_control")
    if vehicle == "px4":  # MAVSDK has no name for what ArduPilot has instead
        mavsdk.first("telemetry", "flight_mode", lambda mode: mode.name == "POSCTL", hold)
    moved(mavsdk, lambda at: math.hypot(at.velocity.north_m_s, at.velocity.east_m_s) > 2.0, push)
    fly(mavsdk)


@compatibility(feature="follow_me")
def test_follow_me(mavsdk: Session, vehicle: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.follow_me import Config, TargetLocation

    here = fly(mavsdk)
    target = TargetLocation(
        here.latitude_deg + 30.0 * DEG_PER_M, here.longitude_deg, here.absolute_altitude_m, 0.0, 0.0, 0.0
    )
    altitude = Config.FollowAltitudeMode.CONSTANT
    if vehicle == "px4":
        mavsdk.call("follow_me", "set_config", Config(10.0, 8.0, 0.1, altitude, 8.0, 180.0))
    if vehicle == "ardupilot":
        assert not accepted(mavsdk, "follow_me", "start")
        not_offered(request, "MAVSDK follows with PX4 only")
        return
    pytest.skip("MAVSDK's follow_me was not seen to reach its target on PX4 yet")
    mavsdk.call("follow_me", "start")
    plugin = getattr(mavsdk.plugin("follow_me"), "_plugin", mavsdk.plugin("follow_me"))
    mavsdk.first(
        "telemetry",
        "position",
        lambda p: abs((target.latitude_deg - p.latitude_deg) / DEG_PER_M) < 12.0,
        lambda: plugin.set_target_location(target),
    )
    mavsdk.call("follow_me", "stop")
    fly(mavsdk)


@compatibility(feature="failure")
def test_failure(mavsdk: Session, vehicle: str) -> None:
    from mavsdk.plugins.failure import FailureType, FailureUnit

    land(mavsdk)
    mavsdk.call("failure", "inject", FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
    mavsdk.first("telemetry", "health", lambda health: not health.is_global_position_ok)
    mavsdk.call("failure", "inject", FailureUnit.SENSOR_GPS, FailureType.OK, 0)
    mavsdk.first("telemetry", "health", lambda health: health.is_global_position_ok)


@compatibility(feature="log_files")
def test_log_files(mavsdk: Session, tmp_path: Path) -> None:
    """Of the flights above."""
    land(mavsdk)
    entries = [entry for entry in mavsdk.call("log_files", "get_entries") if entry.size_bytes > 0]
    assert entries
    smallest = min(entries, key=lambda entry: entry.size_bytes)
    file = tmp_path / "flight.log"
    mavsdk.collect("log_files", "download_log_file", smallest, str(file))
    assert file.stat().st_size == smallest.size_bytes
