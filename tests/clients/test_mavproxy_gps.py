"""MAVProxy's GPSInput module: a receiver's fixes, by JSON to MAVProxy and by GPS_INPUT to the vehicle."""

import contextlib
import json
import socket
import time
from pathlib import Path

import pytest

from tests.clients.mavproxy_process import WALL_DEADLINE_S, Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

SPEEDUP = 5.0
FIX = {
    "ignore_flags": 0,
    "fix_type": 3,
    "lat": -353632600,
    "lon": 1491652300,
    "alt": 584.0,
    "hdop": 0.9,
    "vdop": 1.4,
    "speed_accuracy": 0.3,
    "horiz_accuracy": 0.8,
    "vert_accuracy": 1.5,
    "satellites_visible": 11,
}


@pytest.mark.slow
@pytest.mark.compatibility(client="MAVProxy", feature="GPSInput module", vehicle="ardupilot")
def test_fixes_by_json(tmp_path: Path) -> None:
    port, fixes = free_port(socket.SOCK_STREAM), free_port()
    parameters = tmp_path / "gps.parm"
    parameters.write_text("GPS1_TYPE 14\n")
    options = ("--params", str(parameters))
    with (
        running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=SPEEDUP, options=options),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
    ):
        station = Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path)
        try:
            station.sees("online system")
            station.type("module load GPSInput")
            station.types_until(f"GPSInput.port {fixes}", f"UDP://127.0.0.1:{fixes}", 2.0)
            deadline_s = time.monotonic() + WALL_DEADLINE_S
            ready = False
            while not ready:
                assert time.monotonic() < deadline_s, station.lines
                receiver.sendto(json.dumps(FIX).encode(), ("127.0.0.1", fixes))
                with contextlib.suppress(AssertionError):
                    station.sees("EKF3 IMU0 is using GPS", 0.2 / SPEEDUP)
                    ready = True
            assert "11" in station.types_until("status GPS_RAW_INT", "satellites_visible : 11", 2.0)
        finally:
            station.process.kill()
            station.process.wait()
