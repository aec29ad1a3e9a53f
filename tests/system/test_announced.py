"""What a vehicle announces about itself is true: a client that waits for it is not refused afterwards."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import VehicleSpec, WorldSpec
from tests.system.wire_client import Client

GPS, PREARM = mavlink.MAV_SYS_STATUS_SENSOR_GPS, mavlink.MAV_SYS_STATUS_PREARM_CHECK
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
MODELS = {"px4": "iris", "px4-plane": "aerosonde"}


def booting(vehicle: str) -> Sitl:
    specification = VehicleSpec(autopilot="px4", model=MODELS[vehicle])
    return Sitl(WorldSpec(vehicles=(specification,), seed=1))


def global_position_ok(status: Any) -> bool:
    """As MAVSDK reads SYS_STATUS (`Health.is_global_position_ok`)."""
    return bool(status.onboard_control_sensors_present & status.onboard_control_sensors_health & GPS)


@pytest.mark.parametrize("role", ["onboard", "gcs"])
@pytest.mark.parametrize("vehicle", sorted(MODELS))
def test_px4_arms_as_soon_as_it_announces_its_position_and_home(vehicle: str, role: str) -> None:
    sitl = booting(vehicle)
    client = Client(sitl, role=role)
    seen_s: dict[str, float] = {}
    while len(seen_s) < 3:
        assert sitl.time_us < 10e6, seen_s
        for message in client.run(0.02):
            now_s = sitl.time_us * 1e-6
            if message.get_type() == "HOME_POSITION":
                seen_s.setdefault("home", now_s)
            elif message.get_type() == "SYS_STATUS" and global_position_ok(message):
                seen_s.setdefault("position", now_s)
                assert message.onboard_control_sensors_health & PREARM
        if {"home", "position"} <= set(seen_s):
            assert client.command(ARM, 1)[0] == mavlink.MAV_RESULT_ACCEPTED
            seen_s["armed"] = now_s
    assert 3.0 < seen_s["home"] < 3.3


def test_px4_gives_the_reason_of_every_refused_arming() -> None:
    sitl = booting("px4")
    client = Client(sitl)
    client.run(1.2)
    refused = 0
    while True:
        result, received = client.command(ARM, 1)
        texts = [message.text for message in received if message.get_type() == "STATUSTEXT"]
        if result == mavlink.MAV_RESULT_ACCEPTED:
            break
        refused += 1
        assert result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        assert any(text.startswith("Arming denied: ") for text in texts), texts
        assert any(text.startswith("Preflight Fail: ") for text in texts), texts
        client.run(0.3)
    assert refused >= 3
    assert sitl.time_us * 1e-6 < 4.2


CRUISE = mavlink.MAV_STANDARD_MODE_CRUISE
ADVANCED, NOT_SELECTABLE = 1, 2  # MAV_MODE_PROPERTY


@pytest.mark.parametrize("vehicle", sorted(MODELS))
def test_px4_lists_each_mode_once_with_its_properties(vehicle: str) -> None:
    client = Client(booting(vehicle))
    client.run(1.2)
    result, received = client.command(REQUEST, mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, 0)
    modes = [message for message in received if message.get_type() == "AVAILABLE_MODES"]
    assert result == mavlink.MAV_RESULT_ACCEPTED
    assert [mode.mode_index for mode in modes] == list(range(1, 26))
    assert {mode.number_modes for mode in modes} == {25}
    by_number = {mode.custom_mode: mode for mode in modes}
    assert len(by_number) == 25
    names = [mode.mode_name for mode in modes if mode.mode_name and mode.properties < NOT_SELECTABLE]
    assert len(set(names)) == len(names)
    found = {
        (mode.custom_mode >> 16 & 0xFF, mode.custom_mode >> 24): (mode.standard_mode, mode.mode_name)
        for mode in modes
    }
    assert found[3, 0] == (mavlink.MAV_STANDARD_MODE_POSITION_HOLD if vehicle == "px4" else CRUISE, "")
    assert found[3, 1] == (mavlink.MAV_STANDARD_MODE_ORBIT, "")
    assert found[4, 3] == (0, "Hold")
    assert found[4, 5] == (mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY, "")
    assert found[4, 6] == (mavlink.MAV_STANDARD_MODE_LAND, "")
    hidden = [mode.mode_name for mode in modes if mode.properties & NOT_SELECTABLE]
    assert hidden == ["Termination", *["(Mode not available)"] * 8]
    assert by_number[0x000A0000].properties == ADVANCED | NOT_SELECTABLE
    assert by_number[0x00030000].properties == 0


def test_px4_tells_the_standard_mode_it_flies() -> None:
    client = Client(booting("px4"))
    client.run(1.2)
    for main, sub, standard in ((4, 3, 0), (4, 5, 5), (4, 6, 7), (2, 0, 4), (3, 0, 1)):
        client.send(mavlink.MAVLink_set_mode_message(1, 1, main << 16 | sub << 24))
        sent = [message for message in client.run(2.1) if message.get_type() == "CURRENT_MODE"]
        current = sent[-1]
        assert current.custom_mode == main << 16 | sub << 24
        assert current.standard_mode == standard
