"""What a viewer costs a flight: an embedded Lissajous flight with and without one, in turns.

    python -m benchmarks.view_cost [--rounds 5] [--mcap]

Each round flies `lissajous --seed 2` in this process, as the command line does, with its picture: without a
viewer, with `--view FILE.rrd`, and, on request, with `--view FILE.mcap`. Processor time of this process
counts, and the fastest of the rounds, since what else the machine does can only slow one. Compiled code and
imports are warmed up before. Exit code 1 if `FILE.rrd` slows the flight by more than its bound.
"""

import argparse
import gc
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

from flightsim import WorldSpec
from missions import FlightOptions, RunRequest, fly
from missions.cli.main import YOUNG_OBJECTS
from missions.view.opening import open_viewer
from missions.view.target import parse_view

SEED: Final = 2
MOST_SLOWER: Final = 0.25


def flown_s(view: str | None, folder: Path) -> float:
    """Processor seconds of one flight, with its summary, picture and file."""
    viewer = None if view is None else open_viewer(parse_view(str(folder / f"flight.{view}")))
    request = RunRequest(
        options=FlightOptions(), world=WorldSpec.of_team(seed=SEED), out=folder / "run", view=viewer
    )
    start_s = time.process_time()
    result = fly("lissajous", request)
    spent_s = time.process_time() - start_s
    if result.outcome != "completed":
        sys.exit(f"the flight failed: {result.reason}")
    return spent_s


def _write(line: str) -> None:
    sys.stdout.write(f"{line}\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--mcap", action="store_true", help="FILE.mcap, too, with the raw messages as JSON")
    arguments = parser.parse_args()
    views = (None, "rrd", "mcap") if arguments.mcap else (None, "rrd")
    gc.set_threshold(YOUNG_OBJECTS)
    spent: dict[str | None, list[float]] = {view: [] for view in views}
    for number in range(arguments.rounds + 1):
        for view in views:
            with tempfile.TemporaryDirectory() as folder:
                seconds = flown_s(view, Path(folder))
            if number:  # the first round warms up
                spent[view].append(seconds)
    without_s = min(spent[None])
    _write(f"without a viewer: {without_s:.2f} s of the processor")
    slower = {view: min(seconds) / without_s - 1.0 for view, seconds in spent.items() if view is not None}
    for view, share in slower.items():
        _write(f"with FILE.{view}: {min(spent[view]):.2f} s, {100.0 * share:+.0f} %")
    if slower["rrd"] > MOST_SLOWER:
        sys.exit(f"FILE.rrd slows the flight by more than {100.0 * MOST_SLOWER:.0f} %")


if __name__ == "__main__":
    main()
