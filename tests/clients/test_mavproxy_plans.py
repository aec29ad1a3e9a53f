"""MAVProxy's fence and rally modules, headless, on the ardupilot flavour."""

import socket
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.clients.mavproxy_process import UPLOAD_WAIT_S, Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

SPEEDUP = 3.0
LAT, LON = -35.3632621, 149.1652374  # home
HALF_DEG = 6e-4
CORNERS = ((-HALF_DEG, -HALF_DEG), (-HALF_DEG, HALF_DEG), (HALF_DEG, HALF_DEG), (HALF_DEG, -HALF_DEG))


def waypoint_file(path: Path, rows: Sequence[tuple[int, int, float, float, float, float]]) -> Path:
    """Rows of (frame, command, param1, latitude, longitude, altitude) as QGC WPL 110."""
    lines = [
        f"{i}\t0\t{frame}\t{command}\t{p1}\t0\t0\t0\t{lat}\t{lon}\t{alt}\t1"
        for i, (frame, command, p1, lat, lon, alt) in enumerate(rows)
    ]
    path.write_text("\n".join(["QGC WPL 110", *lines]) + "\n")
    return path


@pytest.mark.slow
@pytest.mark.compatibility(client="MAVProxy", feature="fence, rally", vehicle="ardupilot")
def test_fence_and_rally_modules(tmp_path: Path) -> None:
    fence = [(3, 5001, 4.0, LAT + north, LON + east, 0.0) for north, east in CORNERS]
    fence_file = waypoint_file(tmp_path / "fence.txt", [*fence, (3, 5004, 8.0, LAT + 3e-4, LON, 0.0)])
    rally_file = waypoint_file(tmp_path / "rally.txt", [(3, 5100, 0.0, LAT + 1e-4, LON + 1e-4, 12.0)])
    port = free_port(socket.SOCK_STREAM)
    with (
        running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=SPEEDUP),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("Saved ")
        station.types_until(f"fence load {fence_file}", "Fence received", UPLOAD_WAIT_S)
        station.type("fence list")
        station.sees("5001 3")
        station.sees("5004 3 -35.3629621")
        station.types_until(f"rally load {rally_file}", "Rally points received", UPLOAD_WAIT_S)
        station.type("rally list")
        station.sees("5100 3 -35.363162")
        station.types_until("param fetch FENCE_TOTAL", "FENCE_TOTAL = 5")
        station.type("fence enable")
        station.sees("fence enabled")  # in SYS_STATUS: else it is not said to be disabled afterwards
        station.type("fence disable")
        station.sees("fence disabled")
        station.type("fence clear")
        station.sees("TYPE_FENCE: ACCEPTED")
        station.types_until("fence list", "Requesting 0 fence items")
        station.type("rally clear")
        station.sees("TYPE_RALLY: ACCEPTED")
