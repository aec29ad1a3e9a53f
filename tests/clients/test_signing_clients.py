"""Signed sessions with other people's clients, and attackers beside them, over real links."""

import hashlib
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.mavproxy_process import Mavproxy
from tests.clients.mavutil_link import mavutil_link
from tests.clients.sitl_process import free_port, running_sitl

PASSPHRASE = "correct-horse"
SECRET = hashlib.sha256(PASSPHRASE.encode()).digest()
WALL_DEADLINE_S = 100.0


@pytest.fixture(autouse=True)
def mavlink_2(monkeypatch: pytest.MonkeyPatch) -> None:
    """mavutil begins with MAVLink 1 otherwise, which can't be signed."""
    monkeypatch.setenv("MAVLINK20", "1")
    mavutil.set_dialect("all")


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    path = tmp_path / "key"
    path.write_text(PASSPHRASE + "\n")
    return path


class Station:
    """A ground station on mavutil."""

    def __init__(self, url: str, key: bytes | None = None, system_id: int = 255) -> None:
        self.link: Any = mavutil_link(url, source_system=system_id, source_component=190)
        if key is not None:
            self.link.setup_signing(key, sign_outgoing=True)
        self.sent: list[bytes] = []
        self._next_s = 0.0
        write = self.link.write

        def tapped(data: bytes) -> Any:
            self.sent.append(bytes(data))
            return write(data)

        self.link.write = tapped

    def until(self, what: str, found: Any, wait_s: float = WALL_DEADLINE_S) -> Any:
        deadline_s = time.monotonic() + wait_s
        while time.monotonic() < deadline_s:
            if time.monotonic() > self._next_s:
                self._next_s = time.monotonic() + 0.2
                self.link.mav.heartbeat_send(6, 8, 0, 0, 0)
            message = self.link.recv_match(blocking=True, timeout=0.1)
            if message is not None and found(message):
                return message
        raise AssertionError(f"{what} was not seen")

    def accepted(self, number: int, *parameters: float) -> bool:
        values = [*parameters, *(float("nan"),) * (7 - len(parameters))]
        self.link.mav.command_long_send(1, 1, number, 0, *values)
        ack = self.until(
            f"answer to {number}", lambda m: m.get_type() == "COMMAND_ACK" and m.command == number
        )
        return bool(ack.result == 0)

    def take_off(self, flavour: str) -> None:
        if flavour == "ardupilot":
            self.link.mav.request_data_stream_send(1, 1, 0, 10, 1)
            self.until("heartbeat", lambda m: m.get_type() == "HEARTBEAT")
            self.link.mav.set_mode_send(1, 1, 4)
        self.until(
            "readiness",
            lambda m: m.get_type() == "SYS_STATUS" and m.onboard_control_sensors_health & 0x10000000,
        )
        while not self.accepted(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1):
            pass
        take_off = (*(0.0,) * 6, 5.0) if flavour == "ardupilot" else ()
        assert self.accepted(mavlink.MAV_CMD_NAV_TAKEOFF, *take_off)
        self.at_height(1.5)

    def at_height(self, height_m: float) -> None:
        self.until(
            f"height {height_m}",
            lambda m: m.get_type() == "GLOBAL_POSITION_INT" and m.relative_alt > height_m * 1e3,
        )

    @property
    def counters(self) -> Any:
        return self.link.mav.signing


@contextmanager
def attacks(port: int, recorded: list[bytes]) -> Iterator[None]:
    """A client on the same port, without a key, with another, and with what it has recorded."""
    done = threading.Event()

    def attack() -> None:
        mav = mavlink.MAVLink(None, 255, 190)
        other = mavlink.MAVLink(None, 255, 190)
        other.signing.secret_key, other.signing.sign_outgoing = bytes(range(32)), True
        other.signing.timestamp = 1 << 46
        stale = mavlink.MAVLink(None, 255, 190)
        stale.signing.secret_key, stale.signing.sign_outgoing, stale.signing.link_id = SECRET, True, 77
        stale.signing.timestamp = 1000
        wanted = [
            mavlink.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0),
            mavlink.MAVLink_command_long_message(1, 1, 21, 0, *[0.0] * 7),
            mavlink.MAVLink_param_set_message(1, 1, b"MPC_LAND_SPEED", 0.1, 9),
            mavlink.MAVLink_setup_signing_message(1, 1, [0] * 32, 0),
        ]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attacker:
            attacker.connect(("127.0.0.1", port))
            while not done.wait(0.02):
                for sender in (mav, other, stale):
                    for message in wanted:
                        attacker.send(bytes(message.pack(sender)))
                for raw in recorded[:200]:
                    attacker.send(raw)

    attacker = threading.Thread(target=attack)
    attacker.start()
    try:
        yield
    finally:
        done.set()
        attacker.join()


@pytest.mark.parametrize("flavour", ["px4", pytest.param("ardupilot", marks=pytest.mark.slow)])
def test_pymavlink_flies_signed_while_attacked(flavour: str, key_file: Path) -> None:
    port = free_port()
    options = ("--signing-key", str(key_file))
    with running_sitl(flavour, [f"udpin:127.0.0.1:{port}"], speedup=5.0, options=options) as sitl:
        assert any("signatures required" in line for line in sitl.lines)
        station = Station(f"udpout:127.0.0.1:{port}", SECRET)
        station.take_off(flavour)
        with attacks(port, list(station.sent)):
            station.at_height(2.2)
            until_s = time.monotonic() + 2.0
            station.until("two more seconds", lambda m: time.monotonic() > until_s)
            beat = station.until("heartbeat", lambda m: m.get_type() == "HEARTBEAT")
            assert beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            assert station.counters.badsig_count == station.counters.unsigned_count == 0
            assert station.counters.goodsig_count > 100
        station.link.close()


@pytest.mark.slow
def test_mavproxy_flies_signed(tmp_path: Path, key_file: Path) -> None:
    pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")
    port = free_port(socket.SOCK_STREAM)
    options = ("--signing-key", str(key_file))
    with (
        running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=8.0, options=options),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("online system")
        station.types_until(f"signing key {PASSPHRASE}", "Setup signing key")
        station.types_until("mode guided", "Mode GUIDED", 1.0)
        station.take_off(10)


@pytest.mark.slow
def test_mavproxy_brings_the_key(tmp_path: Path) -> None:
    """`signing setup` on loopback; then whoever has another key is refused."""
    pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")
    port, store = free_port(socket.SOCK_STREAM), tmp_path / "store"
    options = ("--signing-store", str(store))
    with (
        running_sitl("ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=8.0, options=options),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("online system")
        station.types_until(f"signing setup {PASSPHRASE}", "Signing key set", 2.0)
        station.types_until("mode guided", "Mode GUIDED", 1.0)
        station.types_until("arm throttle", "ARM_DISARM: ACCEPTED")
    assert SECRET.hex() in store.read_text()
    with running_sitl(
        "ardupilot", [f"tcpin:127.0.0.1:{port}"], speedup=8.0, options=options
    ):  # the key outlives a restart
        stranger = Station(f"tcp:127.0.0.1:{port}", bytes(range(32)))
        stranger.link.mav.signing.allow_unsigned_callback = lambda mav, message_id: True
        stranger.link.mav.command_long_send(1, 1, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, 148, *[0.0] * 6)
        beats = 0
        deadline_s = time.monotonic() + WALL_DEADLINE_S
        while beats < 10:
            assert time.monotonic() < deadline_s
            message = stranger.link.recv_match(blocking=True, timeout=0.2)
            if message is not None:
                assert message.get_type() not in ("COMMAND_ACK", "AUTOPILOT_VERSION")
                beats += message.get_type() == "HEARTBEAT"
        stranger.link.close()


@pytest.mark.slow
def test_our_mission_flies_signed(tmp_path: Path, key_file: Path) -> None:
    port = free_port()
    options = ("--signing-key", str(key_file))
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], speedup=8.0, options=options):
        for key, code, reported in (("another one", 1, "bad signature"), (PASSPHRASE, 0, "completed")):
            arguments = ["fly", "square.py", "--connect", f"udpin:127.0.0.1:{port}"]
            (tmp_path / "square.py").write_text(
                "async def fly(vehicle, options):\n"
                "    await vehicle.arm()\n"
                "    await vehicle.takeoff(5)\n"
                "    await vehicle.return_to_launch()\n"
            )
            (tmp_path / "mission.key").write_text(key)
            arguments += ["--signing-key", "mission.key"]
            done = subprocess.run(
                [sys.executable, "-m", "missions", *arguments],
                cwd=tmp_path,
                env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
                capture_output=True,
                text=True,
                timeout=120.0,
            )
            assert done.returncode == code, done.stderr
            assert reported in done.stdout + done.stderr


@pytest.mark.slow
def test_who_has_no_key_gets_what_may_be_missing(key_file: Path, tmp_path: Path) -> None:
    """Everything is received and nothing answered, and that takes no minutes to be said."""
    port, doctors_port = free_port(), free_port()
    links = [f"udpout:127.0.0.1:{number}" for number in (port, doctors_port)]
    commands = (
        ("fly", "lissajous", "--connect", f"udpin:127.0.0.1:{port}", "--out", str(tmp_path / "run")),
        ("vehicle", "params", "list", "--connect", f"udpin:127.0.0.1:{doctors_port}"),
        ("vehicle", "doctor", "--connect", f"udpin:127.0.0.1:{doctors_port}"),
    )
    with running_sitl("px4", links, speedup=5.0, options=["--signing-key", str(key_file)]):
        for words in commands:
            run = [sys.executable, "-m", "missions", *words]
            done = subprocess.run(run, capture_output=True, text=True, timeout=WALL_DEADLINE_S, check=False)
            said = done.stdout + done.stderr
            assert done.returncode == 1, said
            assert "signs what it says" in said
