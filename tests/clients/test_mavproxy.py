"""MAVProxy, headless, as a ground station of the ardupilot flavour: its everyday commands."""

import contextlib
import shutil
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

WALL_DEADLINE_S = 25.0
HOME_DEG = (-35.3632621, 149.1652374)


class Mavproxy:
    """A MAVProxy process that is typed into."""

    def __init__(self, master: str, folder: Path) -> None:
        program = shutil.which("mavproxy.py", path=str(Path(sys.executable).parent)) or "mavproxy.py"
        command = [program, "--master", master, "--streamrate", "10"]
        self.process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
        )
        self.lines: list[str] = []
        self._seen = 0
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")

    def sees(self, text: str, wait_s: float = WALL_DEADLINE_S) -> None:
        """Wait for a line that comes after those seen before."""
        deadline_s = time.monotonic() + wait_s
        while time.monotonic() < deadline_s:
            for index in range(self._seen, len(self.lines)):
                if text in self.lines[index]:
                    self._seen = index + 1
                    return
            time.sleep(0.02)
        raise AssertionError(f"no {text!r} after {self.lines[: self._seen][-1:]} in {self.lines}")

    def types_until(self, line: str, text: str, wait_s: float = 0.3) -> None:
        """Type the same again and again, until there is such a line."""
        deadline_s = time.monotonic() + WALL_DEADLINE_S
        while time.monotonic() < deadline_s:
            self.type(line)
            with contextlib.suppress(AssertionError):
                return self.sees(text, wait_s)
        raise AssertionError(f"no {text!r} whatever was typed: {self.lines}")


def waypoints(folder: Path) -> Path:
    lat, lon = HOME_DEG
    rows = [(0, 0, 16, lat, lon, 584.0), (1, 3, 22, lat, lon, 10.0), (2, 3, 16, lat + 2e-4, lon, 10.0)]
    lines = [f"{i}\t{int(i == 0)}\t{f}\t{c}\t0\t0\t0\t0\t{x}\t{y}\t{z}\t1" for i, f, c, x, y, z in rows]
    path = folder / "plan.txt"
    path.write_text("\n".join(["QGC WPL 110", *lines]) + "\n")
    return path


def test_everyday_commands(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_STREAM)
    with running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"]):
        station = Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path)
        try:
            station.sees("Saved ")  # the parameters, at once: FTP is refused, not left to time out
            station.type("param set WPNAV_SPEED 800")
            station.types_until("param fetch WPNAV_SPEED", "WPNAV_SPEED = 800")
            station.type(f"wp load {waypoints(tmp_path)}")
            station.sees("Flight plan received")
            station.type("mode guided")
            station.sees("Mode GUIDED")
            station.types_until("arm throttle", "ARM_DISARM: ACCEPTED")  # refused until there is a position
            station.type("takeoff 10")
            station.sees("NAV_TAKEOFF: ACCEPTED")
            station.sees("height ")  # AUTO waits for its start while the vehicle stands
            station.type("mode auto")
            station.sees("DO_SET_MODE: ACCEPTED")
            station.sees("Reached command #2")
            station.type("rtl")
            station.sees("DISARMED")
        finally:
            station.process.kill()
            station.process.wait()
