"""MAVProxy, headless, as a ground station of the px4 flavour: its everyday commands."""

from pathlib import Path

import pytest

from tests.clients.compatibility import not_offered
from tests.clients.mavproxy_process import UPLOAD_WAIT_S, Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

SPEEDUP = 3.0
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


MODES = {"TAKEOFF": (4, 2), "LOITER": (4, 3), "MISSION": (4, 4), "RTL": (4, 5)}
"""PX4's main and sub mode."""


def changes_mode(station: Mavproxy, name: str) -> None:
    """By DO_SET_MODE with base_mode's MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, until it is seen."""
    main, sub = MODES[name]
    station.types_until(f"long DO_SET_MODE 1 {main} {sub}", f"Mode {name}", 5.0)


@pytest.mark.timeout(900)
@pytest.mark.compatibility(
    client="MAVProxy", feature="arm, takeoff, guided, auto, rtl; param, wp", vehicle="px4"
)
def test_everyday_commands(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """PX4 knows no GUIDED; it takes off by its mode."""
    port = free_port()
    with (
        running_sitl("px4", [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP),
        Mavproxy(f"udpin:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("Saved ")
        station.type("param set MPC_XY_CRUISE 6")
        station.types_until("param fetch MPC_XY_CRUISE", "MPC_XY_CRUISE = 6", 10.0)
        station.types_until(f"wp load {waypoints(tmp_path)}", "TYPE_MISSION: ACCEPTED", UPLOAD_WAIT_S)
        station.type("mode TAKEOFF")
        station.sees("required argument is not a float")  # it sends the names' triples as they are
        changes_mode(station, "TAKEOFF")
        station.types_until("arm throttle", "ARMED", 5.0)
        station.sees("Takeoff detected")
        station.sees("Mode LOITER")  # it holds where the take-off ends
        changes_mode(station, "MISSION")
        changes_mode(station, "LOITER")
        changes_mode(station, "RTL")
        station.sees("DISARMED")
    not_offered(
        request, "no GUIDED; modes by `long DO_SET_MODE`, as MAVProxy 1.8.75 can't send PX4's by `mode`"
    )
