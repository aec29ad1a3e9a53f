"""A team of vehicles in real time for a long time, each with three clients that listen all the while.

    python -m benchmarks.soak [--minutes 30] [--vehicles 8] [--port 25100]

The vehicles (of both flavours, every fourth an aircraft) run in a process of their own, as `flightstack sitl`
runs them; the clients, in this one, are an onboard computer that flies its vehicle by setpoints, a ground
station on UDP and one on TCP, which asks for its own rates. What is required: memory of the vehicles' process
grows by no more than 5 % after the warm-up, no heartbeat is missed (at most 1.5 s between two), no stream
comes at less than 95 % of its rate, and vehicle time keeps up with the wall clock within 1 %. Exit code 1:
something of this was missed.
"""

import argparse
import asyncio
import itertools
import json
import math
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Final

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from autopilot_bridge.clock import TelemetryClock
from autopilot_bridge.links import open_link, parse_address
from autopilot_bridge.mavlink import Packet, definition, dialect
from missions.errors import MissionError
from missions.vehicle.connection import Connection
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.vehicle import Vehicle
from tests.fuzz.campaign import resident_bytes
from tests.telemetry.test_default_streams import (
    ARDUPILOT_AT_4_HZ,
    NOT_ON_OUR_VEHICLE,
    PX4_GCS_HZ,
    PX4_ONBOARD_HZ,
)

FLAVOURS: Final = ("px4", "ardupilot")
HEARTBEAT: Final = definition("HEARTBEAT").message_id
ATTITUDE: Final = definition("ATTITUDE").message_id
GAP_S: Final = 1.5
RATE_SHARE: Final = 0.95
GROWTH: Final = 0.05
PACE: Final = 0.01
SETTLE_S: Final = 60.0
"""Until every stream runs and everybody flies."""
ASKED_HZ: Final = {"ATTITUDE": 20.0, "LOCAL_POSITION_NED": 10.0, "SYS_STATUS": 2.0, "VFR_HUD": 5.0}
"""What the client on TCP asks for by SET_MESSAGE_INTERVAL."""
AT_4_HZ: Final = {name: 4.0 for name in ARDUPILOT_AT_4_HZ - NOT_ON_OUR_VEHICLE}


def kind_of(index: int) -> tuple[str, str]:
    """Flavour and model of a vehicle."""
    return FLAVOURS[index % 2], "aerosonde" if index % 4 == 3 else "iris"


# the vehicles' process


def serve(vehicles: int, port: int) -> None:
    """Run the vehicles until a signal stops them; a line of JSON each second reports pace and memory."""
    from autopilot_bridge.firmware.simulator import Port
    from autopilot_bridge.sitl import PaceReport, Sitl, SitlServer, compile_flight_code
    from flightsim.world_spec import VehicleSpec, WorldSpec

    specifications = tuple(
        VehicleSpec(
            system_id=k + 1, autopilot=kind_of(k)[0], model=kind_of(k)[1], offset_ne_m=(0.0, 40.0 * k)
        )
        for k in range(vehicles)
    )
    compile_flight_code(specifications)
    sitl = Sitl(WorldSpec(vehicles=specifications))
    server = SitlServer(sitl, speedup=1.0, monotonic=time.monotonic)
    server.open(
        [
            [Port(parse_address(url), role) for url, role in zip(urls(k, port, True), ROLES, strict=True)]
            for k in range(vehicles)
        ]
    )
    stop = False

    def on_signal(_number: int, _frame: object) -> None:
        nonlocal stop
        stop = True

    signal.signal(signal.SIGINT, on_signal)
    signal.signal(signal.SIGTERM, on_signal)

    def report(pace: "PaceReport") -> None:
        reported = {
            "time_s": pace.time_us * 1e-6,
            "slipped_s": pace.slipped_s,
            "memory": resident_bytes(),
            "cpu_s": time.process_time(),
        }
        sys.stdout.write(json.dumps(reported) + "\n")
        sys.stdout.flush()

    server.run(lambda: stop, report=report)
    sitl.close()


ROLES: Final = ("onboard", "gcs", "gcs")


def urls(index: int, port: int, server: bool) -> tuple[str, str, str]:
    """The three links of a vehicle, from its side or the clients'."""
    first = port + 3 * index
    udp, tcp = ("udpin", "tcpin") if server else ("udpout", "tcp")
    host = "127.0.0.1"
    return f"{udp}:{host}:{first}", f"{udp}:{host}:{first + 1}", f"{tcp}:{host}:{first + 2}"


# the clients


@dataclass
class Client:
    """What one client receives of its vehicle; a recorder of its connection."""

    acts: ClassVar = False
    system_id: int
    wanted_hz: dict[str, float]
    counts: Counter[int] = field(default_factory=Counter)
    heartbeats_s: list[float] = field(default_factory=list)
    first_boot_ms: int = 0
    last_boot_ms: int = 0

    def record(self, packet: Packet, _time_us: int) -> None:
        """Take frames of either direction."""
        for frame in packet:
            if (frame.system_id, frame.component_id) != (self.system_id, 1):
                continue
            self.counts[frame.message_id] += 1
            if frame.message_id == HEARTBEAT:
                self.heartbeats_s.append(time.monotonic())
            elif frame.message_id == ATTITUDE:
                self.last_boot_ms = int.from_bytes(frame.payload[:4], "little")
                self.first_boot_ms = self.first_boot_ms or self.last_boot_ms

    def restart(self) -> None:
        """Forget what was received: it counts from now on."""
        self.counts.clear()
        del self.heartbeats_s[:-1]
        self.first_boot_ms = 0

    @property
    def vehicle_s(self) -> float:
        return (self.last_boot_ms - self.first_boot_ms) * 1e-3

    def too_slow(self) -> list[str]:
        """Streams that came at less than their rate; one message may be on its way."""
        found = []
        for name, rate_hz in self.wanted_hz.items():
            count, due = self.counts[definition(name).message_id], rate_hz * self.vehicle_s
            if count < RATE_SHARE * due - 1.0:
                found.append(f"{name} {count / self.vehicle_s:.2f} of {rate_hz:g} Hz")
        return found

    def longest_gap_s(self) -> float:
        return max((b - a for a, b in itertools.pairwise(self.heartbeats_s)), default=math.inf)


def wanted(flavour: str, model: str, role: int) -> dict[str, float]:
    """Rates that a client of a vehicle gets, by its own asking or without."""
    if flavour == "px4":
        rates = dict(PX4_ONBOARD_HZ if role == 0 else PX4_GCS_HZ)
    else:
        rates = dict(AT_4_HZ) | {"HEARTBEAT": 1.0}
    if role == 2:
        rates |= ASKED_HZ
    elif role == 0 and flavour == "ardupilot":  # as missions ask
        rates |= {"GLOBAL_POSITION_INT": 10.0, "LOCAL_POSITION_NED": 20.0, "ATTITUDE": 20.0}
    if model != "iris":  # the tables are a multicopter's; what aircraft lack is left out
        for name in ("ATTITUDE_TARGET", "POSITION_TARGET_LOCAL_NED", "DISTANCE_SENSOR", "RC_CHANNELS"):
            rates.pop(name, None)
        if flavour == "ardupilot":
            rates = {name: rates[name] for name in ("HEARTBEAT", *ASKED_HZ)}
            if role == 0:
                rates["LOCAL_POSITION_NED"] = 10.0
    return rates


async def fly(vehicle: Vehicle, until_s: float) -> str:
    """Fly circles by setpoints (an aircraft: its own) until the end; gives why it ended before."""
    try:
        await vehicle.wait_ready()
        if vehicle.kind.value == "fixed_wing":
            await vehicle.takeoff(60.0)
            await vehicle.hold()
            return ""
        await vehicle.takeoff(10.0)

        def circle(time_s: float) -> Setpoint | None:
            if time.monotonic() > until_s:
                return None
            angle = 0.2 * time_s
            return Setpoint(position_ned_m=(8.0 * math.cos(angle) - 8.0, 8.0 * math.sin(angle), -10.0))

        await vehicle.follow(circle)
    except MissionError as error:
        return str(error)
    return ""


async def ask(connection: Connection, flavour: str, system_id: int, role: int) -> None:
    """Ask for the streams of a client."""
    if flavour == "ardupilot":
        connection.send(dialect.MAVLink_request_data_stream_message(system_id, 1, 0, 4, 1))
    if role == 2:
        for name, rate_hz in ASKED_HZ.items():
            number = float(definition(name).message_id)
            connection.send(
                dialect.MAVLink_command_long_message(
                    system_id, 1, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, number, 1e6 / rate_hz, *(0.0,) * 5
                )
            )
            await asyncio.sleep(0.05)


@dataclass
class Figures:
    """What the vehicles' process reported."""

    wall_s: list[float] = field(default_factory=list)
    time_s: list[float] = field(default_factory=list)
    slipped_s: list[float] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    cpu_s: list[float] = field(default_factory=list)

    def take(self, line: bytes) -> None:
        reported: dict[str, Any] = json.loads(line)
        self.wall_s.append(time.monotonic())
        self.time_s.append(reported["time_s"])
        self.slipped_s.append(reported["slipped_s"])
        self.memory.append(reported["memory"])
        self.cpu_s.append(reported["cpu_s"])

    def restart(self) -> None:
        for values in (self.wall_s, self.time_s, self.slipped_s, self.memory, self.cpu_s):
            del values[:-1]


async def listen(stream: asyncio.StreamReader, figures: Figures) -> None:
    async for line in stream:
        figures.take(line)


async def soak(seconds: float, vehicles: int, port: int) -> list[str]:
    """Run it, print figures, and give what was missed."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "benchmarks.soak", "--serve", "--vehicles", str(vehicles), "--port", str(port),
        stdout=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None
    figures = Figures()
    try:
        figures.take(await asyncio.wait_for(process.stdout.readline(), 180.0))
        reader = asyncio.create_task(listen(process.stdout, figures))
        missed = await run_clients(seconds, vehicles, port, figures)
        reader.cancel()
    finally:
        process.send_signal(signal.SIGINT)
        await process.wait()
    return missed


async def run_clients(seconds: float, vehicles: int, port: int, figures: Figures) -> list[str]:
    clients: list[list[Client]] = []
    connections: list[Connection] = []
    flights: list[asyncio.Task[str]] = []
    end_s = time.monotonic() + SETTLE_S + seconds
    for k in range(vehicles):
        flavour, model = kind_of(k)
        row = []
        for role, url in enumerate(urls(k, port, False)):
            client = Client(k + 1, wanted(flavour, model, role))
            connection = Connection(
                open_link(url), TelemetryClock(), client, identity=(255 - role, 190), vehicle_system_id=k + 1
            )
            connection.start()
            await ask(connection, flavour, k + 1, role)
            if role == 0:
                flights.append(asyncio.create_task(fly(Vehicle(connection, k + 1), end_s)))
            row.append(client)
            connections.append(connection)
        clients.append(row)
    await asyncio.sleep(SETTLE_S)
    for client in (client for row in clients for client in row):
        client.restart()
    figures.restart()
    await asyncio.sleep(seconds)
    missed = report(clients, figures)
    for k, flight in enumerate(flights):
        if flight.done() and flight.result():
            sys.stdout.write(f"vehicle {k + 1} stopped its circles: {flight.result()}\n")
        flight.cancel()
    await asyncio.gather(*flights, return_exceptions=True)
    for connection in connections:
        await connection.close()
    return missed


def report(clients: Sequence[Sequence[Client]], figures: Figures) -> list[str]:
    """Print what was seen; gives what was missed."""
    missed: list[str] = []
    for row in clients:
        for role, client in enumerate(row):
            slow, gap_s = client.too_slow(), client.longest_gap_s()
            total = client.counts.total() / max(client.vehicle_s, 1e-9)
            flavour, model = kind_of(client.system_id - 1)
            who = f"vehicle {client.system_id} {flavour:<9} {model:<9} client {role + 1}"
            sys.stdout.write(
                f"{who}: {total:5.0f} messages/s, {len(client.heartbeats_s) - 1} heartbeats, at most "
                f"{gap_s:.2f} s apart, {len(client.wanted_hz)} rates compared\n"
            )
            missed += [f"{who}: {text}" for text in slow]
            if gap_s > GAP_S:
                missed.append(f"{who}: {gap_s:.2f} s without a heartbeat")
    wall_s = figures.wall_s[-1] - figures.wall_s[0]
    pace = (figures.time_s[-1] - figures.time_s[0]) / wall_s
    grown = max(figures.memory[-5:]) / figures.memory[0] - 1.0
    slipped_s = figures.slipped_s[-1] - figures.slipped_s[0]
    cost = (figures.cpu_s[-1] - figures.cpu_s[0]) / (figures.time_s[-1] - figures.time_s[0])
    sys.stdout.write(
        f"{wall_s:.0f} s: pace {pace:.4f}, {slipped_s:.2f} s given up, {cost:.2f} of one core, "
        f"memory {figures.memory[0] >> 20} MiB {100.0 * grown:+.2f} %\n"
    )
    if abs(pace - 1.0) > PACE:
        missed.append(f"pace {pace:.4f}")
    if grown > GROWTH:
        missed.append(f"memory grew by {100.0 * grown:.1f} %")
    return missed


def main() -> int:
    """Run one side or the other."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="after a minute of warm-up")
    parser.add_argument("--vehicles", type=int, default=8)
    parser.add_argument("--port", type=int, default=25100, help="the first of three for each vehicle")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        serve(arguments.vehicles, arguments.port)
        return 0
    missed = asyncio.run(soak(60.0 * arguments.minutes, arguments.vehicles, arguments.port))
    for text in missed:
        sys.stdout.write(f"MISSED {text}\n")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
