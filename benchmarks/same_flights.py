"""SHA-256 of flights and replays, to prove that a change of the code's structure changes no byte of them.

    python -m benchmarks.same_flights before.json [--only NAME ...] [--logs FOLDER] [--jobs 2]
    python -m benchmarks.same_flights after.json --compare before.json

The first command runs before the change, the second after it, with exit code 1 if a hash differs. The flights
touch every mission, both flavours, both ways to fly a pattern, teams, wind, turbulence, injected failures,
cameras, and the orbit with the attitude filter. The file contains the hash of the `flight.tlog` of each
flight, and of the `estimates.npz` of the replay of each log in the folder. A run whose hash is already in the
file is not repeated. Only the command line is used, so every revision can be measured.

As a mission (`flightstack fly benchmarks/same_flights.py`), this file is a short flight with sensor failures.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from missions.base.options import FlightOptions
    from missions.vehicle.vehicle import Vehicle

PLAN: Final = "camera.waypoints"
_ITEMS: Final = (  # command, parameters 1 to 4, north and east of home in degrees, altitude
    (22, (0, 0, 0, 0), (0.0, 0.0), 20),  # NAV_TAKEOFF
    (16, (0, 0, 0, 0), (0.0005, 0.0), 20),  # NAV_WAYPOINT
    (2000, (0, 1, 3, 0), (0.0, 0.0), 0),  # IMAGE_START_CAPTURE
    (178, (1, 3, -1, 0), (0.0, 0.0), 0),  # DO_CHANGE_SPEED
    (16, (2, 0, 0, 0), (0.0005, 0.0006), 25),
    (93, (3, -1, -1, -1), (0.0, 0.0), 0),  # NAV_DELAY
    (16, (0, 0, 0, 0), (0.0, 0.0006), 20),
    (20, (0, 0, 0, 0), (0.0, 0.0), 0),  # NAV_RETURN_TO_LAUNCH
)
HOME: Final = (47.397742, 8.545594)

FLIGHTS: Final[dict[str, str]] = {
    "lissajous-px4": "lissajous",
    "lissajous-ardupilot": "lissajous --autopilot ardupilot --pattern L2 --wind 6@240 --turbulence light",
    "setpoints-px4": "lissajous --via setpoints --wind 4@200 --gps standalone",
    "setpoints-ardupilot": "lissajous --via setpoints --wind 4@200 --autopilot ardupilot --ratio 3:4",
    "wing-waypoints-px4": "lissajous --model aerosonde --via waypoints --wind 5@30 --turbulence light",
    "wing-waypoints-ardupilot": "lissajous --model aerosonde --via waypoints --autopilot ardupilot",
    "wing-setpoints-px4": "lissajous --model aerosonde --wind 5@270",
    "wing-setpoints-ardupilot": "lissajous --model aerosonde --autopilot ardupilot --launch hand",
    "team-estimators": "lissajous --vehicles 3 --estimator lissajous",
    "sector-px4": "sector --turbulence moderate --wind 3",
    "parallel-sweep-ardupilot": "parallel-sweep --autopilot ardupilot",
    "expanding-square-wing": "expanding-square --model aerosonde --turbulence moderate --wind 6@90",
    "j3cub-runway": "sector --model j3cub --altitude 100",
    "c172x-ardupilot": "sector --model c172x --autopilot ardupilot --altitude 120",
    "orbit-px4": "orbit --duration 120 --seed 1",
    "orbit-ardupilot-filter": "orbit --duration 120 --autopilot ardupilot --attitude filter --seed 2",
    "orbit-team-fusion": "orbit --duration 120 --vehicles 2 --estimator target-fusion --target-motion circle "
    "--target-speed 2 --seed 3",
    "occupancy-wings": "occupancy --vehicles 3 --seed 1 --search-time 300",
    "occupancy-quads-ardupilot": "occupancy --model iris --size 800 --cell 100 --autopilot ardupilot "
    "--search-time 200 --seed 2",
    "plan-px4": f"{PLAN} --home {HOME[0]},{HOME[1]},488",
    "plan-ardupilot": f"{PLAN} --home {HOME[0]},{HOME[1]},488 --autopilot ardupilot",
    "own-mission": "examples/own_mission.py --altitude 15 --arg radius_m=30 "
    "--estimator examples/own_estimator.py",
    "failures-px4": "benchmarks/same_flights.py --wind 3 --estimator attitude",
    "failures-ardupilot": "benchmarks/same_flights.py --autopilot ardupilot --turbulence light",
}
FAILURES: Final = ((2, 1), (4, 4), (3, 2), (6, 4))
"""FAILURE_UNIT and FAILURE_TYPE: magnetometer off, GPS noisy, barometer stuck, rangefinder absent."""


async def fly(vehicle: "Vehicle", options: "FlightOptions") -> None:
    """A short flight in which one sensor after another fails."""
    if vehicle.autopilot == "px4":
        await vehicle.set_parameter("SYS_FAILURE_EN", 1)
    await vehicle.arm()
    await vehicle.takeoff(options.altitude_m)
    for leg, (unit, failure) in enumerate(FAILURES):
        await vehicle.try_command(420, float(unit), float(failure), 0.0)
        if vehicle.autopilot == "ardupilot" and unit == FAILURES[0][0]:
            await vehicle.set_parameter("SIM_MAG1_FAIL", 1)
        await vehicle.goto_ned(20.0 if leg % 2 else 0.0, 10.0 * leg, -options.altitude_m)
        await vehicle.try_command(420, float(unit), 0.0, 0.0)
    await vehicle.land()


def write_plan(folder: Path) -> None:
    """Write `PLAN`, a plan with pictures, into a folder."""
    rows = [(16, (0, 0, 0, 0), (0.0, 0.0), 488), *_ITEMS]
    lines = ["QGC WPL 110"]
    for number, (command, params, (north, east), altitude_m) in enumerate(rows):
        lat, lon = (HOME[0] + north, HOME[1] + east) if command in {16, 22} else (0.0, 0.0)
        values = (*params, f"{lat:.7f}", f"{lon:.7f}", altitude_m)
        frame = 3 if number and command in {16, 22} else 0 if not number else 2
        lines.append("\t".join(map(str, (number, int(number == 0), frame, command, *values, 1))))
    (folder / PLAN).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _hash_of(command: list[str], result: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "missions", *command], check=False, capture_output=True, text=True
    )
    sys.stderr.write(f"{' '.join(command)}: exit code {done.returncode}\n")
    if not result.exists():
        return f"none: {(done.stderr.strip() or '?').splitlines()[-1]}"
    return hashlib.sha256(result.read_bytes()).hexdigest()


def _measured(name: str, logs: dict[str, Path]) -> str:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if name in logs:
            out = folder / "replay"
            command = [
                "replay",
                str(logs[name]),
                "--estimator",
                "attitude",
                "--no-picture",
                "--out",
                str(out),
            ]
            return _hash_of(command, out / "estimates.npz")
        write_plan(folder)
        mission, *options = FLIGHTS[name].split()
        if mission == PLAN:
            mission = str(folder / PLAN)
        out = folder / "run"
        return _hash_of(["fly", mission, *options, "--no-picture", "--out", str(out)], out / "flight.tlog")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--compare", type=Path)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--logs", type=Path, default=Path("../shared/tlogs"))
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    hashes: dict[str, str] = json.loads(args.file.read_text()) if args.file.exists() else {}
    logs = {f"replay-{log.stem}": log for log in sorted(args.logs.glob("*.tlog"))}
    names = [name for name in args.only or (*FLIGHTS, *logs) if name not in hashes]
    with ThreadPoolExecutor(args.jobs) as pool:
        for name, value in zip(names, pool.map(lambda name: _measured(name, logs), names), strict=True):
            hashes[name] = value
            args.file.write_text(json.dumps(hashes, indent=1) + "\n")
    for name, value in hashes.items():
        sys.stdout.write(f"{name:28} {value}\n")
    if args.compare is None:
        return 0
    before = json.loads(args.compare.read_text())
    different = [name for name in hashes if hashes[name] != before.get(name)]
    same = len(hashes) - len(different)
    sys.stdout.write(f"{same} of {len(hashes)} are the same; different: {', '.join(different) or 'none'}\n")
    return int(bool(different))


if __name__ == "__main__":
    sys.exit(main())
