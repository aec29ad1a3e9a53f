"""Files and logs over a link that loses, doubles and disorders; clients ask again, as real ones do."""

import random
import struct
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.links import Impairment, LossyLink
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.services.files.ftp_protocol import MAX_DATA, FtpError, Opcode
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.storage import MemoryStore, Mode, Quota
from autopilot_bridge.storage.files import make_directories, read_whole
from autopilot_bridge.storage.memory import MemoryCard
from flightsim.world_spec import VehicleSpec, WorldSpec

HEADER = struct.Struct("<HBBBBBBI")
BAD = Impairment(loss=0.05, duplicate=0.05, reorder=0.05, delay_s=0.05, jitter_s=0.2)
AWFUL = Impairment(loss=0.3, duplicate=0.05, reorder=0.05, delay_s=0.05, jitter_s=0.2)
RETRY_S, TRIES = 0.8, 40


class Station:
    """A ground station on a bad link to a vehicle with a card."""

    def __init__(self, impairment: Impairment, seed: int = 1) -> None:
        self.files = MemoryStore(Quota(size_bytes=10_000_000, files=100))
        parameters = {"SDLOG_MODE": -1.0}
        self.sitl = Sitl(
            WorldSpec(vehicles=(VehicleSpec(parameters=parameters),)), cards=[MemoryCard(files=self.files)]
        )
        self.link = LossyLink(
            self.sitl.connect(0),
            impairment,
            generator=np.random.default_rng(seed),
            time_us=lambda: self.sitl.time_us,
        )
        self.parser, self.encoder = FrameParser(), FrameEncoder(255, 190)
        self.sequence = 0
        self.request: tuple[int, bytes] = (0, b"")

    def run(self, seconds: float) -> list[Any]:
        received: list[Any] = []
        until_us = self.sitl.time_us + round(seconds * 1e6)
        while self.sitl.time_us < until_us:
            self.sitl.advance()
            for _, data in self.link.receive():
                received += [decode(frame) for frame in self.parser.feed(data)]
        return received

    def ask(
        self, opcode: int, data: bytes = b"", *, session: int = 0, offset: int = 0, size: int | None = None
    ) -> tuple[Any, ...]:
        """A request, until its reply has come: (header fields, data)."""
        self.sequence = (self.sequence + 2) & 0xFFFF
        head = HEADER.pack(
            self.sequence, session, opcode, len(data) if size is None else size, 0, 0, 0, offset
        )
        payload = (head + data).ljust(251, b"\0")
        for _ in range(TRIES):
            self.link.send(
                self.encoder.encode(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
            )
            for message in self.run(RETRY_S):
                if message.get_type() == "FILE_TRANSFER_PROTOCOL":
                    reply = bytes(message.payload)
                    fields = HEADER.unpack_from(reply)
                    if fields[0] == (self.sequence + 1) & 0xFFFF and fields[4] == opcode:
                        return (*fields, reply[HEADER.size : HEADER.size + fields[3]])
        raise AssertionError(f"no reply to {Opcode(opcode).name}")


@pytest.mark.parametrize("impairment", [BAD, AWFUL], ids=["5 %", "30 %"])
@pytest.mark.sampled(1)
def test_a_file_goes_there_and_comes_back(impairment: Impairment) -> None:
    station = Station(impairment)
    data = random.Random(3).randbytes(4000)
    assert (
        station.ask(Opcode.CREATE_DIRECTORY, b"/fs/microsd/x")[2] == Opcode.ACK
    )  # once, however often asked
    session = station.ask(Opcode.CREATE_FILE, b"/fs/microsd/x/file")[1]
    for start in range(0, len(data), MAX_DATA):
        piece = data[start : start + MAX_DATA]
        assert station.ask(Opcode.WRITE_FILE, piece, session=session, offset=start)[2] == Opcode.ACK
    assert station.ask(Opcode.TERMINATE_SESSION, session=session)[2] == Opcode.ACK
    assert read_whole(station.files, ("x", "file"), at_most=1 << 30) == data
    session = station.ask(Opcode.OPEN_FILE_RO, b"/fs/microsd/x/file")[1]
    read = bytearray()
    while (reply := station.ask(Opcode.READ_FILE, session=session, offset=len(read), size=MAX_DATA))[
        2
    ] == Opcode.ACK:
        read += reply[-1]
    assert reply[-1] == bytes((FtpError.END_OF_FILE,))
    assert bytes(read) == data
    assert station.ask(Opcode.REMOVE_FILE, b"/fs/microsd/x/file")[2] == Opcode.ACK


def test_a_burst_with_gaps_is_filled() -> None:
    station = Station(BAD)
    data = random.Random(4).randbytes(60_000)
    file = station.files.open(("file",), Mode.NEW)
    file.write(0, data)
    session = station.ask(Opcode.OPEN_FILE_RO, b"/fs/microsd/file")[1]
    got: dict[int, bytes] = {}
    for _ in range(TRIES):
        missing = [start for start in range(0, len(data), MAX_DATA) if start not in got]
        if not missing:
            break
        head = HEADER.pack(station.sequence, session, Opcode.BURST_READ_FILE, MAX_DATA, 0, 0, 0, missing[0])
        station.sequence = (station.sequence + 500) & 0xFFFF
        payload = head.ljust(251, b"\0")
        station.link.send(
            station.encoder.encode(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
        )
        for message in station.run(1.0):
            if message.get_type() == "FILE_TRANSFER_PROTOCOL":
                fields = HEADER.unpack_from(bytes(message.payload))
                if fields[2] == Opcode.ACK and fields[4] == Opcode.BURST_READ_FILE:
                    got[fields[7]] = bytes(message.payload[HEADER.size : HEADER.size + fields[3]])
    assert b"".join(got[start] for start in sorted(got)) == data


def test_a_log_is_downloaded_and_gaps_are_requested() -> None:
    station = Station(BAD)
    data = random.Random(5).randbytes(50_000)
    make_directories(station.files, ("log", "2025-01-01"))
    station.files.open(("log", "2025-01-01", "00_00_00.tlog"), Mode.NEW).write(0, data)
    got: dict[int, bytes] = {}
    ranges = [(0, 0xFFFFFFFF)]
    for _ in range(TRIES):
        for offset, count in ranges[:20]:
            request = mavlink.MAVLink_log_request_data_message(1, 1, 0, offset, count)
            station.link.send(station.encoder.encode(request))
        for message in station.run(2.0):
            if message.get_type() == "LOG_DATA":
                got[message.ofs] = bytes(message.data[: message.count])
        missing = [start for start in range(0, len(data), 90) if start not in got]
        if not missing:
            break
        ranges = [(start, 90) for start in missing]
    assert b"".join(got[start] for start in sorted(got)) == data


@pytest.mark.slow
def test_a_client_that_goes_away_leaves_nothing_open() -> None:
    station = Station(Impairment())
    station.files.open(("file",), Mode.NEW).write(0, bytes(100_000))
    session = station.ask(Opcode.OPEN_FILE_RO, b"/fs/microsd/file")[1]
    head = HEADER.pack(9, session, Opcode.BURST_READ_FILE, MAX_DATA, 0, 0, 0, 0)
    message = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, head.ljust(251, b"\0"))
    station.link.send(station.encoder.encode(message))
    sent = [m for m in station.run(3.0) if m.get_type() == "FILE_TRANSFER_PROTOCOL"]
    assert len(sent) == 100  # one burst, and no more unless it is requested
    station.run(62.0)
    assert station.ask(Opcode.READ_FILE, session=session, size=10)[-1] == bytes((FtpError.INVALID_SESSION,))
