"""Searches by camera on real firmware.

    python -m benchmarks.firmware_payload --out FOLDER [--px4 BUILD] [--arducopter FILE]
        [--firmware px4] [--mission vision-search] [--seed 1]

The simulators of PX4 and ArduPilot have no camera. Here a process stands between a firmware and the
mission, as a companion computer does on a vehicle. It passes all messages on, follows the true state of the
simulated vehicle (HIL_STATE_QUATERNION of PX4's SIH, SIM_STATE of ArduPilot's SITL), carries the payload of
`flightstack fly` along with it, and sends what its devices measure: pictures are rendered from there, and the
detector reads them. The mission is `flightstack fly --connect` as a user flies it, in real time; it has the
firmware's messages and the devices', and not the true state.

Each mission is flown twice in one session of a firmware's process. Prints a line for each flight. FOLDER gets
the run folders. Exit code 1: a mission failed, or its target is farther from the true place than the bound.
"""

import argparse
import itertools
import json
import math
import select
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from autopilot_bridge.links import Link, open_link
from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.payload import PayloadStation
from benchmarks.firmware import FIRMWARES, Firmware, FirmwareMissing
from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.vectors import between
from flightsim.home import Home
from flightsim.payload import GroundTargets, Payload
from flightsim.world_spec import WorldSpec
from missions.cli.fly import flight_of, fly

VEHICLE: Final = "copter"
FLIGHTS: Final = 2
"""In one session of a firmware's process."""
RATE_HZ: Final = 50
STEP_US: Final = 1_000_000 // RATE_HZ
COMPANION: Final = (1, 195)
"""System and component id under which the true state is requested."""
_PORT: Final = 14800
_BOOT_S: Final = 90.0
_FLIGHT_S: Final = 1200.0
_ASK_S: Final = 2.0
_TRUE_STATES: Final = (dialect.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, dialect.MAVLINK_MSG_ID_SIM_STATE)
_FOLLOWED: Final = (*_TRUE_STATES, dialect.MAVLINK_MSG_ID_ATTITUDE)
_NEWEST: Final = 10  # messages: a simulator on a busy machine falls behind real time


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A mission with a payload.

    Attributes:
        arguments: of `flightstack fly`.
        bound_m: of the distance between the target that the mission names and the true one.
        world: more arguments, for the world around the vehicle.
    """

    arguments: tuple[str, ...]
    bound_m: float
    world: tuple[str, ...] = ()


CASES: Final[Mapping[str, Case]] = MappingProxyType(
    {
        "parallel-sweep": Case(
            arguments=("parallel-sweep", "--search", "--size", "40", "--search-time", "240"),
            bound_m=3.0,
            world=("--target-speed", "0"),
        ),
        "vision-search": Case(
            arguments=("vision-search", "--area", "-60,-60,60,60", "--altitude", "30"), bound_m=3.0
        ),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """The true state of the vehicle at a time since its boot."""

    time_us: int
    lat_deg: float
    lon_deg: float
    alt_m: float
    vel_ned_m_s: tuple[float, float, float]
    q_ned_from_frd: tuple[float, float, float, float]
    rates_frd_rad_s: tuple[float, float, float]


class VehicleTime:
    """Time since the boot of a vehicle, by its messages: of the newest ones the least delayed counts.

    Neither simulator's true state has a time: SIM_STATE has no field for it, and PX4's SIH sends 0.
    """

    def __init__(self) -> None:
        self._offsets_us: deque[int] = deque(maxlen=_NEWEST)

    def take(self, time_us: int) -> None:
        """Take the time of a message that has arrived now."""
        self._offsets_us.append(time_us - time.monotonic_ns() // 1000)

    @property
    def now_us(self) -> int | None:
        """None: no message was received."""
        return time.monotonic_ns() // 1000 + max(self._offsets_us) if self._offsets_us else None


def state_of(frame: Frame, clock: VehicleTime) -> State | None:
    """The true state in a frame; None: there is none in it."""
    if frame.message_id not in _FOLLOWED:
        return None
    message = decode(frame)
    name = message.get_type()
    if name == "ATTITUDE":
        clock.take(message.time_boot_ms * 1000)
        return None
    time_us = clock.now_us
    if time_us is None:
        return None
    if name == "HIL_STATE_QUATERNION":
        w, x, y, z = message.attitude_quaternion
        return State(
            time_us=time_us,
            lat_deg=message.lat * 1e-7,
            lon_deg=message.lon * 1e-7,
            alt_m=message.alt * 1e-3,
            vel_ned_m_s=(message.vx * 0.01, message.vy * 0.01, message.vz * 0.01),
            q_ned_from_frd=(w, x, y, z),
            rates_frd_rad_s=(message.rollspeed, message.pitchspeed, message.yawspeed),
        )
    return State(
        time_us=time_us,
        lat_deg=message.lat_int * 1e-7,
        lon_deg=message.lon_int * 1e-7,
        alt_m=message.alt,
        vel_ned_m_s=(message.vn, message.ve, message.vd),
        q_ned_from_frd=(message.q1, message.q2, message.q3, message.q4),
        rates_frd_rad_s=(message.xgyro, message.ygyro, message.zgyro),
    )


class CarriedPayload:
    """The devices of a world's first vehicle, carried along with a vehicle of another simulator.

    Args:
        world: what there is around it; its home is where the vehicle stands.
        send: sends the frames of the devices' components.

    Attributes:
        world: as passed to the constructor.
    """

    def __init__(self, world: WorldSpec, send: Any) -> None:
        self.world = world
        self._truth = np.zeros(t.TRUTH_SIZE)
        streams = RandomStreams(world.seed)
        payload = Payload(
            world.vehicles[0].payload,
            truth=self._truth,
            home=world.place,
            physics_rate_hz=RATE_HZ,
            seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
            targets=GroundTargets(world.targets, seeds=lambda index: streams.child("target", index)),
        )
        self.station = PayloadStation(payload, system_id=world.vehicles[0].system_id, send=send)
        self._before: State | None = None
        self._due_us = 0

    def follow(self, state: State) -> None:
        """Step the devices up to a newer state, between which and the one before they move evenly."""
        before, self._before = self._before, state
        if before is None or not before.time_us < state.time_us < before.time_us + 1_000_000:
            self._due_us = -(-state.time_us // STEP_US) * STEP_US
            return
        while self._due_us <= state.time_us:
            share = (self._due_us - before.time_us) / (state.time_us - before.time_us)
            self._write(before, state, max(0.0, share))
            self.station.step(self._due_us)
            self._due_us += STEP_US

    def _write(self, a: State, b: State, share: float) -> None:
        truth = self._truth
        truth[t.LAT_RAD] = math.radians(a.lat_deg + share * (b.lat_deg - a.lat_deg))
        truth[t.LON_RAD] = math.radians(a.lon_deg + share * (b.lon_deg - a.lon_deg))
        truth[t.ALT_M] = a.alt_m + share * (b.alt_m - a.alt_m)
        truth[t.HEIGHT_ABOVE_GROUND_M] = truth[t.ALT_M] - self.world.place.alt_m
        truth[t.VEL_NED_M_S] = np.add(a.vel_ned_m_s, share * np.subtract(b.vel_ned_m_s, a.vel_ned_m_s))
        truth[t.Q_NED_FROM_FRD] = between(a.q_ned_from_frd, b.q_ned_from_frd, share)
        truth[t.RATES_FRD_RAD_S] = b.rates_frd_rad_s


class Companion:
    """Stands between a firmware and a mission, and carries the payload.

    Args:
        vehicle, mission: the links to both.
        world_at: the world whose home is a place.
    """

    def __init__(self, vehicle: Link, mission: Link, world_at: Any) -> None:
        self._vehicle, self._mission = vehicle, mission
        self._world_at = world_at
        self._parser = FrameParser()
        self._encoder = FrameEncoder(*COMPANION)
        self._clock = VehicleTime()
        self._asked_s = 0.0
        self.carried: CarriedPayload | None = None
        self.ready = threading.Event()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.failure = ""

    def start(self) -> None:
        """Begin, in a thread."""
        self._thread.start()

    def stop(self) -> None:
        """End, and close the links."""
        self._ending.set()
        self._thread.join()
        self._vehicle.close()
        self._mission.close()

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                select.select([*self._vehicle.filenos(), *self._mission.filenos()], [], [], 0.05)
                self._pass_on()
        except Exception as error:  # noqa: BLE001  # a thread's error has no other way out
            self.failure = f"{type(error).__name__}: {error}"
            self.ready.set()

    def _pass_on(self) -> None:
        for _, data in self._mission.receive():
            self._vehicle.send(data)
            if self.carried is not None:
                self.carried.station.receive(data)
        for _, data in self._vehicle.receive():
            self._mission.send(data)
            for frame in self._parser.feed(data):
                state = state_of(frame, self._clock)
                if state is not None:
                    self._follow(state)
        now_s = time.monotonic()
        if self.carried is None and now_s - self._asked_s > _ASK_S and self._vehicle.peers:
            self._asked_s = now_s
            for number in _FOLLOWED:
                ask = dialect.MAVLink_command_long_message(
                    1, 1, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, number, STEP_US, 0, 0, 0, 0, 0
                )
                self._vehicle.send(self._encoder.encode(ask))

    def _follow(self, state: State) -> None:
        if self.carried is None:
            home = Home(lat_deg=state.lat_deg, lon_deg=state.lon_deg, alt_m=state.alt_m)
            self.carried = CarriedPayload(self._world_at(home), self._mission.send)
            self.ready.set()
        self.carried.follow(state)


def world_of(arguments: list[str], home: Home, seed: int) -> WorldSpec:
    """The world that `flightstack fly` would make for these arguments."""
    place = f"{home.lat_deg:.7f},{home.lon_deg:.7f},{home.alt_m:.3f}"
    with fly.make_context("fly", [*arguments, "--home", place, "--seed", str(seed)]) as context:
        _, request = flight_of(context)
    assert request.world is not None
    return request.world


def named_place(summary: Mapping[str, Any]) -> tuple[float, float] | None:
    """North and east of home of the target that a mission has named; None: it named none."""
    found = summary.get("search", summary)
    return None if found.get("north_m") is None else (found["north_m"], found["east_m"])


def true_place(world: WorldSpec) -> tuple[float, float]:
    """North and east of home of the target of a world, which does not move."""
    motion: Any = world.targets[0].motion
    return motion.north_m, motion.east_m


def fly_session(build: Firmware, name: str, folder: Path, seed: int) -> Iterator[tuple[bool, str]]:
    """Flights in one session of a firmware's process; whether each went well, and a line about it."""
    case = CASES[name]
    folder.mkdir(parents=True)
    with build.running(folder / "firmware"):
        companion = Companion(
            open_link(build.address(0)),
            open_link(f"udpout:127.0.0.1:{_PORT}"),
            lambda home: world_of([*case.arguments, *case.world], home, seed),
        )
        companion.start()
        try:
            if not companion.ready.wait(_BOOT_S) or companion.carried is None:
                yield False, companion.failure or f"no true state was received in {_BOOT_S:g} s"
                return
            place = true_place(companion.carried.world)
            for flight in range(1, FLIGHTS + 1):
                result = fly_once(case, folder / f"run{flight}", place)
                yield (False, companion.failure) if companion.failure else result
        finally:
            companion.stop()


def fly_once(case: Case, run: Path, true_ne_m: tuple[float, float]) -> tuple[bool, str]:
    """One flight; whether it went well, and a line about it."""
    command = [sys.executable, "-m", "missions", "fly", *case.arguments, "--yes"]
    command += ["--connect", f"udpin:127.0.0.1:{_PORT}", "--out", str(run)]
    said = run.with_suffix(".txt")
    with said.open("wb") as output:
        code = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, timeout=_FLIGHT_S
        ).returncode
    summary_file = run / "summary.json"
    if not summary_file.exists():
        return False, f"exit code {code}; see {said}"
    summary = json.loads(summary_file.read_text(encoding="utf-8"))
    place = named_place(summary)
    if code or place is None:
        return False, f"{summary['outcome']}: {summary['reason'] or 'no target was named'}"
    error_m = math.dist(place, true_ne_m)
    return error_m <= case.bound_m, f"{summary['outcome']}, target {error_m:.2f} m from its true place"


def main() -> int:
    """Fly what was chosen; returns the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs; it must not exist")
    parser.add_argument("--px4", type=Path, help="PX4's build folder, with bin/px4")
    parser.add_argument("--arducopter", type=Path, help="ArduPilot's arducopter, in its source tree")
    parser.add_argument("--firmware", action="append", choices=FIRMWARES, help="repeat; default: both")
    parser.add_argument("--mission", action="append", choices=tuple(CASES), help="repeat; default: all")
    parser.add_argument("--seed", type=int, default=1, help="of the target's place and the devices' noise")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True)
    given = {"px4": chosen.px4, "ardupilot": chosen.arducopter}
    well = True
    for firmware, name in itertools.product(chosen.firmware or FIRMWARES, chosen.mission or tuple(CASES)):
        try:
            build = Firmware.find(firmware, VEHICLE, given[firmware])
        except FirmwareMissing as missing:
            sys.stderr.write(f"left out: {missing}\n")
            continue
        flights = fly_session(build, name, chosen.out / f"{firmware}-{name}", chosen.seed)
        for number, (flown, text) in enumerate(flights, 1):
            well = well and flown
            mark = "" if flown else "NOT AS EXPECTED "
            sys.stdout.write(f"{firmware} {name} flight {number}: {mark}{text}\n")
            sys.stdout.flush()
    return int(not well)


if __name__ == "__main__":
    sys.exit(main())
