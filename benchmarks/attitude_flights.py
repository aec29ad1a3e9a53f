"""Errors of the attitude filter on SITL flights with turns to 45 degrees of bank, in wind and turbulence.

    python benchmarks/attitude_flights.py [--seeds 20] [--first-seed 1]

Every flight is a whole one of the embedded Aerosonde with its sensors, the filter fed by its telemetry; the
errors are against the truth, in the air. Odd seeds fly with ArduPilot; two of four have moderate turbulence.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from tests.estimators.attitude.wing_flight import PAPER_DEG2, FlightErrors, fly_turns


def line(name: str, found: list[FlightErrors]) -> str:
    """Means over flights."""
    square = np.mean([one.mean_square_deg2 for one in found], axis=0)
    mean = np.mean([one.mean_deg for one in found], axis=0)
    worst = np.max([one.worst_deg for one in found], axis=0)
    normalised = np.mean([one.normalised for one in found], axis=0)
    return (
        f"{name:28s} {square[0]:7.3f} {square[1]:7.3f}   {mean[0]:+6.2f} {mean[1]:+6.2f}   "
        f"{worst[0]:6.1f} {worst[1]:6.1f}   {normalised[0]:5.2f} {normalised[1]:5.2f}\n"
    )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1)
    arguments = parser.parse_args()
    write = sys.stdout.write
    write(f"{'':28s} mean square deg^2   mean error deg   worst deg       over variance\n")
    write(f"{'':28s}    roll   pitch     roll  pitch     roll  pitch    roll pitch\n")
    found: list[FlightErrors] = []
    for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
        found.append(fly_turns(seed))
        write(line(f"{seed} {found[-1].flavour} {found[-1].turbulence}", found[-1:]))
        sys.stdout.flush()
    for turbulence in sorted({one.turbulence for one in found}):
        write(line(f"{turbulence} turbulence", [one for one in found if one.turbulence == turbulence]))
    write(line("all", found))
    write(f"{'paper, Table I':28s} {PAPER_DEG2[0]:7.3f} {PAPER_DEG2[1]:7.3f}    +1.28  -0.66\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
