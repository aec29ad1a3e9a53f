"""MAVSDK's plugins that fly, by both of its interfaces, on both flavours."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from tests.clients.compatibility import not_offered
from tests.clients.mavsdk_flying import DEG_PER_M, HEIGHT_M, accepted, fly, land, moved, raw_item, rejected
from tests.clients.mavsdk_session import Session

compatibility = pytest.mark.compatibility
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def vehicle(request: pytest.FixtureRequest) -> str:
    """Copters; aircraft are flown in a module of their own."""
    return str(request.param)


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

    here = mavsdk.first("telemetry", "position") if vehicle == "ardupilot" else fly(mavsdk)
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
    mavsdk.transfer("mission", "upload_mission", MissionPlan(items))
    if vehicle == "ardupilot":
        assert not accepted(mavsdk, "mission", "download_mission")
        not_offered(request, "MAVSDK can't read ArduPilot's home item; mission_raw can")
        return
    assert len(mavsdk.transfer("mission", "download_mission").mission_items) == 2
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
    here = fly(mavsdk)
    any_heading = (0.0, 0.0, 0.0, math.nan if vehicle == "px4" else 0.0)
    items = [
        raw_item(seq, 16, here.latitude_deg + north * DEG_PER_M, here.longitude_deg, parameters=any_heading)
        for seq, north in enumerate((0.0, 15.0, 30.0))
    ]
    mavsdk.transfer("mission_raw", "upload_mission", items)
    assert len(mavsdk.transfer("mission_raw", "download_mission")) == 3
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

    if vehicle == "ardupilot":
        assert not accepted(mavsdk, "follow_me", "start")
        not_offered(request, "MAVSDK follows with PX4 only")
        return
    here = fly(mavsdk)
    target = TargetLocation(
        here.latitude_deg + 30.0 * DEG_PER_M, here.longitude_deg, here.absolute_altitude_m, 0.0, 0.0, 0.0
    )
    behind_m = 8.0
    altitude = Config.FollowAltitudeMode.CONSTANT
    mavsdk.call("follow_me", "set_config", Config(10.0, behind_m, 0.1, altitude, 8.0, 180.0))
    mavsdk.call("follow_me", "start")
    # MAVSDK takes a target from when it has received of the mode; then it repeats it by itself
    mavsdk.until("a place to follow", lambda: accepted(mavsdk, "follow_me", "set_target_location", target))
    assert mavsdk.call("follow_me", "is_active")
    mavsdk.first(
        "telemetry",
        "position",
        lambda p: abs((target.latitude_deg - p.latitude_deg) / DEG_PER_M - behind_m) < 1.0,
    )
    mavsdk.call("follow_me", "stop")
    fly(mavsdk)


@compatibility(feature="failure")
def test_failure(mavsdk: Session, vehicle: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.failure import FailureType, FailureUnit

    land(mavsdk)
    if vehicle == "ardupilot":
        arguments = (FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
        assert rejected(mavsdk, "failure", "inject", *arguments) == "UNSUPPORTED"
        not_offered(request, "the firmware has no such command; its SIM_ parameters switch failures")
        return
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
