"""How fast the whole SITL runs: simulated seconds per wall second, beside JSBSim alone on the same model.

    python benchmarks/sitl_speed.py [--model iris] [--model aerosonde] [--autopilot px4] [--seconds 120]

One process, warm (everything compiled and flown before the clock starts). A vehicle flies a mission at 250 Hz
physics; its default onboard telemetry goes over a memory link and, with the truth, into a log, as
`flightstack fly` does it. Then the same for several vehicles in one world, and where the time of one vehicle
goes. Every figure is that of the fastest of five pieces, as `timeit` does it: what else the machine does can
only slow a piece.
"""

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Verdict
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.sitl import Sitl, SitlVehicle
from autopilot_bridge.tlog import TlogWriter
from flightsim.airframe import AirframeKind, load_airframe
from flightsim.foundation.geodesy import LocalFrame
from flightsim.world_spec import WorldSpec, team

PHYSICS_RATE_HZ = 250
NO_LANDING_NEEDED = {"MIS_TKO_LAND_REQ": 0.0}  # else PX4 refuses an aircraft this mission without end
PIECES = 5
TEAMS = {AirframeKind.MULTICOPTER: (1, 2, 4, 8), AirframeKind.FIXED_WING: (1, 3)}


def round_trip(vehicle: SitlVehicle) -> tuple[MissionItem, ...]:
    """Takeoff, and a square flown again and again: 60 m a side, or 500 m for an aircraft."""
    home = vehicle.autopilot.commander.home.position
    assert home is not None
    frame = LocalFrame(home)
    wings = vehicle.vehicle.airframe.kind is AirframeKind.FIXED_WING
    side_m, height_m = (500.0, 60.0) if wings else (60.0, 10.0)
    corners = ((side_m, 0.0), (side_m, side_m), (0.0, side_m), (0.0, 0.0))
    places = [frame.geodetic_from_ned(north_m, east_m, 0.0) for north_m, east_m in corners]
    waypoints = [
        MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, x=lat, y=lon, z=height_m, param4=math.nan)
        for lat, lon, _ in places
    ]
    takeoff = MissionItem(command=dialect.MAV_CMD_NAV_TAKEOFF, x=places[0][0], y=places[0][1], z=height_m)
    if vehicle.autopilot.commander.policy.mission_first_item:  # item 0 is home
        waypoints.insert(0, takeoff)
    again = MissionItem(
        command=dialect.MAV_CMD_DO_JUMP, frame=dialect.MAV_FRAME_MISSION, param1=1.0, param2=1000.0
    )
    return (takeoff, *waypoints, again)


def required(verdict: Verdict, what: str) -> None:
    """Raise a RuntimeError with the reasons when the commander refuses a request."""
    if not verdict.accepted:
        reasons = ", ".join(reason.name for reason in verdict.reasons) or verdict.result.name
        raise RuntimeError(f"the autopilot refused {what}: {reasons}")


class Flight:
    """A team in the air with a client on each vehicle, everything logged."""

    def __init__(self, vehicles: int, model: str, flavour: str, log: Path) -> None:
        endless = flavour == "px4" and load_airframe(model).kind is AirframeKind.FIXED_WING
        parameters = NO_LANDING_NEEDED if endless else {}
        self.sitl = Sitl(
            WorldSpec(vehicles=team(vehicles, model=model, autopilot=flavour, parameters=parameters), seed=1)
        )
        self.log = TlogWriter(log)
        self.links = self.sitl.record(self.log)

    def take_off(self) -> None:
        """Store a mission that goes round and round, arm, take off."""
        vehicles = self.sitl.vehicles
        commanders = [vehicle.autopilot.commander for vehicle in vehicles]
        self._wait(lambda: all(commander.home.position for commander in commanders), "a home position")
        for vehicle, commander in zip(vehicles, commanders, strict=True):
            commander.missions.replace(round_trip(vehicle), plan_id=1)
            # ArduCopter can't be armed in AUTO; whether a vehicle can be armed depends on its mode
            armable = FlightMode.MISSION in commander.policy.armable_modes
            required(commander.set_mode(FlightMode.MISSION if armable else FlightMode.GUIDED), "the mode")
        self._wait(lambda: all(commander.armable for commander in commanders), "readiness to arm")
        for commander in commanders:
            required(commander.arm(), "arming")
            required(commander.guidance.start_mission(), "the start of the mission")
        self.run(40.0)
        for vehicle in self.sitl.vehicles:
            mode = vehicle.autopilot.commander.mode
            assert mode is FlightMode.MISSION and vehicle.autopilot.commander.airborne, (
                f"vehicle {vehicle.specification.system_id} is in {mode}"
            )

    def _wait(self, reached: Callable[[], bool], what: str) -> None:
        """Advance until a condition holds; a RuntimeError after two vehicle minutes."""
        for _ in range(120):
            if reached():
                return
            self.run(1.0)
        raise RuntimeError(f"no {what} within 120 s of vehicle time")

    def run(self, seconds: float) -> None:
        """Advance by vehicle seconds."""
        sitl = self.sitl
        end_us = sitl.time_us + round(seconds * 1e6)
        while sitl.time_us < end_us:
            sitl.advance()

    def close(self) -> None:
        """Close links and log."""
        self.sitl.close()
        self.log.close()


def timed(action: Callable[[], object]) -> float:
    """Wall seconds of the fastest of `PIECES` calls."""
    fastest_s = math.inf
    for _ in range(PIECES):
        start_s = time.perf_counter()
        action()
        fastest_s = min(fastest_s, time.perf_counter() - start_s)
    return fastest_s


def repeated(step: Callable[[], object], count: int) -> float:
    """Microseconds per call, of so many calls in all."""
    piece = max(1, count // PIECES)

    def loop() -> None:
        for _ in range(piece):
            step()

    return timed(loop) / piece * 1e6


def jsbsim_alone(model: str, seconds: float) -> float:
    """Simulated seconds per wall second of JSBSim's own `run` on a model."""
    sitl = Sitl(WorldSpec(vehicles=team(1, model=model, autopilot="px4", parameters={})))
    run = sitl.vehicles[0].vehicle._fdm.run  # the bare library call
    return 1e6 / PHYSICS_RATE_HZ / repeated(run, round(seconds * PHYSICS_RATE_HZ))


def where_time_goes(flight: Flight, seconds: float) -> dict[str, float]:
    """Microseconds per physics step of each part, called by itself on the flying vehicle."""
    vehicle = flight.sitl.vehicles[0]
    autopilot = vehicle.autopilot
    count = round(seconds * PHYSICS_RATE_HZ)
    step_us = flight.sitl.step_us
    clock = [flight.sitl.time_us]

    def timed_step(step: Callable[[int], object]) -> Callable[[], None]:
        def advance() -> None:
            clock[0] += step_us
            step(clock[0])

        return advance

    parts = {
        "JSBSim": repeated(vehicle.vehicle._fdm.run, count),
        "vehicle (JSBSim included)": repeated(lambda: vehicle.vehicle.step(autopilot.actuators), count),
        "sensors": repeated(timed_step(vehicle.sensors.step), count),
        "navigation filter": repeated(timed_step(autopilot.navigation.step), count),
        "control laws": repeated(autopilot.controller.step, count),
    }
    return parts


def measure(model: str, flavour: str, seconds: float, folder: Path) -> None:
    """Print the tables of one model."""
    out = sys.stdout.write
    base = jsbsim_alone(model, seconds)
    out(f"{model}, {flavour}; JSBSim alone, one vehicle, {PHYSICS_RATE_HZ} Hz: {base:.0f} sim s / wall s\n")
    piece_s = seconds / PIECES
    out("vehicles  sim s / wall s  vehicle s / wall s  of JSBSim alone  messages/s\n")
    for vehicles in TEAMS[load_airframe(model).kind]:
        flight = Flight(vehicles, model, flavour, folder / f"{Path(model).stem}{vehicles}.tlog")
        flight.take_off()
        before = flight.log.records
        wall_s = timed(partial(flight.run, piece_s))
        speed = piece_s / wall_s
        rate = (flight.log.records - before) / seconds / vehicles
        share = speed * vehicles / base
        out(f"{vehicles:>8} {speed:>15.0f} {speed * vehicles:>19.0f} {share:>16.0%} {rate:>11.0f}\n")
        if vehicles == 1:
            one = flight
            step_us = 1e6 / speed / PHYSICS_RATE_HZ
        else:
            flight.close()
    parts = where_time_goes(one, seconds)
    out(f"one vehicle: {step_us:.1f} us per physics step, of which\n")
    for name, cost_us in parts.items():
        out(f"  {name:<28} {cost_us:5.1f} us\n")
    measured = sum(cost for name, cost in parts.items() if name != "JSBSim")
    out(f"  {'slow loop, MAVLink, log':<28} {step_us - measured:5.1f} us (the rest)\n\n")
    one.close()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", action="append", help="may be given several times; iris and aerosonde")
    parser.add_argument("--autopilot", default="px4", choices=("px4", "ardupilot"))
    parser.add_argument("--seconds", type=float, default=120.0, help="vehicle seconds per measurement")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for model in arguments.model or ("iris", "aerosonde"):
            measure(model, arguments.autopilot, arguments.seconds, Path(folder))


if __name__ == "__main__":
    main()
