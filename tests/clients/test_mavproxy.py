"""MAVProxy, headless, as a ground station of the ardupilot flavour: its everyday commands."""

import socket
from pathlib import Path

import pytest

from tests.clients.mavproxy_process import UPLOAD_WAIT_S, Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

SPEEDUP = 2.0  # ArduPilot asks for a plan's item again after a second of its own, which MAVProxy must beat
HOME_DEG = (-35.3632621, 149.1652374)


def waypoints(folder: Path) -> Path:
    lat, lon = HOME_DEG
    rows = [(0, 0, 16, lat, lon, 584.0), (1, 3, 22, lat, lon, 10.0), (2, 3, 16, lat + 2e-4, lon, 10.0)]
    lines = [f"{i}\t{int(i == 0)}\t{f}\t{c}\t0\t0\t0\t0\t{x}\t{y}\t{z}\t1" for i, f, c, x, y, z in rows]
    path = folder / "plan.txt"
    path.write_text("\n".join(["QGC WPL 110", *lines]) + "\n")
    return path


@pytest.mark.timeout(900)
@pytest.mark.compatibility(
    client="MAVProxy", feature="arm, takeoff, guided, auto, rtl; param, wp", vehicle="ardupilot"
)
def test_everyday_commands(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_STREAM)
    with (
        running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=SPEEDUP),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("Saved ")  # the parameters, at once: FTP is refused, not left to time out
        station.type("param set WPNAV_SPEED 800")
        station.types_until("param fetch WPNAV_SPEED", "WPNAV_SPEED = 800")
        station.types_until(f"wp load {waypoints(tmp_path)}", "Flight plan received", UPLOAD_WAIT_S)
        station.type("mode guided")
        station.sees("Mode GUIDED")
        station.take_off(10)  # AUTO waits for its start while the vehicle stands
        station.type("mode auto")
        station.sees("DO_SET_MODE: ACCEPTED")
        station.sees("Reached command #2")
        station.type("rtl")
        station.sees("DISARMED")
