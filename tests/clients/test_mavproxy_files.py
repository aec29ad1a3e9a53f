"""MAVProxy's ftp module, headless: a file goes to the vehicle's card and back."""

import socket
import zlib
from pathlib import Path

import pytest

from tests.clients.mavproxy_process import Mavproxy
from tests.clients.sitl_process import free_port, running_sitl

pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")

SPEEDUP = 2.0
FOLDER = {"px4": "/fs/microsd", "ardupilot": "/APM"}


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.compatibility(
    client="MAVProxy", feature="ftp: mkdir, put, list, crc, get, rename, rm", parameter="flavour"
)
def test_a_file_there_and_back(flavour: str, tmp_path: Path) -> None:
    folder, file, back = f"{FOLDER[flavour]}/station", tmp_path / "notes.bin", tmp_path / "back.bin"
    file.write_bytes(bytes(range(256)) * 20)
    port = free_port(socket.SOCK_STREAM)
    with (
        running_sitl(flavour, [f"tcpin:127.0.0.1:{port}"], speedup=SPEEDUP),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("Saved ")  # the parameters; one transfer at a time
        station.type(f"ftp mkdir {folder}")
        station.types_until(f"ftp list {FOLDER[flavour]}", "D station", 5.0)
        station.type(f"ftp put {file} {folder}/notes.bin")
        station.sees("Sent file of length 5120")
        station.type(f"ftp list {folder}")
        station.sees("notes.bin\t5120")
        station.type(f"ftp crc {folder}/notes.bin")
        station.sees(f"{crc32(file.read_bytes()):08x}")
        station.type(f"ftp get {folder}/notes.bin {back}")
        station.sees("Wrote 5120 bytes")
        assert back.read_bytes() == file.read_bytes()
        station.type(f"ftp rename {folder}/notes.bin {folder}/more.bin")
        station.types_until(f"ftp list {folder}", "more.bin\t5120", 5.0)
        station.type(f"ftp rm {folder}/more.bin")
        station.types_until(f"ftp list {folder}", "Total size 0.00", 5.0)


def crc32(data: bytes) -> int:
    """MAVLink FTP's: no complement before or after."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
