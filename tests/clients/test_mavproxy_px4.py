"""MAVProxy, headless, as a ground station of the px4 flavour: its everyday commands."""

from pathlib import Path

import pytest

from tests.clients.mavproxy_process import UPLOAD_WAIT_S, Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

LAT, LON = 47.39774, 8.54559  # home


def waypoints(folder: Path) -> Path:
    rows = [(3, 22, LAT, LON, 10.0), (3, 16, LAT + 2e-4, LON, 10.0), (3, 16, LAT + 2e-4, LON + 2e-4, 10.0)]
    lines = [
        f"{i}\t{int(i == 0)}\t{f}\t{c}\t0\t0\t0\t0\t{x}\t{y}\t{z}\t1"
        for i, (f, c, x, y, z) in enumerate(rows)
    ]
    path = folder / "plan.txt"
    path.write_text("\n".join(["QGC WPL 110", *lines]) + "\n")
    return path


@pytest.mark.compatibility(
    client="MAVProxy", feature="arm, takeoff, guided, auto, rtl; param, wp", vehicle="px4"
)
def test_everyday_commands(tmp_path: Path) -> None:
    """PX4 knows no GUIDED; it takes off by its mode, as MAVProxy's users do."""
    port = free_port()
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"]):
        station = Mavproxy(f"udpin:127.0.0.1:{port}", tmp_path)
        try:
            station.sees("Saved ")
            station.type("param set MPC_XY_CRUISE 6")
            station.types_until("param fetch MPC_XY_CRUISE", "MPC_XY_CRUISE = 6")
            station.types_until(f"wp load {waypoints(tmp_path)}", "ACCEPTED", UPLOAD_WAIT_S)
            station.types_until("mode TAKEOFF", "Mode TAKEOFF", 2.0)
            station.types_until("arm throttle", "ARMED", 2.0)
            station.sees("height ")
            station.types_until("mode MISSION", "Mode MISSION", 2.0)
            station.types_until("mode LOITER", "Mode LOITER", 2.0)
            station.types_until("mode RTL", "Mode RTL", 2.0)
            station.sees("DISARMED")
        finally:
            station.process.kill()
            station.process.wait()
