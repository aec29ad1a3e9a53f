"""How well aircraft fly a mission in rough air: 240 missions, by the truth.

    python -m benchmarks.aircraft_missions [--flavour px4] [--plan sharp] [--seeds 0-3] [--each]

Every flavour x plan (rectangle, sharp corners) x launch (runway, catapult, hand) x direction of 6 m/s of
wind (0, 60, 120, 240, 300 degrees from the runway's) x seed, in moderate turbulence, from the take-off to the
touch. What is required of each: across the legs less than 5 m RMS, height 2 m, airspeed (the true one, gusts
included) 1 m/s, no airspeed below 14 m/s. Exit code 1: some mission missed one of these.
"""

import argparse
import itertools
import statistics
import sys

from tests.flights.aircraft_figures import MissionFigures, rms
from tests.flights.test_aircraft_missions import DIRECTIONS_DEG, LAUNCHES, PLANS, Case, fly_case, shortfalls

_FIGURES = (
    "across m",
    "height m",
    "airspeed m/s",
    "lowest m/s",
    "touch along m",
    "touch across m",
    "sink m/s",
    "go-arounds",
)


def _numbers(figures: MissionFigures) -> tuple[float, ...]:
    return (
        rms(figures.across_m),
        rms(figures.height_m),
        rms(figures.airspeed_m_s),
        figures.lowest_airspeed_m_s,
        abs(figures.touch_along_m),
        abs(figures.touch_across_m),
        figures.touch_sink_m_s,
        figures.go_arounds,
    )


def _table(flavour: str, rows: list[tuple[float, ...]]) -> str:
    lines = [f"\n{flavour}, {len(rows)} missions {'median':>12} {'95 %':>8} {'worst':>8}"]
    for name, column in zip(_FIGURES, zip(*rows, strict=True), strict=True):
        ordered = sorted(column, reverse=name.startswith("lowest"))
        most = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
        lines.append(f"  {name:<16}{'':>8} {statistics.median(ordered):12.2f} {most:8.2f} {ordered[-1]:8.2f}")
    return "\n".join(lines)


def main() -> int:
    """Fly them all and print a table for each flavour."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--flavour", choices=("px4", "ardupilot"), help="one flavour alone")
    parser.add_argument("--plan", choices=tuple(PLANS), help="one plan alone")
    parser.add_argument("--seeds", default="0-3", help="first and last seed (default 0-3)")
    parser.add_argument("--each", action="store_true", help="a line for each mission")
    arguments = parser.parse_args()
    first, _, last = arguments.seeds.partition("-")
    flavours = (arguments.flavour,) if arguments.flavour else ("px4", "ardupilot")
    plans = (arguments.plan,) if arguments.plan else tuple(PLANS)
    seeds = range(int(first), int(last or first) + 1)
    rows: dict[str, list[tuple[float, ...]]] = {flavour: [] for flavour in flavours}
    missed = 0
    for seed, flavour, name, launch, wind_deg in itertools.product(
        seeds, flavours, plans, LAUNCHES, DIRECTIONS_DEG
    ):
        figures = fly_case(Case(flavour, launch, PLANS[name], wind_deg, seed))
        rows[flavour].append(_numbers(figures))
        short = shortfalls(figures)
        missed += bool(short)
        if arguments.each or short:
            case = f"{flavour} {name} {launch or 'runway'} wind {wind_deg:.0f} seed {seed}"
            sys.stdout.write(f"{case}: {figures}{'  MISSED: ' if short else ''}{', '.join(short)}\n")
            sys.stdout.flush()
    for flavour in flavours:
        sys.stdout.write(_table(flavour, rows[flavour]) + "\n")
    sys.stdout.write(f"\n{missed} missions missed something\n")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
