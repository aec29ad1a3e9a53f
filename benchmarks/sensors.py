"""Cost of the sensor suite: microseconds per physics step at 250 Hz, and per sample of each sensor.

python benchmarks/sensors.py [steps]
"""

import sys
import time
from dataclasses import fields

import numpy as np

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.sensors import SensorSuite, SensorSuiteParameters

PHYSICS_RATE_HZ = 250
STEP_US = 1_000_000 // PHYSICS_RATE_HZ
REPEATS = 5


def hover_truth() -> np.ndarray:
    """A vehicle hovering at 5 m."""
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD], truth[t.ALT_M] = 0.8, 0.15, 500.0
    truth[t.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = (0.0, 0.0, -9.81)
    truth[t.PRESSURE_PA], truth[t.TEMPERATURE_K] = 95461.0, 284.9
    truth[t.MAG_NED_GAUSS] = (0.21, 0.01, 0.43)
    truth[t.HEIGHT_ABOVE_GROUND_M] = 5.0
    truth[t.BATTERY_VOLTAGE_V], truth[t.BATTERY_CURRENT_A], truth[t.BATTERY_CAPACITY_AH] = 11.8, 14.0, 5.0
    return truth


def us_per_step(parameters: SensorSuiteParameters, steps: int) -> float:
    """Best of several runs, compiled kernels warm."""
    streams = RandomStreams(1)
    suite = SensorSuite(
        parameters,
        physics_rate_hz=PHYSICS_RATE_HZ,
        truth=hover_truth(),
        seeds=lambda name: streams.child("sensor", name),
    )
    for step in range(PHYSICS_RATE_HZ):
        suite.step(step * STEP_US)
    best = float("inf")
    for _ in range(REPEATS):
        begin = time.perf_counter()
        for step in range(steps):
            suite.step(step * STEP_US)
        best = min(best, time.perf_counter() - begin)
    return 1e6 * best / steps


def main() -> None:
    """Print the table."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 50_000
    names = [field.name for field in fields(SensorSuiteParameters)]
    everything = SensorSuiteParameters()
    total = us_per_step(everything, steps)
    empty = us_per_step(SensorSuiteParameters(**dict.fromkeys(names)), steps)
    out = sys.stdout.write
    out(f"{'whole suite':14s} {total:6.2f} us per physics step at {PHYSICS_RATE_HZ} Hz\n")
    out(f"{'no sensors':14s} {empty:6.2f} us per physics step\n")
    for name in names:
        one = dict.fromkeys(names) | {name: getattr(everything, name)}
        cost = us_per_step(SensorSuiteParameters(**one), steps) - empty
        per_sample = cost * PHYSICS_RATE_HZ / getattr(everything, name).rate_hz
        out(f"{name:14s} {cost:6.2f} us per physics step, {per_sample:6.2f} us per sample\n")


if __name__ == "__main__":
    main()
