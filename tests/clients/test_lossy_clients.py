"""Other people's clients, which retry by themselves, over a poor radio on UDP: 5 % loss, 200 ms of jitter,
repetitions and swaps. Over a bad one (30 %) they may fail, but nothing is done by half.
"""

import asyncio
import math
import random
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavftp, mavparm

from autopilot_bridge.links import Impairment
from tests.clients.mavsdk_flying import raw_item
from tests.clients.mavsdk_waiting import WALL_DEADLINE_S, first, ground_station
from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import free_port, running_sitl
from tests.lossy_proxy import LossyProxy, lossy_proxy

POOR = Impairment(loss=0.05, duplicate=0.02, reorder=0.02, jitter_s=0.2)
BAD = Impairment(loss=0.3, duplicate=0.02, reorder=0.02, jitter_s=0.2)
FOLDER = {"px4": "/fs/microsd", "ardupilot": "/APM"}
SPEED = {"px4": "MPC_XY_VEL_MAX", "ardupilot": "WPNAV_SPEED"}
FLAVOURS = ("px4", "ardupilot")
_UPLOADS = 8

pytestmark = pytest.mark.slow


@contextmanager
def radio(flavour: str, impairment: Impairment, seed: int) -> Iterator[tuple[str, LossyProxy]]:
    """A vehicle in real time behind a radio; where its client finds it."""
    near, far = free_port(), free_port()
    with (
        running_sitl(flavour, [f"udpout:127.0.0.1:{near}"], speedup=1.0),
        lossy_proxy(f"udpin:127.0.0.1:{near}", f"udpout:127.0.0.1:{far}", impairment, seed) as proxy,
    ):
        yield f"udpin:127.0.0.1:{far}", proxy


def put_and_get(client: Client, flavour: str, folder: Path) -> tuple[bytes, bytes | None]:
    """A file to the vehicle and back; None: refused or not answered."""
    ftp = mavftp.MAVFTP(client.link, 1, 1)
    data = random.Random(3).randbytes(4000)
    file, back = folder / "there.bin", folder / "back.bin"
    file.write_bytes(data)
    there = f"{FOLDER[flavour]}/radio.bin"
    ftp.cmd_put([str(file), there])
    if ftp.process_ftp_reply("put", timeout=60).error_code != mavftp.FtpError.Success:
        return data, None
    ftp.cmd_get([there, str(back)])
    if ftp.process_ftp_reply("get", timeout=60).error_code != mavftp.FtpError.Success:
        return data, None
    return data, back.read_bytes()


def parameter(client: Client, name: str) -> float:
    """Ask until it is answered, as `mavset` does."""
    for _ in range(10):
        client.link.mav.param_request_read_send(1, 1, name.encode(), -1)
        value = client.link.recv_match(
            type="PARAM_VALUE", condition=f"PARAM_VALUE.param_id == '{name}'", blocking=True, timeout=2.0
        )
        if value is not None:
            return float(value.param_value)
    raise AssertionError(f"{name} was not answered")


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_pymavlinks_tools_over_a_poor_radio(flavour: str, tmp_path: Path) -> None:
    with radio(flavour, POOR, 1) as (url, proxy):
        client = Client(flavour, url, speedup=1.0, stream_hz=4)
        sent, back = put_and_get(client, flavour, tmp_path)
        assert back == sent
        table = mavparm.MAVParmDict()
        name = SPEED[flavour]
        before = parameter(client, name)
        table[name] = before
        assert table.mavset(client.link, name, before - 1.0, retries=10)
        assert parameter(client, name) == pytest.approx(before - 1.0)
        assert proxy.lost > 10
        client.link.close()


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_file_is_never_there_by_half(flavour: str, seed: int, tmp_path: Path) -> None:
    with radio(flavour, BAD, seed) as (url, _):
        client = Client(flavour, url, speedup=1.0, stream_hz=4)
        sent, back = put_and_get(client, flavour, tmp_path)
        assert back in (None, sent)
        client.link.close()


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_mavsdk_over_a_poor_radio(flavour: str) -> None:
    """All parameters, and a mission there and back.

    ArduPilot answers an item that comes twice with INVALID_SEQUENCE and keeps the transfer open; MAVSDK gives
    up at that, so its user tries again.
    """
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
    from mavsdk.asyncio.plugins.param import ParamAsync
    from mavsdk.plugins.mission_raw import MissionRawError

    places = [473977418 + 10 * seq for seq in range(15)]
    items = [raw_item(seq, 16, x * 1e-7, 8.5455939, height_m=20.0) for seq, x in enumerate(places)]

    async def script(url: str) -> None:
        async with ground_station(url.replace("udpin:", "udpin://")) as system:
            async with asyncio.timeout(120.0):
                everything = await ParamAsync(system).get_all_params()
            assert len(everything.float_params) + len(everything.int_params) > 300
            missions = MissionRawAsync(system)
            async with asyncio.timeout(240.0):
                for _ in range(_UPLOADS):
                    try:
                        await missions.upload_mission(items)
                        break
                    except MissionRawError as error:
                        assert flavour == "ardupilot", error
                        assert "INVALID_SEQUENCE" in str(error)
                back = await missions.download_mission()
        assert [item.x for item in back][1:] == places[1:]

    with radio(flavour, POOR, 2) as (url, proxy):
        asyncio.run(script(url))
        assert proxy.lost > 10


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_mavsdk_flies_by_setpoints_over_a_poor_radio(flavour: str) -> None:
    """Offboard: both corners are reached, and the vehicle never leaves the guided mode."""
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    from mavsdk.asyncio.plugins.action import ActionAsync
    from mavsdk.asyncio.plugins.offboard import OffboardAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
    from mavsdk.plugins.offboard import PositionNedYaw
    from mavsdk.plugins.telemetry import FlightMode

    async def until_accepted(ask: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Ask again where an answer was lost, or it can't be done yet."""
        from mavsdk.exceptions import MavsdkError

        async with asyncio.timeout(WALL_DEADLINE_S):
            while True:
                try:
                    return await ask()
                except MavsdkError:
                    await asyncio.sleep(0.5)

    async def script(url: str) -> None:
        async with ground_station(url.replace("udpin:", "udpin://")) as system:
            telemetry, action, offboard = TelemetryAsync(system), ActionAsync(system), OffboardAsync(system)
            if flavour == "ardupilot":  # which sends what was requested of it
                await until_accepted(lambda: telemetry.set_rate_position(4.0))
                await until_accepted(lambda: telemetry.set_rate_position_velocity_ned(4.0))
                await until_accepted(lambda: telemetry.set_rate_landed_state(2.0))
            await until_accepted(lambda: action.set_takeoff_altitude(8.0))

            async def take_off() -> None:
                await action.arm()  # ArduPilot arms before it has a position, and disarms again by itself
                await action.takeoff()

            await until_accepted(take_off)
            await first(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 7.0, "height")
            await first(telemetry.subscribe_landed_state(), lambda state: state.name == "IN_AIR", "in air")
            await offboard.set_position_ned(PositionNedYaw(0.0, 0.0, -8.0, 0.0))
            await until_accepted(offboard.start)
            for north_m, east_m in ((8.0, 0.0), (8.0, 8.0)):
                await offboard.set_position_ned(PositionNedYaw(north_m, east_m, -8.0, 0.0))

                def there(at: Any, north_m: float = north_m, east_m: float = east_m) -> bool:
                    return math.hypot(at.position.north_m - north_m, at.position.east_m - east_m) < 1.0

                await first(telemetry.subscribe_position_velocity_ned(), there, f"{north_m}, {east_m}")
                assert await first(telemetry.subscribe_flight_mode(), bool, "mode") == FlightMode.OFFBOARD
            await until_accepted(action.land)
            await first(telemetry.subscribe_armed(), lambda armed: not armed, "landing")

    with radio(flavour, POOR, 4) as (url, proxy):
        asyncio.run(script(url))
        assert proxy.lost > 10
