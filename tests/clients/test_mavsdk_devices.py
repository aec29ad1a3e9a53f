"""MAVSDK's plugins for what a vehicle is and has, on the ground: both interfaces, every vehicle."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from tests.clients.compatibility import not_offered
from tests.clients.mavsdk_flying import rejected
from tests.clients.mavsdk_session import ASYNCIO, Session
from tests.clients.plugin_sitl import PluginSitl

compatibility = pytest.mark.compatibility


@compatibility(feature="info")
def test_info(mavsdk: Session, sitl: PluginSitl) -> None:
    version = mavsdk.call("info", "get_version")
    expected = (1, 16, 1) if sitl.flavour == "px4" else (4, 6, 3)
    assert (version.flight_sw_major, version.flight_sw_minor, version.flight_sw_patch) == expected
    identity = mavsdk.call("info", "get_identification")
    assert identity.legacy_uid or identity.hardware_uid.strip("0")
    mavsdk.call("info", "get_product")


@compatibility(feature="param")
def test_parameters(mavsdk: Session, sitl: PluginSitl) -> None:
    number, real = (
        ("COM_OBL_RC_ACT", "COM_DISARM_LAND") if sitl.flavour == "px4" else ("FENCE_ACTION", "BATT_LOW_VOLT")
    )
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


@compatibility(feature="calibration")
@pytest.mark.slow
def test_calibration(mavsdk: Session, sitl: PluginSitl, client: str, request: pytest.FixtureRequest) -> None:
    if sitl.flavour == "ardupilot":
        assert "UNSUPPORTED" in rejected(mavsdk, "calibration", "cancel")
        not_offered(request, "MAVSDK calibrates PX4 only")
        return
    names = ["gyro", "level_horizon", "accelerometer"] + ["magnetometer"] * (client == ASYNCIO)
    for name in names:
        reported = mavsdk.collect("calibration", f"calibrate_{name}")
        assert reported[-1][0].name == "SUCCESS"
        progress = [data.progress for _, data in reported if data.has_progress]
        assert progress == sorted(progress) and progress[0] == 0.0 and progress[-1] == 1.0
        if name in ("accelerometer", "magnetometer"):
            texts = [data.status_text for _, data in reported if data.has_status_text]
            for side in ("down", "up", "left", "right", "front", "back"):
                assert any(f"{side} orientation detected" in text for text in texts)


@compatibility(feature="calibration")
def test_calibration_is_cancelled(mavsdk: Session, sitl: PluginSitl) -> None:
    """And what is calibrated next is not disturbed.

    In a pause: MAVSDK 4.1 waits for the acknowledgement of `cancel` under the lock that its reader of texts
    takes, and hangs for ever when a text comes in between.
    """
    if sitl.flavour == "ardupilot":
        return

    def paused(data: Any) -> bool:
        return data.has_status_text and "hold vehicle still on a pending side" in data.status_text

    for name in ("magnetometer", "accelerometer"):
        assert mavsdk.cut_short("calibration", f"calibrate_{name}", "cancel", paused) == "CANCELLED"
        assert mavsdk.collect("calibration", "calibrate_gyro")[-1][0].name == "SUCCESS"


@compatibility(feature="gripper")
def test_gripper(mavsdk: Session) -> None:
    mavsdk.call("gripper", "grab", 1)
    mavsdk.call("gripper", "release", 1)


@compatibility(feature="winch")
def test_winch(mavsdk: Session, request: pytest.FixtureRequest) -> None:
    assert "TIMEOUT" in rejected(mavsdk, "winch", "relax", 1)
    not_offered(request, "no winch")


@compatibility(feature="tune")
def test_tune(mavsdk: Session, sitl: PluginSitl, request: pytest.FixtureRequest) -> None:
    """MAVSDK 4.1's Python interface gives a song to the library as a number; PLAY_TUNE itself is taken."""
    from mavsdk.plugins.tune import SongElement, TuneDescription

    with pytest.raises(TypeError):
        mavsdk.call("tune", "play_tune", TuneDescription([SongElement.STYLE_NORMAL], 120))
    sitl.script.link.mav.play_tune_send(1, 1, b"L16 CDEFG", b"")
    sitl.script.next("HEARTBEAT")
    not_offered(request, "MAVSDK 4.1 can't pass a song from Python; PLAY_TUNE is taken")


@compatibility(feature="transponder")
def test_transponder(mavsdk: Session, sitl: PluginSitl) -> None:
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
    received = mavsdk.first("transponder", "transponder", lambda v: v.icao_address == address, report)
    assert received.latitude_deg == pytest.approx(here.latitude_deg + 0.02, abs=1e-6)
    assert received.callsign == "TEST1234"


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
