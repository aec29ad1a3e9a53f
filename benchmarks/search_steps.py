"""Steps of 9 m of a multi-target search: the trajectory law and the backstepping law on SITL.

    python -m benchmarks.search_steps [--autopilot px4] [--speed 4] [--steps 8]

The quadrotor flies a square of steps, and the reference jumps to the next corner after 8 s: a piecewise
constant reference as in Yousuf, Lendek and Busoniu, whose vehicle takes 2.6 s per step. By the truth: time
from the jump until the vehicle has covered 9 m less 2 m (where the search plans its next step), and less 0.5
m; overshoot along the step, and deviation across it, from the place at rest. The autopilot's own position
controller, which gets the jumps as position setpoints, is measured beside them.
"""

import argparse
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.world_spec import WorldSpec
from missions.base.mission import Mission
from missions.base.options import MissionOptions
from missions.base.request import RunRequest
from missions.flown.records import FlightRecords, positions_ned_m
from missions.runs.session import fly
from missions.search.steps import BacksteppingLaw, TrajectoryLaw
from missions.vehicle.limits import MulticopterLimits
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.telemetry import Position

STEP_M = 9.0
HOLD_S = 8.0
HEIGHT_M = 20.0
CORNERS = [(0.0, 0.0), (STEP_M, 0.0), (STEP_M, STEP_M), (0.0, STEP_M)]


class PositionLaw:
    """The reference itself as position setpoint."""

    def __init__(
        self, *, place_ned_m: Any, speed_m_s: float, limits: MulticopterLimits, yaw_rad: float
    ) -> None:
        self._aim = place_ned_m

    def aim(self, place_ned_m: Any) -> None:
        """Fly to another place."""
        self._aim = place_ned_m

    def setpoint(self, time_s: float, place_ned_m: Any, velocity_ned_m_s: Any) -> Setpoint:
        """The place."""
        return Setpoint(position_ned_m=self._aim, yaw_rad=0.0)


LAWS: dict[str, Any] = {"trajectory": TrajectoryLaw, "backstepping": BacksteppingLaw, "position": PositionLaw}


class Steps(Mission[MissionOptions]):
    """The flight; stores the vehicle time and the places of each jump."""

    name = "steps"

    def __init__(self, law: Any, speed_m_s: float, steps: int) -> None:
        self.jumps: list[tuple[int, tuple[float, float], tuple[float, float]]] = []
        self.home: GeodeticPosition | None = None
        self._law, self._speed_m_s, self._steps = law, speed_m_s, steps

    async def fly(self, vehicle: Any, options: MissionOptions) -> None:
        """Take off, fly the steps, return."""
        limits = await vehicle.limits(HEIGHT_M)
        await vehicle.commands.set_message_rate("GLOBAL_POSITION_INT", 50.0)
        await vehicle.takeoff(HEIGHT_M)
        self.home = vehicle.home
        frame = LocalFrame(vehicle.home)
        law = self._law(
            place_ned_m=(0.0, 0.0, -HEIGHT_M), speed_m_s=self._speed_m_s, limits=limits, yaw_rad=0.0
        )

        def source(time_s: float) -> Setpoint | None:
            number = math.floor(time_s / HOLD_S)
            if number > self._steps:
                return None
            if number > len(self.jumps):
                before, after = CORNERS[(number - 1) % 4], CORNERS[number % 4]
                law.aim((*after, -HEIGHT_M))
                self.jumps.append((vehicle.clock.stamp_us, before, after))
            p = vehicle.latest(Position)
            here = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
            found: Setpoint = law.setpoint(time_s, here, p.vel_ned_m_s)
            return found

        await vehicle.follow(source, 50.0)
        await vehicle.return_to_launch()


def measured(mission: Steps, log: Path) -> list[tuple[float, float, float, float]]:
    """Time to 7 m and to 8.5 m, overshoot and deviation of each step."""
    truth = FlightRecords.from_tlog(log).table("HIL_STATE_QUATERNION", 1)
    assert mission.home is not None
    north, east, _ = positions_ned_m(truth, LocalFrame(mission.home)).T
    found = []
    for time_us, before, after in mission.jumps:
        inside = (truth["time_usec"] >= time_us) & (truth["time_usec"] < time_us + HOLD_S * 1e6)
        time_s = (truth["time_usec"][inside] - time_us) * 1e-6
        unit = ((after[0] - before[0]) / STEP_M, (after[1] - before[1]) / STEP_M)
        n, e = north[inside] - before[0], east[inside] - before[1]
        along, across = n * unit[0] + e * unit[1], e * unit[0] - n * unit[1]
        seven, nearly = (float(time_s[np.argmax(along >= STEP_M - left)]) for left in (2.0, 0.5))
        rest = time_s > HOLD_S - 1.0  # the place at rest is off by the error of the navigation filter
        over_m, off_m = along.max() - along[rest].mean(), np.abs(across - across[rest].mean()).max()
        found.append((seven, nearly, float(over_m), float(off_m)))
    return found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--autopilot", default="px4")
    parser.add_argument("--speed", type=float, default=4.0)
    parser.add_argument("--steps", type=int, default=8)
    given = parser.parse_args()
    sys.stdout.write(f"{'law':<14} {'to 7 m':>8} {'to 8.5 m':>9} {'overshoot':>10} {'across':>8}\n")
    for name, law in LAWS.items():
        mission = Steps(law, given.speed, given.steps)
        with tempfile.TemporaryDirectory() as folder:
            request = RunRequest(
                options=MissionOptions(altitude_m=HEIGHT_M),
                world=WorldSpec.of_team(1, autopilot=given.autopilot, seed=1),
                out=Path(folder) / "run",
                picture=False,
            )
            result = fly(mission, request)
            if result.outcome != "completed":
                sys.stdout.write(f"{name:<14} {result.reason}\n")
                continue
            rows = np.array(measured(mission, result.folder / "flight.tlog"))
        seven, nearly = rows[:, 0].mean(), rows[:, 1].mean()
        sys.stdout.write(
            f"{name:<14} {seven:6.2f} s {nearly:7.2f} s {rows[:, 2].max():8.2f} m {rows[:, 3].max():6.2f} m\n"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
