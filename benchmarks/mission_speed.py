"""How fast missions are beside the SITL alone, and how long they take to begin.

    python -m benchmarks.mission_speed [--rounds 4]

In each round, one after the other: the SITL alone flies a square, with its messages and the truth in a log
(`benchmarks.sitl_speed`); `fly lissajous --seed 2` flies in this process; and the same for two vehicles. The
figure of a mission is `speedup` of its `summary.json`. The fastest of the rounds counts, as `timeit` does it:
what else the machine does can only slow a round. Compiled code is warmed up before, and Python's garbage
collector is set as the command line sets it.

Then `flightstack --help`, and `flightstack fly lissajous` until its first physics step, in processes of their
own, the fastest of as many rounds. Exit code 1 if a figure misses its bound.
"""

import argparse
import gc
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from benchmarks.sitl_speed import Flight
from flightsim import WorldSpec
from missions import FlightOptions, RunRequest, fly
from missions.cli.main import YOUNG_OBJECTS

PIECE_S: Final = 260.0  # as long as the flight
SEED: Final = 2
LEAST_SPEEDUP: Final = {1: 120.0, 2: 60.0}  # vehicles: simulated seconds per wall second
LEAST_RATIO: Final = 0.85
MOST_HELP_S: Final = 0.3
MOST_START_S: Final = 1.5

_UNTIL_FIRST_STEP: Final = """
import gc, sys
from missions.cli.main import YOUNG_OBJECTS, main
gc.set_threshold(YOUNG_OBJECTS)  # as `main` does
from autopilot_bridge.sitl import Sitl

class Begun(BaseException): pass

def first_step(self):
    raise Begun

Sitl.advance = first_step
sys.argv = ["flightstack", "fly", "lissajous", "--out", sys.argv[1]]
try:
    main()
except Begun:
    sys.exit(0)
sys.exit("no physics step was made")
"""


def sitl_alone(flight: Flight) -> float:
    """Simulated seconds per wall second of the SITL, its log included."""
    start_s = time.perf_counter()
    flight.run(PIECE_S)
    return PIECE_S / (time.perf_counter() - start_s)


def mission(vehicles: int, out: Path) -> float:
    """`speedup` of one flight."""
    request = RunRequest(
        options=FlightOptions(vehicles=vehicles),
        world=WorldSpec.of_team(vehicles, seed=SEED),
        out=out,
        picture=False,
    )
    result = fly("lissajous", request)
    if result.outcome != "completed":
        raise RuntimeError(f"the flight was not completed: {result.reason}")
    return float(result.summary["speedup"])


def fastest_s(rounds: int, make: Callable[[int], list[str]]) -> float:
    """Wall seconds of the fastest of so many processes."""
    seconds = []
    for number in range(rounds):
        start_s = time.perf_counter()
        subprocess.run(make(number), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - start_s)
    return min(seconds)


def main() -> int:
    """Print the table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=4)
    rounds = parser.parse_args().rounds
    gc.set_threshold(YOUNG_OBJECTS)
    out = sys.stdout.write
    missed = False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mission(1, folder / "warm")
        out("vehicles  SITL alone  fly lissajous  ratio  (simulated s per wall s)\n")
        for vehicles, least in LEAST_SPEEDUP.items():
            flight = Flight(vehicles, "iris", "px4", folder / f"alone{vehicles}.tlog")
            flight.take_off()
            alone, flown = 0.0, 0.0
            for number in range(rounds):
                alone = max(alone, sitl_alone(flight))
                flown = max(flown, mission(vehicles, folder / f"{vehicles}-{number}"))
            flight.close()
            missed |= flown < least or flown < LEAST_RATIO * alone
            out(f"{vehicles:>8} {alone:>11.0f} {flown:>14.0f} {flown / alone:>6.2f}\n")
        help_s = fastest_s(rounds, lambda _: [sys.executable, "-m", "missions", "--help"])
        start_s = fastest_s(
            rounds, lambda number: [sys.executable, "-c", _UNTIL_FIRST_STEP, str(folder / f"start{number}")]
        )
    out(f"flightstack --help: {help_s:.2f} s; fly until the first physics step: {start_s:.2f} s\n")
    missed |= help_s > MOST_HELP_S or start_s > MOST_START_S
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
