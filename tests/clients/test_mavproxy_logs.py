"""MAVProxy's log module: the log of an armed vehicle is listed, downloaded and erased."""

import socket
from pathlib import Path

import pytest

from autopilot_bridge.mavlink import decode
from autopilot_bridge.tlog import TlogReader
from tests.clients.mavproxy_process import Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

FIRST = {"px4": 0, "ardupilot": 1}


@pytest.mark.slow
@pytest.mark.compatibility(client="MAVProxy", feature="log: list, download, erase", parameter="flavour")
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_log_is_listed_downloaded_and_erased(flavour: str, tmp_path: Path) -> None:
    port = free_port(socket.SOCK_STREAM)
    options = ("--storage", str(tmp_path / "cards"))
    with (
        running_sitl(flavour, [f"tcpin:127.0.0.1:{port}"], speedup=8.0, options=options),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("online system")
        if flavour == "ardupilot":
            station.types_until("mode guided", "Mode GUIDED", 1.0)
        station.types_until("arm throttle", "ARMED", 2.0)
        station.sees("DISARMED")  # by itself, as no takeoff follows
        number = FIRST[flavour]
        listed = station.types_until("log list", f"Log {number}  numLogs", 3.0)
        while True:  # the log goes on for a while after disarming
            before, listed = listed, station.types_until("log list", f"Log {number}  numLogs", 3.0)
            if listed == before:
                break
        station.type(f"log download {number} flight.tlog")
        station.sees("Finished downloading")
        (folder,) = (tmp_path / "cards" / "vehicle1").rglob("*.tlog")
        data = folder.read_bytes()
        assert (tmp_path / "flight.tlog").read_bytes() == data
        armed = [
            decode(frame).base_mode & 128  # type: ignore[attr-defined]
            for _, frame in TlogReader(tmp_path / "flight.tlog")
            if frame.definition.name == "HEARTBEAT"
        ]
        assert 128 in armed and armed[-1] == 0
        station.type("log erase")
        station.types_until("log list", "No logs", 3.0)
        assert not folder.exists()
