"""pymavlink's own tools: mavftp, mavparm, the loaders of mavwp, scripts that calibrate and drive devices."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from pymavlink import mavftp, mavparm, mavwp
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.compatibility import not_offered
from tests.clients.mavutil_client import UPLOADS, Client
from tests.clients.sitl_process import free_port, running_sitl
from tests.slow import slow

SPEEDUP: Final = 5.0
TRANSFER_S: Final = 15
UNASKED: Final = 65535
"""param_index of a value that was not requested by its index."""
FOLDER: Final = {"px4": "/fs/microsd", "ardupilot": "/APM"}

compatibility = pytest.mark.compatibility


@pytest.fixture(scope="module", params=["px4", *map(slow, ("ardupilot", "px4-plane", "ardupilot-plane"))])
def vehicle(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def script(vehicle: str) -> Iterator[Client]:
    port, flavour = free_port(), vehicle.removesuffix("-plane")
    options = () if vehicle == flavour else ("--model", "aerosonde")
    with running_sitl(flavour, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=options):
        made = Client(flavour, f"udpin:127.0.0.1:{port}", speedup=SPEEDUP)
        made.ready()
        yield made
        made.link.close()


@compatibility(client="pymavlink mavftp", feature="put, get, list, rename, remove, crc")
@pytest.mark.slow
def test_mavftp(script: Client, tmp_path: Path) -> None:
    client = mavftp.MAVFTP(script.link, 1, 1)
    folder, file = f"{FOLDER[script.flavour]}/tools", tmp_path / "data.bin"
    file.write_bytes(bytes(range(256)) * 40)

    def done(answer: Any) -> None:
        assert answer.error_code == mavftp.FtpError.Success, (answer.operation_name, answer.error_code)

    done(client.cmd_mkdir([folder]))
    done(client.cmd_put([str(file), f"{folder}/data.bin"]))
    done(client.process_ftp_reply("put", timeout=TRANSFER_S))
    done(client.cmd_list([folder]))
    assert "data.bin" in {entry.name for entry in client.list_result}
    back = tmp_path / "back.bin"
    done(client.cmd_get([f"{folder}/data.bin", str(back)]))
    done(client.process_ftp_reply("get", timeout=TRANSFER_S))
    assert back.read_bytes() == file.read_bytes()
    done(client.cmd_crc([f"{folder}/data.bin"]))
    done(client.cmd_rename([f"{folder}/data.bin", f"{folder}/more.bin"]))
    done(client.cmd_rm([f"{folder}/more.bin"]))


@compatibility(client="pymavlink mavparm", feature="list, set, save, load")
def test_mavparm(script: Client, tmp_path: Path) -> None:
    name = "COM_DISARM_LAND" if script.flavour == "px4" else "BATT_LOW_VOLT"
    table = mavparm.MAVParmDict()
    count = 0
    received: set[int] = set()
    script.link.param_fetch_all()

    def complete(message: Any) -> bool:
        nonlocal count
        if message.get_type() != "PARAM_VALUE":
            return False
        table[message.param_id] = message.param_value
        if message.param_index != UNASKED:
            received.add(message.param_index)
            count = message.param_count
        return len(received) == count > 0

    def missing() -> None:
        """What a busy machine has dropped is requested again, as every client does."""
        if count and not script.link.mav.total_packets_received % 50:
            for index in sorted(set(range(count)) - received)[:20]:
                script.link.mav.param_request_read_send(1, 1, b"", index)

    script.until("parameters", complete, missing)
    assert count > 300
    before = table[name]
    assert table.mavset(script.link, name, before - 1.0, retries=20)
    assert script.parameter(name) == pytest.approx(before - 1.0)
    file = tmp_path / "vehicle.parm"
    table[name] = before
    table.save(str(file), wildcard=name)
    loaded = mavparm.MAVParmDict()
    assert loaded.load(str(file), mav=script.link, check=False)
    assert script.parameter(name) == pytest.approx(before)


def _upload(script: Client, items: list[Any], kind: int) -> None:
    """What every script does with a loader's items; anew where the vehicle gave up on a busy machine."""
    for _ in range(UPLOADS):
        message = _uploaded(script, items, kind)
        if message.type == mavlink.MAV_MISSION_ACCEPTED:
            return
    raise AssertionError(f"not accepted: {message}")


def _uploaded(script: Client, items: list[Any], kind: int) -> Any:
    link = script.link
    link.mav.mission_count_send(1, 1, len(items), kind)
    while True:
        message = script.until(
            "mission request",
            lambda m: (
                m.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
                and m.mission_type == kind
            ),
        )
        if message.get_type() == "MISSION_ACK":
            return message
        link.mav.send(items[message.seq])


def _download(script: Client, kind: int) -> list[Any]:
    link = script.link
    link.mav.mission_request_list_send(1, 1, kind)
    count = script.next("MISSION_COUNT", lambda m: m.mission_type == kind).count
    items = []
    for seq in range(count):
        link.mav.mission_request_int_send(1, 1, seq, kind)
        items.append(
            script.next("MISSION_ITEM_INT", lambda m, seq=seq: m.seq == seq and m.mission_type == kind)
        )
    link.mav.mission_ack_send(1, 1, mavlink.MAV_MISSION_ACCEPTED, kind)
    return items


def _places(script: Client) -> tuple[float, float]:
    here = script.next("GLOBAL_POSITION_INT")
    return here.lat * 1e-7, here.lon * 1e-7


@compatibility(client="pymavlink mavwp", feature="mission, fence, rally")
@pytest.mark.parametrize("kind", ["mission", "fence", "rally"])
def test_mavwp(script: Client, kind: str, tmp_path: Path) -> None:
    lat, lon = _places(script)
    if kind == "mission":
        rows = [(0, 16, lat, lon, 500.0), (3, 22, lat, lon, 10.0), (3, 16, lat + 2e-4, lon, 10.0)]
    elif kind == "fence":
        corners = ((-1, -1), (-1, 1), (1, 1), (1, -1))
        rows = [(3, 5001, lat + n * 2e-3, lon + e * 2e-3, 0.0) for n, e in corners]
    else:
        rows = [(3, 5100, lat + 1e-3, lon, 20.0), (3, 5100, lat - 1e-3, lon, 20.0)]
    loader = {
        "mission": mavwp.MAVWPLoader,
        "fence": mavwp.MissionItemProtocol_Fence,
        "rally": mavwp.MissionItemProtocol_Rally,
    }[kind](1, 1)
    first = 4 if kind == "fence" else 0
    lines = [
        f"{i}\t{int(i == 0)}\t{f}\t{c}\t{first}\t0\t0\t0\t{x:.7f}\t{y:.7f}\t{z}\t1"
        for i, (f, c, x, y, z) in enumerate(rows)
    ]
    file = tmp_path / "plan.txt"
    file.write_text("\n".join(["QGC WPL 110", *lines]) + "\n")
    assert loader.load(str(file)) == len(rows)
    items = [loader.wp(index) for index in range(loader.count())]
    number = loader.mav_mission_type()
    for item in items:
        item.target_system, item.target_component, item.mission_type = 1, 1, number
    _upload(script, items, number)
    back = _download(script, number)
    assert [item.command for item in back] == [row[1] for row in rows]
    for item, (_, _, x, y, _) in list(zip(back, rows, strict=True))[1:]:
        # mavwp's items are floats, good for half a metre
        assert (item.x, item.y) == (pytest.approx(x * 1e7, abs=100), pytest.approx(y * 1e7, abs=100))
    script.link.mav.mission_clear_all_send(1, 1, number)
    script.next("MISSION_ACK", lambda m: m.mission_type == number)


@compatibility(client="pymavlink (mavutil)", feature="calibration by commands")
def test_calibration(script: Client, request: pytest.FixtureRequest) -> None:
    script.command(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 1)
    if script.flavour == "px4":
        script.next("STATUSTEXT", lambda m: "calibration done: gyro" in m.text)
        return
    script.command(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 0, 0, 1)
    for position in (1, 2, 3, 4, 5, 6):
        requested = script.next(
            "COMMAND_LONG",
            lambda m, position=position: (
                m.command == mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS and m.param1 == position
            ),
        )
        script.command(mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS, requested.param1)
    script.next("STATUSTEXT", lambda m: m.text == "Calibration successful")
    script.command(mavlink.MAV_CMD_DO_START_MAG_CAL)
    script.next("MAG_CAL_PROGRESS", lambda m: m.completion_pct > 50)
    report = script.next("MAG_CAL_REPORT")
    assert report.cal_status == mavlink.MAG_CAL_SUCCESS
    script.command(mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL)


@compatibility(client="pymavlink (mavutil)", feature="relay, servo, motor test")
def test_devices(script: Client, vehicle: str, request: pytest.FixtureRequest) -> None:
    if script.flavour == "px4":
        unsupported = mavlink.MAV_RESULT_UNSUPPORTED
        assert script.result(mavlink.MAV_CMD_DO_SET_SERVO, 9, 1500) == unsupported
        assert script.result(mavlink.MAV_CMD_DO_MOTOR_TEST, 1, 0, 10, 1) == unsupported
        script.command(mavlink.MAV_CMD_ACTUATOR_TEST, 0.1, 1.0, 0, 0, 1)
        not_offered(request, "PX4 has ACTUATOR_TEST and DO_SET_ACTUATOR instead")
        return
    script.command(mavlink.MAV_CMD_DO_SET_SERVO, 9, 1500)
    script.command(mavlink.MAV_CMD_DO_SET_RELAY, 0, 1)
    if vehicle == "ardupilot-plane":
        assert script.result(mavlink.MAV_CMD_DO_MOTOR_TEST, 1, 0, 10, 1) == mavlink.MAV_RESULT_FAILED
        not_offered(request, "without motor test, which is for QuadPlanes")
        return
    script.command(mavlink.MAV_CMD_DO_MOTOR_TEST, 1, 0, 10, 1)
    script.next("STATUSTEXT", lambda m: m.text == "finished motor test")


@compatibility(client="pymavlink (mavutil)", feature="sticks: RC_CHANNELS_OVERRIDE, MANUAL_CONTROL")
def test_overrides_are_seen(script: Client) -> None:
    """On PX4 the radio is received, and by default (COM_RC_IN_MODE 1) steers nothing."""
    script.message_rate(mavlink.MAVLINK_MSG_ID_RC_CHANNELS, 10.0)

    def each() -> None:
        script.link.mav.rc_channels_override_send(1, 1, 1600, 1500, 1000, 1500, 1800, 0, 0, 0)

    script.next("RC_CHANNELS", lambda m: m.chan1_raw == 1600, each)
    script.link.mav.rc_channels_override_send(1, 1, *(0,) * 8)
    if script.flavour == "ardupilot":
        script.next("RC_CHANNELS", lambda m: m.chan1_raw == 1500)
