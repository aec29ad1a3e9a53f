"""Missions with a camera or a survey magnetometer on real firmware.

    python -m benchmarks.firmware_payload --out FOLDER [--px4 BUILD] [--arducopter FILE] [--arduplane FILE]
        [--firmware px4] [--vehicle copter] [--mission vision-search] [--seed 1]

The simulators of PX4 and ArduPilot have no such devices. Here a process stands between a firmware and the
mission, as a companion computer does on a vehicle. It passes all messages on, follows the true state of the
simulated vehicle (HIL_STATE_QUATERNION of PX4's SIH, SIM_STATE of ArduPilot's SITL), carries the payload of
`flightstack fly` along with it, and sends what its devices measure: pictures are rendered from there, and the
detector reads them; the field is that of a map with targets, and the mission gets the published map, which
has an error. The mission is `flightstack fly --connect` as a user flies it, in real time; it has the
firmware's messages and the devices', and not the true state.

Each mission is flown twice in one session of a firmware's process. Prints a line for each flight. FOLDER gets
the run folders. Both firmwares may fly at once, in two processes. Exit code 1: a mission failed, or a target
is farther from the true place than the bound.
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
from autopilot_bridge.mavlink.wire_units import degrees, metres, velocity_of
from autopilot_bridge.payload import PayloadStation
from benchmarks.firmware import FIRMWARES, VEHICLES, Firmware, FirmwareMissing
from flightsim import truth as t
from flightsim.foundation.magnetics import magnetic_field_ned_gauss
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.vectors import between
from flightsim.home import Home
from flightsim.payload import Carrier, GroundTargets, Payload, magnetic_field_of
from flightsim.payload.magnetic_spec import MagneticSpec
from flightsim.world_spec import WorldSpec
from missions.cli.bodies.fly import flight_of
from missions.cli.fly import fly
from missions.embedded.sitl import publish

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
_ASKED_US: Final = 25_000  # ArduPlane's loop of 50 Hz denies more than 40
_TRUE_STATES: Final = (dialect.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, dialect.MAVLINK_MSG_ID_SIM_STATE)
_FOLLOWED: Final = (*_TRUE_STATES, dialect.MAVLINK_MSG_ID_ATTITUDE)
_NEWEST: Final = 10  # messages: a simulator on a busy machine falls behind real time


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A mission with a payload.

    Attributes:
        arguments: of `flightstack fly`, by vehicle; other vehicles do not fly it.
        bound_m: of the distance between the target that the mission names and the true one.
        world: more arguments, for the world around the vehicle.
        lists_all: the mission lists all targets, and does not name one.
    """

    arguments: Mapping[str, tuple[str, ...]]
    bound_m: float
    world: tuple[str, ...] = ()
    lists_all: bool = False


CASES: Final[Mapping[str, Case]] = MappingProxyType(
    {
        "parallel-sweep": Case(
            arguments={"copter": ("parallel-sweep", "--search", "--size", "40", "--search-time", "240")},
            bound_m=3.0,
            world=("--target-speed", "0"),
        ),
        "vision-search": Case(
            arguments={"copter": ("vision-search", "--area", "-60,-60,60,60", "--altitude", "30")},
            bound_m=3.0,
        ),
        "occupancy": Case(
            arguments={
                "copter": ("occupancy", "--size", "1000", "--altitude", "50", "--identify", "bayes"),
                "plane": ("occupancy", "--size", "1600", "--identify", "bayes"),
            },
            bound_m=60.0,
            world=("--false-anomalies", "2"),
        ),
        "survey": Case(
            arguments={"plane": ("survey", "--size", "600", "--spacing", "100")},
            bound_m=60.0,
            world=("--targets", "2"),
            lists_all=True,
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
    if isinstance(message, dialect.MAVLink_attitude_message):
        clock.take(message.time_boot_ms * 1000)
        return None
    time_us = clock.now_us
    if time_us is None:
        return None
    if isinstance(message, dialect.MAVLink_hil_state_quaternion_message):
        w, x, y, z = message.attitude_quaternion
        return State(
            time_us=time_us,
            lat_deg=degrees(message.lat),
            lon_deg=degrees(message.lon),
            alt_m=metres(message.alt),
            vel_ned_m_s=velocity_of(message),
            q_ned_from_frd=(w, x, y, z),
            rates_frd_rad_s=(message.rollspeed, message.pitchspeed, message.yawspeed),
        )
    if not isinstance(message, dialect.MAVLink_sim_state_message):
        return None
    return State(
        time_us=time_us,
        lat_deg=degrees(message.lat_int),
        lon_deg=degrees(message.lon_int),
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
        published_map: the map of the magnetic field; None: there is none.
    """

    def __init__(self, world: WorldSpec, send: Any) -> None:
        self.world = world
        self._truth = np.zeros(t.TRUTH_SIZE)
        home, field, year = world.place, world.magnetic_field, world.air.decimal_year
        self._truth[t.MAG_NED_GAUSS] = magnetic_field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m, year)
        self.published_map = None
        if isinstance(field, MagneticSpec):
            field, self.published_map = magnetic_field_of(
                field, home=home, seed=world.seed, decimal_year=year
            )
        streams = RandomStreams(world.seed)
        payload = Payload(
            world.vehicles[0].payload,
            Carrier(
                truth=self._truth,
                home=home,
                physics_rate_hz=RATE_HZ,
                seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
                targets=GroundTargets(world.targets, seeds=lambda index: streams.child("target", index)),
                magnetic_field=field,
            ),
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
                    1, 1, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, number, _ASKED_US, 0, 0, 0, 0, 0
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


def named_places(summary: Mapping[str, Any]) -> list[tuple[float, float]]:
    """North and east of home of the targets that a mission names or lists."""
    block = summary.get("search", summary)
    places = [(block.get("north_m"), block.get("east_m"))]
    for other in (summary.get("target_estimate_m") or {}, *summary.get("anomalies", ())):
        places.append((other.get("north"), other.get("east")))
    return [(north, east) for north, east in places if north is not None and east is not None]


def true_places(world: WorldSpec) -> list[tuple[float, float]]:
    """North and east of home of the targets of a world, which do not move. What a mission seeks is first."""
    if world.magnetic_field is not None:
        return list(world.magnetic_targets_ne_m)
    motions: list[Any] = [target.motion for target in world.targets]
    return [(motion.north_m, motion.east_m) for motion in motions]


def fly_session(build: Firmware, name: str, folder: Path, seed: int) -> Iterator[tuple[bool, str]]:
    """Flights in one session of a firmware's process; whether each went well, and a line about it."""
    case = CASES[name]
    arguments = list(case.arguments[build.vehicle])
    model = ["--model", "iris" if build.vehicle == "copter" else "aerosonde"]
    folder.mkdir(parents=True)
    port = _PORT + FIRMWARES.index(build.name)
    with build.running(folder / "firmware"):
        companion = Companion(
            open_link(build.address(0)),
            open_link(f"udpout:127.0.0.1:{port}"),
            lambda home: world_of([*arguments, *case.world, *model], home, seed),
        )
        companion.start()
        try:
            if not companion.ready.wait(_BOOT_S) or companion.carried is None:
                yield False, companion.failure or f"no true state was received in {_BOOT_S:g} s"
                return
            carried = companion.carried
            if carried.published_map is not None:
                publish(carried.published_map, folder / "map.npz")
                arguments += ["--map", str(folder / "map.npz")]
            arguments += ["--yes", "--connect", f"udpin:127.0.0.1:{port}"]
            places = true_places(carried.world)[: None if case.lists_all else 1]
            for flight in range(1, FLIGHTS + 1):
                result = fly_once(arguments, folder / f"run{flight}", places, bound_m=case.bound_m)
                yield (False, companion.failure) if companion.failure else result
        finally:
            companion.stop()


def fly_once(
    arguments: list[str], run: Path, true_ne_m: list[tuple[float, float]], *, bound_m: float
) -> tuple[bool, str]:
    """One flight; whether it went well, and a line about it."""
    command = [sys.executable, "-m", "missions", "fly", *arguments, "--out", str(run)]
    said = run.with_suffix(".txt")
    with said.open("wb") as output:
        code = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, timeout=_FLIGHT_S
        ).returncode
    summary_file = run / "summary.json"
    if not summary_file.exists():
        return False, f"exit code {code}; see {said}"
    summary = json.loads(summary_file.read_text(encoding="utf-8"))
    named = named_places(summary)
    if code or not named:
        return False, f"{summary['outcome']}: {summary['reason'] or 'no target was named'}"
    errors_m = [min(math.dist(place, other) for other in named) for place in true_ne_m]
    what = "target" if len(errors_m) == 1 else f"{len(errors_m)} targets"
    distances = " and ".join(f"{error_m:.2f}" for error_m in errors_m)
    return max(errors_m) <= bound_m, f"{summary['outcome']}, {what} {distances} m from the true place"


def main() -> int:
    """Fly what was chosen; returns the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs; it must not exist")
    parser.add_argument("--px4", type=Path, help="PX4's build folder, with bin/px4")
    parser.add_argument("--arducopter", type=Path, help="ArduPilot's arducopter, in its source tree")
    parser.add_argument("--arduplane", type=Path, help="ArduPilot's arduplane, in its source tree")
    parser.add_argument("--firmware", action="append", choices=FIRMWARES, help="repeat; default: both")
    parser.add_argument("--vehicle", action="append", choices=VEHICLES, help="repeat; default: both")
    parser.add_argument("--mission", action="append", choices=tuple(CASES), help="repeat; default: all")
    parser.add_argument("--seed", type=int, default=1, help="of the target's place and the devices' noise")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True)
    given = {
        ("px4", "copter"): chosen.px4,
        ("px4", "plane"): chosen.px4,
        ("ardupilot", "copter"): chosen.arducopter,
        ("ardupilot", "plane"): chosen.arduplane,
    }
    well = True
    for firmware, vehicle, name in itertools.product(
        chosen.firmware or FIRMWARES, chosen.vehicle or VEHICLES, chosen.mission or tuple(CASES)
    ):
        if vehicle not in CASES[name].arguments:
            continue
        try:
            build = Firmware.find(firmware, vehicle, given[firmware, vehicle])
        except FirmwareMissing as missing:
            sys.stderr.write(f"left out: {missing}\n")
            continue
        flights = fly_session(build, name, chosen.out / f"{firmware}-{vehicle}-{name}", chosen.seed)
        for number, (flown, text) in enumerate(flights, 1):
            well = well and flown
            mark = "" if flown else "NOT AS EXPECTED "
            sys.stdout.write(f"{firmware} {vehicle} {name} flight {number}: {mark}{text}\n")
            sys.stdout.flush()
    return int(not well)


if __name__ == "__main__":
    sys.exit(main())
