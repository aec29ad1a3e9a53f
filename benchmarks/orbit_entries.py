"""The GPS-denied orbit from many entry geometries, one row per flight, and the worst and median at the end.

    python benchmarks/orbit_entries.py [--entry 0 --entry 7] [--direction cw] [--autopilot px4]
                                       [--target-speed 0 --target-speed 2] [--duration 600] [--radius 150]

Every flight is `flightstack fly orbit` in an embedded world: GPS lost at the entry, 4 m/s of wind and light
turbulence. Without options: ten entries, both directions, both autopilots, a target that stands and one that
moves at 2 m/s, 600 s each: 80 flights. The figures are of truth; requested are a mean radius error below 5 %,
a standard deviation below 8 m and an altitude within 10 m, and the exit code is 1 when a flight misses one.
"""

import argparse
import itertools
import math
import statistics
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimators.orbit_target.parameters import OrbitTargetParameters
from flightsim.environment import Environment
from flightsim.world_spec import WorldSpec
from missions.base.given_text import parse_wind
from missions.errors import PlanError
from missions.library import find_mission
from missions.orbit.options import Direction, OrbitOptions
from missions.orbit.world import orbit_world
from missions.runs.session import COMPLETED, RunRequest, fly

MEAN_ERROR_PERCENT, STD_M, ALTITUDE_M = 5.0, 8.0, 10.0
FIGURES = ("radius_mean_error_percent", "radius_std_m", "altitude_error_m")
BOUNDS = dict(zip(FIGURES, (MEAN_ERROR_PERCENT, STD_M, ALTITUDE_M), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """Where GPS is lost.

    Attributes:
        bearing_deg: from the target to there.
        distance_m: between the two.
        heading_deg: of the nose there.
        words: what that is like.
    """

    bearing_deg: float
    distance_m: float
    heading_deg: float
    words: str


ENTRIES = (
    Entry(bearing_deg=180.0, distance_m=400.0, heading_deg=0.0, words="south, straight for it"),
    Entry(bearing_deg=0.0, distance_m=400.0, heading_deg=180.0, words="north, straight for it, wind behind"),
    Entry(bearing_deg=90.0, distance_m=300.0, heading_deg=0.0, words="east, passing, target to the left"),
    Entry(bearing_deg=270.0, distance_m=300.0, heading_deg=0.0, words="west, passing, target to the right"),
    Entry(bearing_deg=45.0, distance_m=500.0, heading_deg=45.0, words="north-east, flying away"),
    Entry(bearing_deg=225.0, distance_m=250.0, heading_deg=225.0, words="south-west, near, flying away"),
    Entry(bearing_deg=135.0, distance_m=150.0, heading_deg=225.0, words="on the circle, clockwise"),
    Entry(bearing_deg=315.0, distance_m=150.0, heading_deg=225.0, words="on the circle, counter-clockwise"),
    Entry(bearing_deg=300.0, distance_m=60.0, heading_deg=80.0, words="within the circle"),
    Entry(bearing_deg=160.0, distance_m=700.0, heading_deg=290.0, words="far, oblique"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One flight."""

    autopilot: str
    entry: int
    direction: str
    target_speed_m_s: float
    seed: int

    def options(self, duration_s: float, radius_m: float) -> OrbitOptions:
        """As `flightstack fly orbit` makes them; a moving target goes north-east."""
        entry = ENTRIES[self.entry]
        return OrbitOptions(
            direction=Direction.CW if self.direction == "cw" else Direction.CCW,
            duration_s=duration_s,
            radius_m=radius_m,
            estimator=OrbitTargetParameters(
                target_speed_m_s=self.target_speed_m_s, target_heading_rad=math.radians(45.0)
            ),
            entry_bearing_rad=math.radians(entry.bearing_deg),
            entry_distance_m=entry.distance_m,
            entry_heading_rad=math.radians(entry.heading_deg),
        )


def fly_case(
    case: Case, *, duration_s: float, radius_m: float, wind: str, turbulence: str
) -> tuple[str, Mapping[str, Any]]:
    """One flight: why it failed ("" if it didn't), and its summary."""
    speed_m_s, from_deg = parse_wind(wind)
    options = case.options(duration_s, radius_m)
    world = WorldSpec.of_team(
        model="aerosonde",
        autopilot=case.autopilot,
        seed=case.seed,
        air=Environment.from_wind(speed_m_s=speed_m_s, from_deg=from_deg, turbulence=turbulence),
    )
    with tempfile.TemporaryDirectory() as folder:
        try:
            result = fly(
                find_mission("orbit"),
                RunRequest(
                    options=options,
                    world=orbit_world(world, options),
                    out=Path(folder) / "run",
                    picture=False,
                ),
            )
        except PlanError as error:
            return f"refused: {error}", {}
    return ("" if result.outcome == COMPLETED else result.reason or result.outcome), result.summary


def verdict(summary: Mapping[str, Any], duration_s: float) -> str:
    """What a flight that was flown to its end misses; "" if nothing."""
    missed = [
        f"{name} {summary[name]} is not within {bound:g}"
        for name, bound in BOUNDS.items()
        if summary[name] is None or not abs(summary[name]) < bound
    ]
    if not (summary["orbit_s"] or 0.0) >= duration_s - 1.0:
        missed.append(f"on the orbit for {summary['orbit_s']} s only")
    return "; ".join(missed)


def say(line: str) -> None:
    """A line, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is requested; 1 when a flight fails or misses a bound."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--entry", type=int, action="append", choices=range(len(ENTRIES)))
    parser.add_argument("--direction", action="append", choices=["cw", "ccw"])
    parser.add_argument("--autopilot", action="append", choices=["px4", "ardupilot"])
    parser.add_argument("--target-speed", type=float, action="append", help="m/s")
    parser.add_argument("--duration", type=float, default=600.0, help="on the orbit, s")
    parser.add_argument("--radius", type=float, default=150.0, help="m")
    parser.add_argument("--wind", default="4@0", help="SPEED[@FROM]")
    parser.add_argument("--turbulence", default="light", choices=["none", "light", "moderate", "severe"])
    parser.add_argument("--seed", type=int, default=1, help="of entry 0; each entry has its own")
    chosen = parser.parse_args(arguments)
    entries = chosen.entry or range(len(ENTRIES))
    for index in entries:
        entry = ENTRIES[index]
        say(
            f"# entry {index}: {entry.distance_m:g} m from the target at bearing {entry.bearing_deg:g}, "
            f"heading {entry.heading_deg:g}: {entry.words}"
        )
    header = f"{'flavour':<10} {'entry':>5} {'dir':>4} {'target m/s':>10} {'seed':>5}"
    header += "".join(f" {name:>{width}}" for name, width in zip(FIGURES, (26, 13, 17), strict=True))
    say(f"{header} {'exit':>5}")
    rows: list[tuple[Case, Mapping[str, Any]]] = []
    failed = 0
    for autopilot, speed, index, direction in itertools.product(
        chosen.autopilot or ("px4", "ardupilot"),
        chosen.target_speed or (0.0, 2.0),
        entries,
        chosen.direction or ("cw", "ccw"),
    ):
        case = Case(
            autopilot=autopilot,
            entry=index,
            direction=direction,
            target_speed_m_s=speed,
            seed=chosen.seed + index,
        )
        reason, summary = fly_case(
            case,
            duration_s=chosen.duration,
            radius_m=chosen.radius,
            wind=chosen.wind,
            turbulence=chosen.turbulence,
        )
        reached = {name: summary.get(name) for name in FIGURES}
        shown = [f"{'-' if value is None else format(value, '.3f')}" for value in reached.values()]
        say(
            f"{case.autopilot:<10} {case.entry:>5} {case.direction:>4} {case.target_speed_m_s:>10g} "
            f"{case.seed:>5} {shown[0]:>26} {shown[1]:>13} {shown[2]:>17} {1 if reason else 0:>5}"
        )
        wrong = reason or verdict(summary, chosen.duration)
        if wrong:
            failed += 1
            say(f"    {wrong}")
        rows.append((case, summary))
    say(f"flights: {len(rows)}, outside the bounds or failed: {failed}")
    for name, bound in BOUNDS.items():
        values = [abs(summary[name]) for _, summary in rows if summary.get(name) is not None]
        if values:
            say(f"{name}: worst {max(values):.3f}, median {statistics.median(values):.3f} (bound {bound:g})")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
