"""How well the navigation filter's covariance describes its errors: whole flights over seeds, in a table.

    python -m benchmarks.consistency [--seeds 20] [--cases standalone] [--processes 2]

Takes off and flies a three-dimensional curve with every seed, on both flavours: with the firmware's default
parameters and with parameters that match the simulated sensors, by a receiver with corrections and by a
standalone one, and with noise that the parameters don't describe. NEES (normalised estimation error squared)
is per degree of freedom: 1 where the covariance describes the errors, less where it is too large.
"""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Final

import numpy as np
from scipy.stats import chi2

from tests.flights.consistency import PARTS, Case, fly_consistency

CASES: Final = {
    "defaults": Case(),
    "defaults, spoiled": Case(spoiled=True),
    "defaults, standalone": Case(gps="standalone"),
    "defaults, standalone, spoiled": Case(gps="standalone", spoiled=True),
    "matched": Case(tuned=True),
    "matched, spoiled": Case(tuned=True, spoiled=True),
    "matched, standalone": Case(gps="standalone", tuned=True),
}


def main() -> None:
    """Fly all cases and print a row for each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--cases", default="", help="only cases whose name contains this")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    seeds = arguments.seeds
    low, high = chi2.ppf([0.025, 0.975], 3 * seeds) / (3 * seeds)
    write = sys.stdout.write
    write(
        f"NEES per degree of freedom, mean of {seeds} seeds; 95 % band of the mean {low:.2f} to {high:.2f}\n"
    )
    write("RMS errors: attitude deg, velocity m/s, position m (3 axes); distance from the curve m RMS\n\n")
    write(f"| flavour, case | {' | '.join(PARTS)} | attitude | velocity | position | off curve |\n")
    write("|---|---|---|---|---|---|---|---|\n")
    pool = ProcessPoolExecutor(arguments.processes)
    for flavour in ("px4", "ardupilot"):
        for name, case in CASES.items():
            if arguments.cases not in f"{flavour}, {name}":
                continue
            flights = list(pool.map(partial(fly_consistency, flavour=flavour, case=case), range(seeds)))
            nees = np.mean([flight.nees.mean(axis=0) / 3.0 for flight in flights], axis=0)
            squares = np.mean([(flight.errors**2).mean(axis=0) for flight in flights], axis=0)
            attitude, velocity, position = (np.sqrt(squares[part].sum()) for part in PARTS.values())
            off_curve_m = np.sqrt(np.mean([np.mean(flight.off_curve_m**2) for flight in flights]))
            figures = " | ".join(f"{value:.2f}" for value in nees)
            write(f"| {flavour}, {name} | {figures} | {np.degrees(attitude):.2f} | {velocity:.3f} ")
            write(f"| {position:.2f} | {off_curve_m:.2f} |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
