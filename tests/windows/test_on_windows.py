"""The commands in processes that have what Windows has: `sitecustomize.py` beside this file.

What this can't show is Windows itself: consoles, its own sockets and serial ports.
"""

import hashlib
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from autopilot_bridge.links import SerialPort, parse_address, serial_line, serial_port
from tests.bridge.test_links import SerialCable, receive
from tests.clients.sitl_process import free_port
from tests.missions.test_cli_bodies import HELP_OF_ALL

DEADLINE_S = 200.0
LIKE_WINDOWS = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join((str(Path(__file__).parent), str(Path(__file__).parents[2]))),
    "PYTHONIOENCODING": "cp437",
}
IMPORT_ALL = """
import importlib, pathlib, sys
for package in ("flightsim", "autopilot_bridge", "estimators", "missions"):
    for path in sorted(pathlib.Path(package).rglob("*.py")):
        name = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        if not name.endswith("__main__") and name != "autopilot_bridge.storage.folder":
            importlib.import_module(name)
"""


def python(*arguments: str, **more: Any) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, *arguments],
        env=LIKE_WINDOWS,
        capture_output=True,
        text=True,
        encoding="cp437",
        timeout=DEADLINE_S,
        **more,
    )


def flightstack(*arguments: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
    return python("-m", "missions", *arguments, cwd=cwd)


def test_help_of_all_commands() -> None:
    done = python("-c", HELP_OF_ALL)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("COM3", "serial:COM3:115200"),
        ("com3,57600", "serial:com3:57600"),
        ("serial:COM3:57600", "serial:COM3:57600"),
        ("serial://COM3:57600", "serial:COM3:57600"),
        (r"\\.\COM12", r"serial:\\.\COM12:115200"),
        (r"\\.\COM12,921600", r"serial:\\.\COM12:921600"),
        (r"serial:\\.\COM12:921600", r"serial:\\.\COM12:921600"),
        (r"C:\logs\a flight.tlog", r"C:\logs\a flight.tlog"),
    ],
)
def test_names_of_ports_and_drives(text: str, canonical: str) -> None:
    address = parse_address(text)
    assert str(address) == canonical
    assert parse_address(str(address)) == address


@pytest.fixture
def cable(monkeypatch: pytest.MonkeyPatch) -> SerialCable:
    monkeypatch.setattr(serial_port, "open_line", serial_line.PolledLine)
    return SerialCable()


def test_a_polled_serial_line_carries_bytes_and_comes_back(cable: SerialCable) -> None:
    now_s = 0.0
    link = serial_port.SerialLink(SerialPort(cable.device, 57600), monotonic=lambda: now_s)
    assert (link.filenos(), link.receive()) == ((), [])
    os.write(cable.far, b"from afar")
    assert receive(link, 9) == {(cable.device, 0): b"from afar"}
    link.send(b"answer")
    assert os.read(cable.far, 100) == b"answer"
    cable.unplug()
    while link.connected:
        link.receive()
    link.send(b"to no device")
    assert link.counters.dropped == 1 and link.counters.disconnects == 1
    now_s = 2.0
    assert link.receive() == [] and link.counters.connects == 1
    link.close()


@pytest.mark.slow
def test_every_module_is_imported() -> None:
    done = python("-c", IMPORT_ALL, cwd=Path(__file__).parents[2])
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_flight_has_the_same_bytes_and_its_log_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "a path with spaces"
    folder.mkdir()
    size = ("--size", "30")
    flown = flightstack("fly", "lissajous", *size, "--out", "here", cwd=folder)
    assert flown.returncode == 0, flown.stderr
    subprocess.run(
        [sys.executable, "-m", "missions", "fly", "lissajous", *size, "--out", "there"],
        cwd=folder,
        check=True,
        timeout=DEADLINE_S,
        capture_output=True,
    )
    digests = {
        hashlib.sha256((folder / name / "flight.tlog").read_bytes()).digest() for name in ("here", "there")
    }
    assert len(digests) == 1
    log = str(Path("here", "flight.tlog"))
    for command in (("log", "info", log), ("replay", log, "--estimator", "attitude", "--no-picture")):
        done = flightstack(*command, cwd=folder)
        assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_study_inline_and_in_spawned_processes(workers: int, tmp_path: Path) -> None:
    done = flightstack(
        *("study", "lissajous-localization", "--runs", "1", "--workers", str(workers), "--no-picture"),
        *("--out", "study"),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "study" / "rows.parquet").exists()


@pytest.mark.slow
def test_a_flight_on_a_link_is_ended_by_ctrl_break(tmp_path: Path) -> None:
    """SIGUSR2 stands for SIGBREAK."""
    link = f"tcp:127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    serving = start("sitl", "--gcs-link", link.replace("tcp", "tcpin"), "--speedup", "5", cwd=tmp_path)
    try:
        wait_for_line(serving, "ready")
        flying = start("fly", "lissajous", "--connect", link, "--out", "run", cwd=tmp_path)
        wait_for_line(flying, "pattern,")
        flying.send_signal(signal.SIGUSR2)
        output, _ = flying.communicate(timeout=DEADLINE_S)
        assert flying.returncode == 128 + signal.SIGUSR2, output
        assert "RETURN" in output or "return" in output
    finally:
        serving.send_signal(signal.SIGUSR2)
        rest, _ = serving.communicate(timeout=DEADLINE_S)
    assert serving.returncode == 0 and "stopped at" in rest


def start(*arguments: str, cwd: Path) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "missions", *arguments],
        cwd=cwd,
        env=LIKE_WINDOWS,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def wait_for_line(process: "subprocess.Popen[str]", part: str) -> None:
    assert process.stdout is not None
    seen = []
    for line in process.stdout:
        seen.append(line)
        if part in line:
            return
    raise AssertionError("".join(seen))
