"""How fast a magnetic search by three aircraft that identifies is, beside the SITL alone.

    python -m benchmarks.search_speed [--rounds 3]

In each round, one after the other in one process: the SITL alone flies three aerosondes round a square, with
their messages and the truth in a log (`benchmarks.sitl_speed`); `fly occupancy --vehicles 3 --identify
bayes --false-anomalies 5 --seed 3` without its picture; and the estimator of that search alone, with 10,000
particles of each class, over the three aircraft's messages in the log of the flight. Seconds are those of the
processor, so that other processes count less; they do count when they share caches and cores. The best of the
rounds counts. Compiled code is warmed up by a short search before. Exit code 1 if the estimator or the search
misses the bound.

The search has more to do than the SITL alone: wind, turbulence, magnetometers, position and attitude at the
rates that flying headings takes, 10 commands a second, and the evaluation after the flight.
"""

import argparse
import gc
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

from benchmarks.sitl_speed import Flight
from missions.cli.main import YOUNG_OBJECTS, run_command_line

VEHICLES: Final = 3
PIECE_S: Final = 60.0
LEAST_SPEEDUP: Final = 40.0  # simulated seconds per second of the processor
SEARCH: Final = (
    *("fly", "occupancy", "--vehicles", str(VEHICLES), "--identify", "bayes"),
    *("--false-anomalies", "5", "--seed", "3", "--no-picture", "--out"),
)


def sitl_alone(flight: Flight) -> float:
    """Simulated seconds per processor second of the SITL, its log included."""
    start_s = time.process_time()
    flight.run(PIECE_S)
    return PIECE_S / (time.process_time() - start_s)


def search(out: Path, *options: str) -> float:
    """Simulated seconds per processor second of one search, from the command to its summary."""
    start_s = time.process_time()
    if run_command_line([*SEARCH, str(out), *options]):
        raise RuntimeError(f"the search failed; see {out}")
    used_s = time.process_time() - start_s
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    return float(summary["sim_time_s"]) / used_s


def estimator_alone(run: Path, out: Path) -> float:
    """Simulated seconds per processor second of the estimator over the log of a search, which it reads."""
    start_s = time.process_time()
    options = ("particles=10000", f"map_file={run / 'magnetic_map.npz'}")
    sets = [word for option in options for word in ("--set", option)]
    command = ("replay", str(run / "flight.tlog"), "--estimator", "magnetic-identification")
    if run_command_line([*command, *sets, "--out", str(out)]):
        raise RuntimeError(f"the replay failed; see {out}")
    used_s = time.process_time() - start_s
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    return float(summary["sim_time_s"]) / used_s


def main() -> int:
    """Print the figures; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    gc.set_threshold(YOUNG_OBJECTS)  # as the command line does
    alone, searched, estimated = 0.0, 0.0, 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        search(folder / "warm", "--search-time", "60")
        flight = Flight(VEHICLES, "aerosonde", "px4", folder / "alone.tlog")
        flight.take_off()
        for number in range(rounds):
            alone = max(alone, sitl_alone(flight))
            searched = max(searched, search(folder / str(number)))
            estimated = max(estimated, estimator_alone(folder / str(number), folder / f"estimates{number}"))
        flight.close()
    sys.stdout.write(
        f"{VEHICLES} aircraft, simulated s per processor s: estimator alone {estimated:.0f}, SITL alone "
        f"{alone:.1f}, search {searched:.1f}; search to SITL {searched / alone:.2f}\n"
    )
    return int(min(searched, estimated) < LEAST_SPEEDUP)


if __name__ == "__main__":
    sys.exit(main())
