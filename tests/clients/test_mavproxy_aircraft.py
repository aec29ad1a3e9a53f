"""MAVProxy as the ground station of an ArduPlane: its everyday commands."""

import math
import socket
from pathlib import Path

import pytest

from tests.clients.mavproxy_process import UPLOAD_WAIT_S, Mavproxy
from tests.clients.runway import Runway
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

SPEEDUP = 3.0  # ArduPilot asks for a plan's item again after a second of its own, which MAVProxy must beat
RUNWAY = Runway(lat_deg=-35.3632621, lon_deg=149.1652374, alt_m=584.0, heading_rad=math.radians(353.0))


def plan(folder: Path) -> Path:
    """The circuit without its landing, as a waypoint file."""
    lines = ["QGC WPL 110"]
    for seq, item in enumerate(RUNWAY.circuit("ardupilot")[:4]):
        assert item.place is not None
        parameters = "\t".join(str(value) for value in (*item.parameters, 0.0, 0.0, 0.0, 0.0)[:4])
        place = "\t".join(str(value) for value in item.place)
        lines.append(f"{seq}\t{int(seq == 0)}\t3\t{item.command}\t{parameters}\t{place}\t1")
    path = folder / "circuit.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.slow
@pytest.mark.compatibility(
    client="MAVProxy", feature="arm, takeoff, guided, auto, rtl; param, wp", vehicle="ardupilot-plane"
)
def test_everyday_commands(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_STREAM)
    options = ["--model", "aerosonde"]
    with (
        running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=SPEEDUP, options=options),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("Saved ")  # the parameters
        station.types_until(f"wp load {plan(tmp_path)}", "Flight plan received", wait_s=UPLOAD_WAIT_S)
        station.type("mode takeoff")
        station.sees("Mode TAKEOFF")
        station.types_until("arm throttle", "ARM_DISARM: ACCEPTED")
        station.sees("height ")  # that it is flying
        station.type("mode auto")
        station.sees("Mode AUTO")
        station.sees("Reached waypoint #2")
        station.type("loiter")
        station.sees("Mode LOITER")
        station.type("rtl")
        station.sees("Mode RTL")
